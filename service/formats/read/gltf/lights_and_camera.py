"""The lights and the camera of a file."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.gltf.document import GltfDocument
from service.formats.read.gltf.json_view import JsonView, shown
from service.formats.read.gltf.nodes import Node
from service.formats.read.scenes.framing import FRAMED_VFOV, Bounds
from service.formats.read.scenes.warnings import Warnings

INSTEAD = "another camera of the file, or one that shows the whole scene, is used instead"


def lights(file: GltfDocument, nodes: list[Node], notes: Warnings) -> list[dict[str, Any]]:
    """The lights of KHR_lights_punctual: a candela counts as a watt per steradian, a lux as a watt per square
    metre."""
    found = []
    for node in nodes:
        try:
            used = node.place.extension("KHR_lights_punctual")
            light = None if used is None else _light(_listed(file, used), node, notes)
        except ParseError as error:
            notes.add(error.pointer, f"{error.detail}; the light is left out")
            continue
        if light is not None:
            found.append({"name": node.path, **light} if node.path else light)
    return found


def _listed(file: GltfDocument, used: JsonView) -> JsonView:
    extension = file.root.extension("KHR_lights_punctual")
    listed = extension.array("lights") if extension else []
    index = used.whole("light")
    if extension is None or index >= len(listed):
        raise used.error("light", f"refers to light {index} of {len(listed)}")
    return JsonView(listed[index], f"{extension.at('lights')}/{index}")


def _light(place: JsonView, node: Node, notes: Warnings) -> dict[str, Any]:
    kind = place.text("type")
    power = place.radiance("color", (1.0, 1.0, 1.0), place.number("intensity", 1, 0))
    position, direction = node.world[:3, 3].tolist(), _axis(node, 2, -1)
    if kind == "directional":
        return {"type": "directional", "direction": direction, "irradiance": power}
    if "range" in place:
        notes.add(place.at("range"), "a light's range is not used; its light falls off as 1/d^2 without end")
    if kind == "point":
        return {"type": "point", "position": position, "intensity": power}
    if kind != "spot":
        raise place.error("type", f"must be point, spot or directional, not {kind[:40]!r}")
    spot = place.object("spot") or JsonView({}, place.at("spot"))
    inner = spot.number("innerConeAngle", 0, 0, math.pi / 2)
    outer = spot.number("outerConeAngle", math.pi / 4, inner, math.pi / 2 + 1e-6)
    notes.add(spot.pointer, "the edge of the cone fades as a smoothstep of the cosine, not as its square")
    return {
        "type": "spot",
        "position": position,
        "direction": direction,
        "intensity": power,
        "inner_angle": math.degrees(inner),
        "outer_angle": min(math.degrees(outer), 90.0),
    }


def camera(
    file: GltfDocument, nodes: list[Node], bounds: Bounds, notes: Warnings
) -> tuple[dict[str, Any] | None, float | None]:
    """The scene's first camera, and the width of its picture over the height; None where there is none."""
    chosen: dict[str, Any] | None = None
    aspect: float | None = None
    for node in nodes:
        if "camera" not in node.place:
            continue
        if chosen is not None:
            notes.add(node.place.at("camera"), "this camera is not used; the scene's first camera is used instead")
            continue
        try:
            lens, aspect = _lens(file.follow(node.place, "camera", "cameras"))
            chosen = _placed(node, bounds) | lens
        except ParseError as error:
            notes.add(error.pointer, f"{error.detail}; {INSTEAD}")
    return chosen, aspect


def _lens(place: JsonView) -> tuple[dict[str, Any], float | None]:
    """What a camera's document says of its lens, and the width of its picture over the height."""
    kind = place.text("type")
    if kind == "perspective":
        lens = place.need("perspective")
        vfov = math.degrees(lens.number("yfov", math.radians(FRAMED_VFOV), 1e-6, math.pi - 1e-6))
        return {"vfov": vfov}, lens.number("aspectRatio", 1, 1e-6, 1e6) if "aspectRatio" in lens else None
    if kind == "orthographic":
        lens = place.need("orthographic")
        width, height = (lens.number(name, 1, 1e-9, 1e9) for name in ("xmag", "ymag"))
        # 1:1 stands for any
        return {"type": "orthographic", "height": 2 * height}, width / height if width != height else None
    raise place.error("type", f"must be perspective or orthographic, not {shown(kind)}")


def _placed(node: Node, bounds: Bounds) -> dict[str, Any]:
    position, forward = node.world[:3, 3], np.array(_axis(node, 2, -1))
    # At the distance of the model, so that turning about the target turns about the model.
    distance = float((sum(bounds) / 2 - position) @ forward)
    size = float(np.linalg.norm(bounds[1] - bounds[0]))
    target = position + forward * (distance if distance > 0.01 * size else max(size, 1.0))
    return {"position": position.tolist(), "target": target.tolist(), "up": _axis(node, 1, 1)}


def _axis(node: Node, axis: int, sign: int) -> list[float]:
    """A direction of the node in world space, of length one; the world's own axis where its scale is zero."""
    direction = sign * node.world[:3, axis]
    length = float(np.linalg.norm(direction))
    unit = direction / length if length > 0 else sign * np.eye(3)[axis]
    return [float(value) + 0.0 for value in unit]  # no -0
