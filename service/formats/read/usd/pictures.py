"""Nodes that read images: UsdUVTexture, and the images of MaterialX."""

from __future__ import annotations

import math
from typing import Any

from service.formats.read.scenes.warnings import Warnings
from service.formats.read.usd.networks import Node
from service.formats.read.usd.textures import Picture

# Images have no metadata of this kind, without which useMetadata is black.
WRAPS = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp", "black": "clamp", "useMetadata": "clamp"}
DARK = ("black", "useMetadata")
ADDRESSES = {"periodic": "repeat", "mirror": "mirror", "clamp": "clamp", "constant": "clamp"}
LINEAR = ("", "raw", "data", "lin_rec709", "lin_rec709_scene", "Raw", "none", "auto")

Placing = tuple[tuple[str, Any], ...]  # members of a texture of the document


def picture(node: Node, notes: Warnings) -> Picture:
    """The image of a UsdUVTexture."""
    wraps = [str(node.value(name, "useMetadata")) for name in ("wrapS", "wrapT")]
    wrap = [WRAPS.get(one, "repeat") for one in wraps]
    edges = tuple(
        (axis, node.at(name), f"{word} outside of an image is not supported; its edge goes on instead")
        for axis, (name, word) in enumerate(zip(("wrapS", "wrapT"), wraps, strict=True))
        if word in DARK
    )
    spaces = {"raw": "linear", "sRGB": "srgb"}
    space: Any = spaces.get(str(node.value("sourceColorSpace", "auto")), "auto")
    chart = "st"
    placing: Placing = ()
    at = node.input("st")
    steps = 0
    while isinstance(at, Node) and at.kind == "UsdTransform2d":
        if placing or steps:
            notes.add(at.pointer, "a second UsdTransform2d is not supported; it is ignored")
        else:
            placing = _placing(at)
        at, steps = at.input("in"), steps + 1
        if steps > 8:
            break
    if isinstance(at, Node) and at.kind.startswith("UsdPrimvarReader_float2"):
        chart = str(at.value("varname", "st")) or "st"
    elif isinstance(at, Node):
        notes.add(at.pointer, f"{at.kind[:60]} as texture coordinates is not supported; st is used instead")
    return Picture(
        str(node.value("file", "")), node.pointer, node.output, space, (wrap[0], wrap[1]),
        node.numbers("scale", (1.0,) * 4), node.numbers("bias", (0.0,) * 4), chart, placing, edges,
    )  # fmt: skip


def _placing(node: Node) -> Placing:
    """A UsdTransform2d: scale, then rotation, then translation, as the document's texture has them."""
    scale, offset = node.numbers("scale", (1.0, 1.0)), node.numbers("translation", (0.0, 0.0))
    rotation = node.number("rotation", 0.0)
    given: list[tuple[str, Any]] = []
    if scale != (1.0, 1.0):
        given.append(("scale", list(scale)))
    if rotation:
        given.append(("rotation", rotation))
    if offset != (0.0, 0.0):
        given.append(("offset", list(offset)))
    return tuple(given)


def materialx_picture(node: Node, notes: Warnings) -> Picture:
    """An image of MaterialX, whose values are linear unless its colour space says otherwise."""
    is_color = "_color" in node.kind  # numbers and vectors have no space
    named = node.space("file") if is_color else ""
    if named not in LINEAR and not named.startswith(("srgb", "g22_rec709")):
        notes.add(
            node.at("file"), f"the colour space {named[:40]!r} is not supported; linear Rec.709 is used instead"
        )
    space: Any = "srgb" if named.startswith(("srgb", "g22_rec709")) else "linear"
    modes = [str(node.value(f"{axis}addressmode", "periodic")) for axis in "uv"]
    lost = "a constant colour beyond the image is not supported; its edge goes on instead"
    edges = tuple((k, node.at(f"{'uv'[k]}addressmode"), lost) for k in (0, 1) if modes[k] == "constant")
    chart, placing = _coordinates(node.input("texcoord"), notes)
    if "tiledimage" in node.kind and (tiled := _tiling(node)):
        if placing:
            notes.add(node.pointer, "a tiled image under a second transform is not supported; the tiling is ignored")
        else:
            placing = tiled
    output = "a" if node.output == "outa" else "rgb"
    u, v = (ADDRESSES.get(mode, "repeat") for mode in modes)
    return Picture(
        str(node.value("file", "")), node.pointer, output, space, (u, v), chart=chart, placing=placing, edges=edges,
        layer=str(node.value("layer", "")),
    )  # fmt: skip


def _tiling(node: Node) -> Placing:
    """How a tiled image lies: so many times in a unit of the coordinates, or as large as it really is."""
    tiles, moved = node.numbers("uvtiling", (1.0, 1.0)), node.numbers("uvoffset", (0.0, 0.0))
    image, tile = (node.numbers(f"realworld{name}size", (1.0, 1.0)) for name in ("image", "tile"))
    size = [b / a if a else 1.0 for a, b in zip(image, tile, strict=True)]
    scale, offset = ([a * b for a, b in zip(each, size, strict=True)] for each in (tiles, moved))
    return () if scale == [1, 1] and offset == [0, 0] else _placed(scale, 0.0, [-each for each in offset])


def _coordinates(at: Any, notes: Warnings) -> tuple[str, Placing]:
    """The primvar with texture coordinates, and how they are transformed."""
    placing: Placing = ()
    if isinstance(at, Node) and at.kind.startswith("ND_place2d"):
        if at.number("operationorder", 0):
            notes.add(at.pointer, "another order of place2d than scale, rotation, offset is not supported")
        placing, at = _place2d(at), at.input("texcoord")
    for kind, name in (("ND_geompropvalue", "geomprop"), ("ND_UsdPrimvarReader_vector2", "varname")):
        if isinstance(at, Node) and at.kind.startswith(kind):
            return str(at.value(name, "st")) or "st", placing
    if isinstance(at, Node) and not at.kind.startswith("ND_texcoord"):
        notes.add(at.pointer, f"{at.kind[:60]} as texture coordinates is not supported; st is used instead")
    return "st", placing


def _place2d(node: Node) -> Placing:
    """R S (uv - pivot) - offset + pivot, where S divides by the scale and R turns clockwise."""
    pivot, offset = node.numbers("pivot", (0.0, 0.0)), node.numbers("offset", (0.0, 0.0))
    u, v = (1 / one if one else 1.0 for one in node.numbers("scale", (1.0, 1.0)))
    turn = -node.number("rotate", 0.0)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    x, y = u * pivot[0], v * pivot[1]
    moved = pivot[0] - (c * x - s * y) - offset[0], pivot[1] - (s * x + c * y) - offset[1]
    return _placed([u, v], turn, [round(each, 9) + 0.0 for each in moved])


def _placed(scale: list[float], rotation: float, offset: list[float]) -> Placing:
    """A placing as members of a texture of the document."""
    return (("scale", scale), *((("rotation", rotation),) if rotation else ()), ("offset", offset))
