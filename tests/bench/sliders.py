"""The sliders of a scene: the numbers and colours of its document, found in the schema as the editor finds them."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from service.document.schema import schema

Json = dict[str, Any]

REACH = 0.25  # metres that a place is moved along x, both ways
INSIDE = 0.01  # of a range whose end is no value


@dataclass(frozen=True)
class Slider:
    """One number of a document, a colour's brightness, or the first coordinate of a place."""

    path: tuple[str | int, ...]
    low: float
    high: float
    kind: str  # "number", "color" or "vector"

    @property
    def name(self) -> str:
        return "/".join(map(str, self.path))

    def patch(self, document: Json, share: float) -> Json:
        """The merge patch that brings it to this share of the way from its low end to the high one."""
        value: Any = self.low + share * (self.high - self.low)
        if self.kind == "color":
            value = [value, 0.8 * value, 0.6 * value]
        elif self.kind == "vector":
            value = [value, *_at(document, self.path)[1:]]
        return _patch(document, self.path, value)

    def restore(self, document: Json) -> Json:
        """The merge patch that brings back the document's own value, or leaves the member out where it has none."""
        return _patch(document, self.path, _at(document, self.path))


def sliders(document: Json) -> list[Slider]:
    """The sliders of the camera, the environment, each light and the first material of each kind. A kind is a model,
    and whether it shines: the sliders of others of the same kind do the same."""
    scene = schema()["scene"]
    found = list(_of(scene, scene["$defs"]["PerspectiveCamera"], document["camera"], ("camera",)))
    if "environment" in document:
        models = _models(scene, "Environment")
        found += _of(scene, models[document["environment"]["type"]], document["environment"], ("environment",))
    kinds = set()
    for name, material in document["materials"].items():
        kind = material["type"], "emission" in material
        if kind not in kinds:
            kinds.add(kind)
            model = _models(scene, "Material")[material["type"]]
            found += _of(scene, model, material, ("materials", name))
    for i, light in enumerate(document.get("lights", [])):
        for slider in _of(scene, _models(scene, "Light")[light["type"]], light, ("lights", i)):
            found.append(_within_its_cone(slider, light))
    return found


def _within_its_cone(slider: Slider, light: Json) -> Slider:
    """A beam's inner angle ends at its outer one."""
    if slider.path[-1] == "inner_angle":
        return replace(slider, high=light["outer_angle"])
    return replace(slider, low=light["inner_angle"]) if slider.path[-1] == "outer_angle" else slider


def _models(scene: Json, ending: str) -> dict[str, Json]:
    """The models of a kind by the value of their `type`."""
    named = [model for name, model in scene["$defs"].items() if name.endswith(ending)]
    return {m["properties"]["type"]["const"]: m for m in named if "const" in m["properties"].get("type", {})}


def _of(scene: Json, model: Json, values: Json, path: tuple[str | int, ...]) -> Iterator[Slider]:
    for name, node in model["properties"].items():
        if isinstance(values.get(name), dict) or "x-beside" in node:  # a texture, or no value by itself
            continue
        nodes = [node, *node.get("anyOf", [])]
        number = next((n for n in nodes if n.get("type") == "number"), None)
        if node.get("x-widget") == "color":
            yield Slider((*path, name), 0.0, float(node.get("x-soft-maximum", 1.0)), "color")
        elif number is not None:
            yield Slider((*path, name), *_range({**number, **node}), "number")
        elif node.get("x-widget") == "number" and isinstance(values.get(name), list):
            at = values[name][0]
            yield Slider((*path, name), at - REACH, at + REACH, "vector")


def _range(node: Json) -> tuple[float, float]:
    low, high = (
        float(next(node[key] for key in (f"x-soft-{end}", end, f"exclusive{end.capitalize()}") if key in node))
        for end in ("minimum", "maximum")
    )
    inside = INSIDE * (high - low)
    return low + inside * ("exclusiveMinimum" in node), high - inside * ("exclusiveMaximum" in node)


def _at(document: Any, path: tuple[str | int, ...]) -> Any:
    for step in path[:-1]:
        document = document[step]
    return document.get(path[-1])


def _patch(document: Json, path: tuple[str | int, ...], value: Any) -> Json:
    """The merge patch that sets a member; a list is replaced as a whole, as RFC 7396 has no other way."""
    places = [k for k, step in enumerate(path) if isinstance(step, int)]
    if places:
        inner = copy.deepcopy(_at(document, path[: places[0]]))
        member = inner[path[places[0]]]
        if value is None:
            member.pop(path[-1], None)
        else:
            member[path[-1]] = value
        path, value = path[: places[0]], inner
    for step in reversed(path):
        value = {step: value}
    out: Json = value
    return out
