"""The inputs of one surface: constants, and images by the nodes that read them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

from service.formats.read.scenes.warnings import Warnings
from service.formats.read.usd.networks import MOST_STEPS, Node
from service.formats.read.usd.pictures import materialx_picture, picture
from service.formats.read.usd.textures import Picture, Role, Textures
from service.formats.surface import Model
from service.formats.surface.inputs import COLORS
from service.formats.surface.plain import Default, Given, PlainInputs

MODES = {"transparent": 0.0, "presence": 1.0}  # names of UsdPreviewSurface's modes of opacity
# Nodes of MaterialX that hand on their input, or a channel of it.
SPLIT = ("extract_", "separate", "swizzle_")
PASSED = ("normalmap", "convert_", "dot_", "constant_", *SPLIT)
Read = dict[str, Any] | tuple[float, ...]  # a reference to a texture, or its numbers
CHANNELS = dict(zip("xyzwrgba", "rgbargba", strict=True))


@dataclass(frozen=True)
class Edge:
    """A place that shows something else than the file's author asks for beyond an image's ends along an axis."""

    chart: str
    placing: dict[str, Any]
    axis: int
    pointer: str
    detail: str


@dataclass
class Uses:
    """What a material uses of its meshes, and what is lost on those that leave an image. Trials of a reading share
    it."""

    charts: list[str] = field(default_factory=list)
    is_colored: bool = False
    edges: list[Edge] = field(default_factory=list)
    unread: int = 0  # images and other nodes

    def texture(self, textures: Textures, picture: Picture, role: Role) -> dict[str, Any] | None:
        """A parameter's reference to the texture of a picture; None where it cannot be used."""
        found = textures.use(picture, role, self.charts)
        if found is None:
            self.unread += 1
        else:
            self.edges += [Edge(picture.chart, dict(picture.placing), *edge) for edge in picture.edges]
        return found


class Reader(PlainInputs):
    """The inputs of one surface."""

    def __init__(self, surface: Node, model: Model, textures: Textures, unit: float, notes: Warnings) -> None:
        super().__init__(model.defaults)
        self.surface, self.textures, self.unit, self.notes = surface, textures, unit, notes
        self.uses = Uses()
        self._unread = surface  # the node of MaterialX at which reading ended
        model.read(self)

    @property
    def document(self) -> dict[str, Any]:
        """The material's; all colours have three numbers."""
        return {
            name: [value] * 3 if name in COLORS and isinstance(value, float) else value
            for name, value in self.material.items()
        }

    def given(self, name: str, default: Default) -> Given | None:
        found = self.surface.input(name)
        if isinstance(found, str):
            if found not in MODES:
                self.warn(name, f"must not be {found[:40]!r}; the parameter has its default")
            found = MODES.get(found)
        if not isinstance(found, Node):
            return cast("Given | None", found)
        own = self.surface.own(name)  # for a connection that cannot be used
        if isinstance(default, tuple):
            return self._read(found, "color", own if isinstance(own, tuple) and len(own) >= 3 else default)
        default = own if isinstance(own, float) else default
        read = self._read(found, "scalar", (default or 0.0,) * 4)
        return read if isinstance(read, dict) else read[0]

    def is_given(self, name: str) -> bool:
        return self.surface.has(name)

    def is_textured(self, name: str) -> bool:
        found = self.surface.input(name)
        return isinstance(found, Node) and not found.kind.startswith("ND_constant_")

    def bump(self, name: str) -> dict[str, Any] | None:
        found = self.surface.input(name)
        if not isinstance(found, Node):
            return None
        read = self._read(found, "normal", ())
        return read if isinstance(read, dict) else None

    def warn(self, name: str, detail: str) -> None:
        self.notes.add(self.surface.at(name), detail)

    def _materialx(self, node: Node, role: Role, steps: int) -> dict[str, Any] | tuple[float, ...] | None:
        """The value or texture of a MaterialX node; None where it computes what is not read."""
        kind = node.kind.removeprefix("ND_")
        self._unread = node
        if steps > MOST_STEPS:
            return None
        if kind.startswith(("image_", "tiledimage_")):
            found = self.uses.texture(self.textures, materialx_picture(node, self.notes), role)
            default = node.value("default", 0.0)
            plain = default if isinstance(default, tuple) else (float(default),) * 3
            return found or (plain if node.has("default") else None)
        if kind.startswith(PASSED):
            inner = node.input("in" if not kind.startswith("constant_") else "value")
        elif kind.startswith("multiply_"):
            return self._product(node, role, steps)
        else:
            return None
        read: Read | None = inner if isinstance(inner, tuple) else None
        if isinstance(inner, float):
            read = (inner,) * 3
        elif isinstance(inner, Node):
            read = self._materialx(inner, role, steps + 1)
        if read is not None and kind.startswith(SPLIT):
            return _channel(node, read)
        if kind.startswith("normalmap") and isinstance(read, dict) and (scale := node.number("scale", 1.0)) != 1:
            return {**read, "scale": scale}
        return read

    def _product(self, node: Node, role: Role, steps: int) -> dict[str, Any] | tuple[float, ...] | None:
        """An image times a constant."""
        sides = [node.input(name, 1.0) for name in ("in1", "in2")]
        nodes = [side for side in sides if isinstance(side, Node)]
        if len(nodes) != 1:
            return None
        found = self._materialx(nodes[0], role, steps + 1)
        value = next(side for side in sides if not isinstance(side, Node))
        factors = value[:3] if isinstance(value, tuple) else (value,) * 3
        if found is None or min(factors) < 0:
            return None
        if not isinstance(found, dict):
            return tuple(a * b for a, b in zip(found[:3], factors, strict=False))
        factor = factors[0] if len(set(factors)) == 1 else list(factors)
        return {**found, "factor": factor} if "factor" not in found else None

    def _read(self, node: Node, role: Role, default: tuple[float, ...]) -> dict[str, Any] | tuple[float, ...]:
        """A reference to the texture that a node is, or its fallback, or `default`."""
        if node.kind == "UsdUVTexture":
            found = self.uses.texture(self.textures, picture(node, self.notes), role)
            fallback = node.numbers("fallback", (0.0, 0.0, 0.0, 1.0))
            return found or (fallback if node.has("fallback") else default)
        if node.kind.startswith("UsdPrimvarReader_float"):
            varname = str(node.value("varname", ""))
            if varname == "displayColor" and role == "color":
                self.uses.is_colored = True
                return (1.0, 1.0, 1.0)
            self.notes.add(node.pointer, f"values of the primvar {varname[:40]!r} are not supported in a material")
            fallback = node.value("fallback", default)
            return fallback if isinstance(fallback, tuple) else default
        if node.kind.startswith("ND_"):
            self._unread = node
            read = self._materialx(node, role, 0)
            if read is not None:
                return _picked(read, 0) if role == "scalar" else read
            node = self._unread
        self.uses.unread += 1
        what = node.kind[:60] or "a node without a kind"
        self.notes.add(node.pointer, f"{what} is not supported in a material; the parameter has its default")
        return default


def _channel(node: Node, read: Read) -> Read | None:
    """The channel of what a node splits, or all of it in its own order; None for any other order."""
    if node.kind.removeprefix("ND_").startswith("extract"):
        names = "rgba"[int(node.number("index", 0)) % 4]
    elif node.kind.removeprefix("ND_").startswith("separate"):
        names = node.output.removeprefix("out")
    else:
        names = str(node.value("channels", ""))
    letters = "".join(CHANNELS.get(name, "?") for name in names)
    if letters in ("rg", "rgb", "rgba"):
        return read
    if len(set(letters)) != 1 or letters[0] == "?":
        return None
    at = "rgba".index(letters[0])
    if not isinstance(read, dict):
        return (read[at],) * 3 if at < len(read) else None
    return {**_picked(read, at), "channel": letters[0]}


def _picked(read: Read, at: int) -> Any:
    """What is read with the factor of this channel alone."""
    if not isinstance(read, dict) or not isinstance(read.get("factor"), list):
        return read
    return {**read, "factor": read["factor"][at] if at < 3 else 1.0}
