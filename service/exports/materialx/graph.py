"""The nodes of one material's textures, and values as the inputs of nodes."""

from __future__ import annotations

import re
from collections.abc import Container
from dataclasses import dataclass, field
from html import escape
from typing import Any

from service.document import Scene
from service.document.texture import (
    CheckerTexture,
    ColorTexture,
    ImageTexture,
    NormalTexture,
    ScalarTexture,
    is_projected,
)
from service.exports.losses import Losses
from service.exports.writing import Files
from service.formats.formats import sniff
from service.problems import AssetError, FieldError, InvalidDocument, escaped

WRAPS = {"repeat": "periodic", "clamp": "clamp", "mirror": "mirror"}
SPACES = {"srgb": "srgb_texture", "linear": "lin_rec709"}
WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Value:
    """A value of an input: numbers, or the name of a node in the material's graph."""

    type: str
    numbers: tuple[float, ...] = ()
    node: str = ""

    @property
    def is_textured(self) -> bool:
        return bool(self.node)


def number(value: float) -> Value:
    return Value("float", (value,))


def switch(value: bool) -> Value:
    return Value("boolean", (value,))


def color(values: tuple[float, ...]) -> Value:
    return Value("color3", values)


@dataclass
class Images:
    """The images of an export, by the path that the file calls them; one for all materials."""

    scene: Scene
    files: Files
    beside: dict[str, bytes] = field(default_factory=dict)
    _paths: dict[str, str] = field(default_factory=dict)  # by asset

    def path(self, name: str, texture: ImageTexture) -> str:
        """Raises InvalidDocument."""
        if texture.asset not in self._paths:
            try:
                data = self.files.read(texture.asset)
            except AssetError as error:
                raise InvalidDocument([FieldError(f"/textures/{escaped(name)}/asset", error.detail)]) from None
            ending = {"jpeg": "jpg"}.get(sniff(data) or "", sniff(data) or "png")
            taken = {path.rpartition("/")[2].rpartition(".")[0] for path in self.beside}
            self._paths[texture.asset] = path = f"textures/{valid(name, taken)}.{ending}"
            self.beside[path] = data
        return self._paths[texture.asset]

    def is_8bit(self, texture: ImageTexture) -> bool:
        return bool(self.files.image(texture.asset, texture.layer or "").is_8bit)


def valid(name: str, taken: Container[str]) -> str:
    """The nearest name that the format allows, and that is not taken."""
    base = re.sub(r"[^A-Za-z0-9_]", "_", name)[:80] or "material"
    base = f"_{base}" if base[0].isdigit() else base
    found, k = base, 2
    while found in taken:
        found, k = f"{base}_{k}", k + 1
    return found


@dataclass
class Graph:
    """The graph of one material; `pointer` leads to that. What has no node is added to `losses`."""

    images: Images
    pointer: str
    losses: Losses
    nodes: list[str] = field(default_factory=list)
    _outputs: dict[str, str] = field(default_factory=dict)  # types by the names of nodes
    _known: dict[Any, str] = field(default_factory=dict)

    def tell(self, parameter: str, detail: str) -> None:
        self.losses.add(f"{self.pointer}/{parameter}", detail)

    def number(self, value: Any, parameter: str) -> Value:
        """A number, or the node that reads one channel of a texture."""
        if not isinstance(value, ScalarTexture):
            return number(float(value))
        node = self._channel(value, parameter, value.channel)
        if node is None:
            return number(value.factor)
        return self._times(node, "float", (value.factor,))

    def color(self, value: Any, parameter: str) -> Value:
        """A colour, or the node that reads a texture."""
        if not isinstance(value, ColorTexture):
            return color(tuple(value))
        if value.channel is not None:
            grey = self._channel(value, parameter, value.channel)
            if grey is None:
                return color(value.factor)
            node = self._node("convert", "color3", input_to("in", "float", grey))
        else:
            found = self._image(value, parameter, "color3")
            if found is None:
                return color(value.factor)
            node = found
        return self._times(node, "color3", value.factor)

    def normal(self, value: NormalTexture | None, parameter: str) -> Value | None:
        node = self._image(value, parameter, "vector3") if value is not None else None
        if value is None or node is None:
            return None
        scale = input_of("scale", number(value.scale)) if value.scale != 1 else ""
        return Value("vector3", node=self._node("normalmap", "vector3", input_to("in", "vector3", node), scale))

    def tangent(self, degrees: float) -> Value:
        """The surface's own, turned counter-clockwise; rotate3d turns the other way."""
        tangent, about = self._node("tangent", "vector3"), self._node("normal", "vector3")
        inputs = [input_to("in", "vector3", tangent), input_to("axis", "vector3", about)]
        return Value("vector3", node=self._node("rotate3d", "vector3", *inputs, input_of("amount", number(-degrees))))

    def converted(self, value: Value, type: str) -> Value:
        """A number as a colour of three equal ones."""
        if not value.is_textured:
            return Value(type, value.numbers * 3)
        return Value(type, node=self._node("convert", type, input_to("in", value.type, value.node)))

    def text(self, name: str) -> str:
        """The graph as an element; "" where nothing is textured."""
        if not self.nodes:
            return ""
        outputs = [
            f'    <output name="out_{node}" type="{type}" nodename="{node}" />'
            for node, type in self._outputs.items()
        ]
        return "\n".join([f'  <nodegraph name="{name}">', *self.nodes, *outputs, "  </nodegraph>"])

    def input(self, name: str, value: Value, graph: str) -> str:
        """An input of the surface shader."""
        if not value.is_textured:
            return f"    {input_of(name, value)}"
        self._outputs[value.node] = value.type
        return f'    <input name="{name}" type="{value.type}" nodegraph="{graph}" output="out_{value.node}" />'

    def _channel(self, value: ScalarTexture | ColorTexture, parameter: str, channel: str) -> str | None:
        texture = self.images.scene.textures[value.texture]
        if isinstance(texture, ImageTexture) and self._space(value, texture) == "linear" and channel == "r":
            return self._image(value, parameter, "float")
        # Alpha is linear in any image; red, green and blue of a colour are decoded.
        type = "color4" if channel == "a" else "color3" if self._is_encoded(value) else "vector3"
        node = self._image(value, parameter, type)
        if node is None:
            return None
        index = f'<input name="index" type="integer" value="{"rgba".index(channel)}" />'
        return self._node("extract", "float", input_to("in", type, node), index)

    def _is_encoded(self, value: ScalarTexture | ColorTexture) -> bool:
        texture = self.images.scene.textures[value.texture]
        return isinstance(texture, CheckerTexture) or (
            isinstance(texture, ImageTexture) and self._space(value, texture) == "srgb"
        )

    def _space(self, value: Any, texture: ImageTexture) -> str:
        if texture.color_space is not None:
            return texture.color_space
        return "srgb" if isinstance(value, ColorTexture) and self.images.is_8bit(texture) else "linear"

    def _image(self, value: Any, parameter: str, type: str) -> str | None:
        """The node that reads a texture; None, with a loss, where there is none."""
        texture = self.images.scene.textures[value.texture]
        if isinstance(texture, CheckerTexture) and type in ("color3", "float"):
            if is_projected(texture):
                self.tell(parameter, f"a checker by {texture.mapping} is written by texture coordinates")
            return self._checker(texture)
        if not isinstance(texture, ImageTexture):
            self.tell(parameter, "textures of this kind are not written as MaterialX; the factor alone is")
            return None
        if texture.uv:
            self.tell(parameter, "a second set of coordinates is read by few programs")
        space = self._space(value, texture)
        colorspace = f' colorspace="{SPACES[space]}"' if type.startswith("color") else ""
        path = escape(self.images.path(value.texture, texture))
        if texture.mapping == "box":
            return self._projected(texture, parameter, type, f'type="filename" value="{path}"{colorspace}')
        if texture.mapping == "sphere":
            self.tell(parameter, "an image by sphere is written by texture coordinates")
        inputs = [f'<input name="file" type="filename" value="{path}"{colorspace} />', *_layer(texture, "layer")]
        inputs.append(self._placed(texture))
        for axis, wrap in zip("uv", texture.wraps, strict=True):
            if texture.wraps != ("repeat", "repeat"):
                inputs.append(f'<input name="{axis}addressmode" type="string" value="{WRAPS[wrap]}" />')
        return self._node("image", type, *inputs)

    def _projected(self, texture: ImageTexture, parameter: str, type: str, file: str) -> str:
        """The node that shows an image along the axes of the shape's own space."""
        self.tell(parameter, "MaterialX shows an image by box mirrored on three of its six sides")
        if texture.scale[0] != texture.scale[1] or texture.rotation or texture.offset != (0, 0):
            self.tell(parameter, "an image by box keeps its scale along u alone, without rotation and offset")
        if texture.wraps != ("repeat", "repeat"):
            self.tell(parameter, "an image by box repeats in MaterialX")
        inputs = [f'<input name="file{axis}" {file} />' for axis in "xyz"]
        inputs += [found for axis in "xyz" for found in _layer(texture, f"layer{axis}")]
        if texture.scale[0] != 1:
            position = self._node("position", "vector3", '<input name="space" type="string" value="object" />')
            by = input_of("in2", number(texture.scale[0]))
            place = self._node("multiply", "vector3", input_to("in1", "vector3", position), by)
            inputs.append(input_to("position", "vector3", place))
        up = '<input name="upaxis" type="integer" value="1" />'
        return self._node("triplanarprojection", type, *inputs, up, input_of("blend", number(0.0)))

    def _checker(self, texture: CheckerTexture) -> str:
        tiling = input_of("uvtiling", Value("vector2", texture.scale))
        return self._node(
            "checkerboard",
            "color3",
            input_of("color1", color(texture.a)),
            input_of("color2", color(texture.b)),
            tiling,
        )

    def _placed(self, texture: ImageTexture) -> str:
        """An input for coordinates; "" where they are the mesh's. place2d divides, and turns the other way."""
        index = f'<input name="index" type="integer" value="{texture.uv}" />' if texture.uv else ""
        is_plain = texture.scale == (1, 1) and texture.rotation == 0 and texture.offset == (0, 0)
        if is_plain and not index:
            return ""
        coordinates = self._node("texcoord", "vector2", index)
        if is_plain:
            return input_to("texcoord", "vector2", coordinates)
        u, v = (1 / each if each else 1e6 for each in texture.scale)
        inputs = [
            input_to("texcoord", "vector2", coordinates),
            input_of("scale", Value("vector2", (u, v))),
            input_of("rotate", number(-texture.rotation)),
            input_of("offset", Value("vector2", (-texture.offset[0], -texture.offset[1]))),
        ]
        return input_to("texcoord", "vector2", self._node("place2d", "vector2", *inputs))

    def _times(self, node: str, type: str, factor: tuple[float, ...]) -> Value:
        if all(each == 1 for each in factor):
            return Value(type, node=node)
        by = input_of("in2", Value(type, factor))
        return Value(type, node=self._node("multiply", type, input_to("in1", type, node), by))

    def _node(self, category: str, type: str, *inputs: str) -> str:
        """The name of a node; one that is there already serves again."""
        key = category, type, inputs
        if key not in self._known:
            self._known[key] = name = f"{category}_{len(self._known) + 1}"
            lines = [f"      {each}" for each in inputs if each]
            body = [f'    <{category} name="{name}" type="{type}">', *lines, f"    </{category}>"]
            self.nodes.append("\n".join(body))
        return self._known[key]


def input_of(name: str, value: Value) -> str:
    text = ", ".join(str(each).lower() if value.type == "boolean" else f"{each:.9g}" for each in value.numbers)
    return f'<input name="{name}" type="{value.type}" value="{text}" />'


def input_to(name: str, type: str, node: str) -> str:
    return f'<input name="{name}" type="{type}" nodename="{node}" />'


def _layer(texture: ImageTexture, name: str) -> list[str]:
    """The input that names the layer of an EXR; none for the one that is shown without a name."""
    return [] if texture.layer is None else [f'<input name="{name}" type="string" value="{escape(texture.layer)}" />']
