"""Shaders' inputs, and what they lead to: a value, or the output of another shader."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pxr import Gf, Sdf, Usd, UsdShade, Vt

MOST_STEPS = 64  # nodes in a row between a parameter and its image

AS_THEY_ARE = ("", "raw", "data", "unknown", "identity", "lin_rec709_scene")
# Names of MaterialX for the library's spaces.
SPACES = {
    "srgb_texture": "srgb_rec709_scene", "sRGB": "srgb_rec709_scene", "lin_rec709": "lin_rec709_scene",
    "lin_srgb": "lin_rec709_scene", "g22_rec709": "g22_rec709_scene", "g18_rec709": "g18_rec709_scene",
    "acescg": "lin_ap1_scene", "lin_ap1": "lin_ap1_scene", "g22_ap1": "g22_ap1_scene",
    "lin_displayp3": "lin_p3d65_scene", "srgb_displayp3": "srgb_p3d65_scene", "adobergb": "g22_adobergb_scene",
    "lin_adobergb": "lin_adobergb_scene",
}  # fmt: skip


@dataclass(frozen=True)
class Node:
    """A shader, and which of its outputs is used."""

    shader: UsdShade.Shader
    output: str
    time: Usd.TimeCode

    @property
    def kind(self) -> str:
        """The node's name in its library: UsdUVTexture, ND_image_color3."""
        return str(self.shader.GetIdAttr().Get() or "")

    @property
    def pointer(self) -> str:
        return str(self.shader.GetPath())

    def at(self, name: str) -> str:
        return f"{self.pointer}.inputs:{name}"

    def has(self, name: str) -> bool:
        """True if the file says anything about an input; the interface of a group may say nothing."""
        return self.input(name) is not None

    def own(self, name: str) -> Any:
        """The value that an input has by itself, whatever it is connected to; None where it has none."""
        found = self.shader.GetInput(name)
        return linear(found.GetAttr(), plain(found.GetAttr().Get(self.time))) if found else None

    def space(self, name: str) -> str:
        """The colour space of an input's value, which an interface may have; "" where the file does not say it."""
        found = self.shader.GetInput(name)
        sources = UsdShade.Utils.GetValueProducingAttributes(found) if found else []
        return str(sources[0].GetColorSpace()) if sources else ""

    def input(self, name: str, default: Any = None) -> Any:
        """An input: a Node where it is connected to one, else a value: numbers as floats, or a tuple of them."""
        found = self.shader.GetInput(name)
        return follow(found, self.time, default) if found else default

    def value(self, name: str, default: Any = None) -> Any:
        """The value of an input that only a constant makes sense for."""
        found = self.input(name, default)
        return default if isinstance(found, Node) else found

    def number(self, name: str, default: float) -> float:
        found = self.value(name, default)
        return float(found) if isinstance(found, int | float) else default

    def numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        found = self.value(name, default)
        if isinstance(found, int | float):
            return (float(found),) * len(default)
        return found if isinstance(found, tuple) and len(found) == len(default) else default


def follow(given: UsdShade.Input | UsdShade.Output, time: Usd.TimeCode, default: Any = None) -> Any:
    """The value or node of an input, through the interfaces of groups of nodes; `default` where nothing is said."""
    sources = UsdShade.Utils.GetValueProducingAttributes(given)
    if not sources:
        return default
    source = sources[0]
    if UsdShade.Output.IsOutput(source):
        shader = UsdShade.Shader(source.GetPrim())
        return Node(shader, str(source.GetBaseName()), time) if shader else default
    return linear(source, plain(source.Get(time), default))


def linear(source: Usd.Attribute, value: Any) -> Any:
    """A colour in linear Rec.709, by the space that its attribute or a prim above names; any other value as it is."""
    if source.GetRoleName() != Sdf.ValueRoleNames.Color or not isinstance(value, tuple):
        return value
    space = str(source.GetColorSpace() or Usd.ColorSpaceAPI.ComputeColorSpaceName(source, None))
    space = SPACES.get(space, space)
    if space in AS_THEY_ARE or len(value) < 3 or not Gf.ColorSpace.IsValid(space):
        return value
    ours = Gf.ColorSpace(Gf.ColorSpaceNames.LinearRec709)
    found = ours.Convert(Gf.ColorSpace(space), Gf.Vec3f(*value[:3]))
    return (*(_shortest(each) for each in found.GetRGB()), *value[3:])


def surface_of(material: UsdShade.Material, context: str, time: Usd.TimeCode) -> Node | None:
    """The shader of a material's surface in a render context; "" is everybody's."""
    return _shader(material.GetSurfaceOutput(context), time)


def others_of(material: UsdShade.Material, time: Usd.TimeCode) -> list[tuple[str, Node]]:
    """The shaders of what a material has beside its surface, with the names of these things."""
    outputs = {"displacement": material.GetDisplacementOutput, "volume": material.GetVolumeOutput}
    found = [(name, _shader(get(context), time)) for name, get in outputs.items() for context in ("mtlx", "")]
    return [(name, shader) for name, shader in found if shader is not None]


def _shader(output: UsdShade.Output, time: Usd.TimeCode) -> Node | None:
    found = follow(output, time) if output else None
    return found if isinstance(found, Node) else None


def plain(value: Any, default: Any = None) -> Any:
    """A value of the library as one of Python: float, tuple of floats, string, bool; an asset as its path."""
    if value is None:
        return default
    if isinstance(value, bool | str):
        return value
    if isinstance(value, int | float):
        return _shortest(value)
    if isinstance(value, Sdf.AssetPath):
        return str(value.path)
    if isinstance(value, Vt.TokenArray | Vt.StringArray | Gf.Matrix3d | Gf.Matrix4d):
        return default
    try:
        return tuple(_shortest(each) for each in value)
    except (TypeError, ValueError):
        return default


def _shortest(value: float) -> float:
    """A number as its author wrote it: the file has 0.8 in single precision, and not 0.800000011920929."""
    return float(f"{float(value):.7g}")
