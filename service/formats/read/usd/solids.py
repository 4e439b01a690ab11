"""Spheres, boxes, cylinders, cones, capsules and planes. Cones and capsules become triangles; the others are shapes
of the document."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from service.formats.types import Doubles, Indices

AROUND, ALONG = 96, 48  # segments about the axis of a round body, and from pole to pole
ROUGHLY = 16  # the same where the triangles stand for a body only to see it whole and to meter light
AXES = {"X": (1, 2, 0), "Y": (2, 0, 1), "Z": (0, 1, 2)}  # which axes the local x, y and z become
TAPERED = (UsdGeom.Cylinder_1, UsdGeom.Capsule_1)  # with a radius at each end
KINDS = (UsdGeom.Sphere, UsdGeom.Cube, UsdGeom.Cylinder, UsdGeom.Cone, UsdGeom.Capsule, UsdGeom.Plane, *TAPERED)


@dataclass(frozen=True)
class Solid:
    """`shape` where the document has such a body; its triangles (outward counter-clockwise) are then a rough copy."""

    shape: dict[str, Any] | None
    vertices: Doubles
    faces: Indices
    normals: Doubles | None = None


def is_solid(prim: Usd.Prim) -> bool:
    return any(prim.IsA(kind) for kind in KINDS)


def solid(prim: Usd.Prim, time: Usd.TimeCode) -> Solid | None:
    """The body of a prim; None where it has no extent."""

    def size(name: str, default: float) -> float:
        value = prim.GetAttribute(name).Get(time)
        return float(default if value is None else value)

    radius, height = size("radius", 1.0), size("height", 2.0)
    if prim.IsA(UsdGeom.Cube):
        half = size("size", 2.0) / 2
        box = {"type": "box", "min": [-half] * 3, "max": [half] * 3}
        return Solid(box, *_box(half)) if _is_positive(half) else None
    if prim.IsA(UsdGeom.Plane):
        sides = size("width", 2.0), size("length", 2.0)
        return _plane(*sides, str(prim.GetAttribute("axis").Get(time) or "Z")) if _is_positive(*sides) else None
    bottom = top = radius
    if any(prim.IsA(kind) for kind in TAPERED):
        bottom, top = size("radiusBottom", 0.5), size("radiusTop", 0.5)
        radius, height = max(bottom, top) if min(bottom, top) >= 0 else 0.0, size("height", 1.0)
    if not _is_positive(radius) or (not prim.IsA(UsdGeom.Sphere) and not _is_positive(height)):
        return None
    if prim.IsA(UsdGeom.Sphere):
        profile = _arc(radius, math.pi, 0.0, ROUGHLY // 2)
        ball = {"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": radius}
        return Solid(ball, *_turned(profile, "Z", ROUGHLY)[:2])
    half = height / 2
    along = str(prim.GetAttribute("axis").Get(time) or "Z")
    lean = bottom - top
    if prim.IsA(UsdGeom.Cylinder) or prim.IsA(UsdGeom.Cylinder_1):
        side = height / math.hypot(lean, height), lean / math.hypot(lean, height)
        profile = [
            ((0, -half), (0, -1)), ((bottom, -half), (0, -1)), ((bottom, -half), side), ((top, half), side),
            ((top, half), (0, 1)), ((0, half), (0, 1)),
        ]  # fmt: skip
        if lean:
            return Solid(None, *_turned(profile, along, AROUND))
        up = [float(name == along) for name in AXES] if along in AXES else [0.0, 0.0, 1.0]
        base, axis = ([way * x for x in up] for way in (-half, height))
        pipe = {"type": "cylinder", "base": base, "axis": axis, "radius": radius}
        return Solid(pipe, *_turned(profile, along, ROUGHLY)[:2])
    if prim.IsA(UsdGeom.Cone):
        slope = height / math.hypot(radius, height), radius / math.hypot(radius, height)
        profile = [((0, -half), (0, -1)), ((radius, -half), (0, -1)), ((radius, -half), slope), ((0, half), slope)]
    else:
        # The side touches both balls; where one is within the other there is none.
        meet = math.acos(min(max(lean / height, -1.0), 1.0))
        low, high = _arc(bottom, math.pi, meet, ALONG // 4), _arc(top, meet, 0.0, ALONG // 4)
        profile = [((r, z - half), n) for (r, z), n in low] + [((r, z + half), n) for (r, z), n in high]
    return Solid(None, *_turned(profile, along, AROUND))


Profile = list[tuple[tuple[float, float], tuple[float, float]]]  # (radius, z) and the normal there


def _arc(radius: float, start: float, end: float, steps: int) -> Profile:
    """Part of a half circle; the angle is from +z."""
    angles = [start + (end - start) * k / steps for k in range(steps + 1)]
    return [((radius * math.sin(a), radius * math.cos(a)), (math.sin(a), math.cos(a))) for a in angles]


def _turned(profile: Profile, axis: str, around: int) -> tuple[Doubles, Indices, Doubles]:
    """A profile from the bottom to the top, turned about z, with its z along `axis`."""
    places, directions = (np.array(rows, np.float64) for rows in zip(*profile, strict=True))
    turn = np.arange(around + 1) * (2 * math.pi / around)
    c, s = np.cos(turn), np.sin(turn)

    def swept(rows: Doubles) -> Doubles:
        radius, z = rows[:, 0, None], np.repeat(rows[:, 1, None], len(turn), axis=1)
        return np.stack([radius * c, radius * s, z], axis=-1).reshape(-1, 3)

    ring, width = np.arange(len(profile) - 1), around + 1
    a = (ring[:, None] * width + np.arange(around)).reshape(-1)
    quads = np.stack([a, a + 1, a + width + 1, a, a + width + 1, a + width], axis=1).reshape(-1, 3)
    vertices, normals = swept(places), swept(directions)
    corners = vertices[quads]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    quads = quads[area > 1e-12 * float(np.abs(vertices).max()) ** 2]  # at the poles and where the profile stays
    back = np.argsort(AXES.get(axis, AXES["Z"]))
    return vertices[:, back], quads.astype(np.int32), normals[:, back]


def _box(half: float) -> tuple[Doubles, Indices]:
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))], np.int32)


def _plane(width: float, length: float, axis: str) -> Solid:
    """Width lies along x (z where the axis is X), length along y (z where the axis is Y)."""
    along = {"X": ((0, 0, width), (0, length, 0)), "Y": ((width, 0, 0), (0, 0, length))}
    u, v = (np.array(side, np.float64) for side in along.get(axis, ((width, 0, 0), (0, length, 0))))
    if axis in ("X", "Y"):
        u, v = v, u  # so that the normal is along the axis
    shape = {"type": "quad", "origin": (-(u + v) / 2).tolist(), "u": u.tolist(), "v": v.tolist()}
    vertices = np.array([-(u + v) / 2, (u - v) / 2, (u + v) / 2, (v - u) / 2])
    return Solid(shape, vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def _is_positive(*sizes: float) -> bool:
    return all(0 < size <= 1e9 for size in sizes)
