"""Animations: their names and durations, and the pose of the nodes at one time [glTF 2.0, section 3.11, appendix C].

A pose is written into the nodes of the file's JSON, as if the file had been saved at that time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.gltf import accessors
from service.formats.read.gltf.document import Array, GltfDocument
from service.formats.read.gltf.json_view import JsonView, shown
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import Animation, Doubles

MOST = 1000  # animations that are listed, as an untrusted file may have any number
TYPES = {"translation": ("VEC3", 3), "rotation": ("VEC4", 4), "scale": ("VEC3", 3), "weights": ("SCALAR", 0)}
POINTER = "pointer"  # the path of KHR_animation_pointer's channels
SAME = 0.9995  # cosine of half an angle from which on slerp divides by almost 0; a chord is as good there


def listed(file: GltfDocument, notes: Warnings) -> list[Animation]:
    """The file's animations, each with a name of its own; one that cannot be read is left out, with a warning."""
    found: dict[str, Animation] = {}
    for place, name in _named(file):
        try:
            found[name] = Animation(name, _duration(file, place))
        except ParseError as error:
            notes.add(error.pointer or place.pointer, f"the animation is left out: it {error.detail}")
    return list(found.values())


def pose(file: GltfDocument, name: str, time: float, notes: Warnings) -> None:
    """Set the nodes that an animation moves as they are at `time` (s); before its start and after its end as there.

    Raises ParseError.
    """
    place = next((place for place, each in _named(file) if each == name), None)
    if place is None:
        raise ParseError(f"there is no animation {shown(name)}", "/animations")
    samplers = list(place.objects("samplers"))
    for channel in place.objects("channels"):
        target = channel.need("target")
        path = target.text("path")
        if path == POINTER:
            notes.add(target.at("path"), "KHR_animation_pointer is not supported; what it animates stays as it is")
            continue
        if path not in TYPES:
            raise target.error("path", f"must be one of {', '.join(TYPES)}, not {shown(path)}")
        if "node" not in target:
            continue  # an extension's own, says the specification
        node = file.follow(target, "node", "nodes")
        if "matrix" in node:
            raise node.error("matrix", f"must not be there, as {place.pointer} moves the node")
        number = channel.whole("sampler")
        if number >= len(samplers):
            raise channel.error("sampler", f"refers to sampler {number} of {len(samplers)}")
        node.value[path] = _sampled(file, samplers[number], path, _width(file, node, path), time)


def _named(file: GltfDocument) -> list[tuple[JsonView, str]]:
    found: dict[str, JsonView] = {}
    for k, place in enumerate(file.root.objects("animations")):
        if k == MOST:
            break
        found[unique(place.text("name") or f"Animation {k + 1}", found)] = place
    return [(place, name) for name, place in found.items()]


def _duration(file: GltfDocument, place: JsonView) -> float:
    """The time of the last key, s. It reads one key of each sampler, as this is asked of every file."""
    last = [accessors.read(file, sampler, "input", "SCALAR")[-1, 0] for sampler in place.objects("samplers")]
    if not last:
        raise place.error("samplers", "has no samplers")
    duration = float(max(last))
    if not 0 <= duration <= 1e9:  # false for NaN, too
        raise place.error("samplers", f"ends at {duration:g} s, not from 0 to 1e9")
    return duration


def _width(file: GltfDocument, node: JsonView, path: str) -> int:
    """How many numbers the nodes' property has."""
    if path != "weights":
        return TYPES[path][1]
    mesh = file.follow(node, "mesh", "meshes")
    first = next(mesh.objects("primitives"), None)
    count = len(first.array("targets")) if first is not None else 0
    if not count:
        raise mesh.error("primitives", "have no morph targets, whose weights an animation changes")
    return count


def _sampled(file: GltfDocument, sampler: JsonView, path: str, width: int, time: float) -> list[float]:
    keys = accessors.read(file, sampler, "input", "SCALAR")[:, 0].astype(np.float64)
    if not (np.isfinite(keys).all() and (np.diff(keys) > 0).all()):
        raise sampler.error("input", "must be finite times of which each is greater than the one before")
    how = sampler.text("interpolation", "LINEAR")
    if how not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise sampler.error("interpolation", f"must be LINEAR, STEP or CUBICSPLINE, not {shown(how)}")
    values = accessors.read(file, sampler, "output", TYPES[path][0])
    rows = 3 if how == "CUBICSPLINE" else 1  # a spline's key has the tangents before and after its value
    if values.size != len(keys) * rows * width:
        raise sampler.error("output", f"has {values.size} numbers for {len(keys)} keys of {rows * width}")
    curve = _Curve(keys, values.reshape(len(keys), rows, width), path == "rotation")
    found = curve.at(time, how)
    if not np.isfinite(found).all():
        raise sampler.error("output", f"is not finite at {time:g} s")
    return [float(value) for value in found]


@dataclass(frozen=True)
class _Curve:
    keys: Doubles  # (n,) s, rising
    values: Array  # (n, 1 or 3, width)
    turns: bool  # its values are quaternions

    def at(self, time: float, how: str) -> Any:
        last = len(self.keys) - 1
        before = int(np.clip(np.searchsorted(self.keys, time, side="right") - 1, 0, last))
        after = min(before + 1, last)
        span = self.keys[after] - self.keys[before]
        share = float(np.clip((time - self.keys[before]) / span, 0, 1)) if span > 0 else 0.0
        if how == "STEP" or share == 0:
            return self._value(before)
        if how == "CUBICSPLINE":
            return self._spline(before, after, share, float(span))
        start, end = self._value(before), self._value(after)
        return _slerp(start, end, share) if self.turns else (1 - share) * start + share * end

    def _value(self, key: int) -> Doubles:
        value = self.values[key, len(self.values[key]) // 2].astype(np.float64)
        return _unit(value) if self.turns else value

    def _spline(self, before: int, after: int, s: float, span: float) -> Doubles:
        """The Hermite spline of appendix C.4."""
        (_, start, leaving), (arriving, end, _) = self.values[[before, after]].astype(np.float64)
        value = (
            (2 * s**3 - 3 * s**2 + 1) * start
            + span * (s**3 - 2 * s**2 + s) * leaving
            + (-2 * s**3 + 3 * s**2) * end
            + span * (s**3 - s**2) * arriving
        )
        return _unit(value) if self.turns else value


def _slerp(start: Doubles, end: Doubles, share: float) -> Doubles:
    """The shorter way from one rotation to another, at constant speed [Shoemake 1985]."""
    cosine = float(start @ end)
    if cosine < 0:
        end, cosine = -end, -cosine
    if cosine > SAME:
        return _unit((1 - share) * start + share * end)
    angle = np.arccos(cosine)
    found: Doubles = (np.sin((1 - share) * angle) * start + np.sin(share * angle) * end) / np.sin(angle)
    return found


def _unit(quaternion: Doubles) -> Doubles:
    length = float(np.linalg.norm(quaternion))
    return quaternion / length if length > 0 else quaternion
