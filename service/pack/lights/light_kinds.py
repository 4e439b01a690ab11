"""A row for each kind of light: what a document's becomes, its area, and its bounds in the tree of lights."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpu.layout import LightKind, ShapeKind
from service.document.light import DirectionalLight, Light, PointLight, SpotLight

# The least share of a spot's cone that its fading rim takes, so that its inverse fits into float32 with some digits
# left.
LEAST_RIM = 1e-6
AROUND = 512  # places at which the outline of a cylinder is measured
# Radians: a disk narrower than this is a point, as float32 directions have no digits for a place on it.
LEAST_DISK = 1e-6

_FLAT = np.array([0.0, 0.0, 1.0])


class LightBounds:
    """Arrays over n lights, as `gpu.accel.light_tree.build` takes them."""

    def __init__(self, n: int) -> None:
        self.low, self.high = np.zeros((n, 3)), np.zeros((n, 3))
        self.radius = np.zeros(n)
        self.axis = np.tile(_FLAT, (n, 1))
        self.normals = np.full(n, -1.0)  # all directions
        self.beyond = np.zeros(n)
        self.solid_angle = np.full(n, 4 * np.pi)  # sr: power over intensity

    def set_box(self, mine: np.ndarray, low: np.ndarray, high: np.ndarray, radius: np.ndarray) -> None:
        self.low[mine], self.high[mine], self.radius[mine] = low, high, radius


# Fills in the bounds of the lights `mine`: from their records, a shape's own or `layout.Light`, and from the number
# of sides that send light, of all lights.
Bound = Callable[[LightBounds, np.ndarray, np.ndarray, np.ndarray], None]
# Fills in the record of a document's light, relative to an origin, in a scene of some radius. Returns the factor of
# its power, W, over its intensity.
Fill = Callable[[np.ndarray, Any, np.ndarray, float], float]


@dataclass(frozen=True)
class LightRow:
    bound: Bound | None = None  # None: it is at infinity
    shape: ShapeKind | None = None  # of a light that is a shape: the kind of its record
    area: Callable[[np.ndarray], np.ndarray] | None = None  # records of shapes -> m^2
    is_open: bool = False  # its inside, or back, sends light to other shapes


def _sphere_area(spheres: np.ndarray) -> np.ndarray:
    return np.asarray(4 * np.pi * spheres["radius"].astype(np.float64) ** 2)


def _triangle_area(triangles: np.ndarray) -> np.ndarray:
    v0 = triangles["v0"].astype(np.float64)
    return np.asarray(0.5 * np.linalg.norm(np.cross(triangles["v1"] - v0, triangles["v2"] - v0), axis=1))


def _ellipsoid_area(solids: np.ndarray) -> np.ndarray:
    """The area by Thomsen's formula (p = 1.6075), within 1.1 %, from the lengths of the half axes."""
    rows = np.stack([solids["row_x"], solids["row_y"], solids["row_z"]], axis=1).astype(np.float64)
    a, b, c = (1.0 / np.linalg.svd(rows, compute_uv=False)).T if len(rows) else np.zeros((3, 0))
    p = 1.6075
    return np.asarray(4 * np.pi * (((a * b) ** p + (a * c) ** p + (b * c) ** p) / 3) ** (1 / p))


def _cylinder_area(solids: np.ndarray) -> np.ndarray:
    """The area of the sides: the length of the ellipse whose half axes are those of the cross-section, each across
    the cylinder's axis and times its length. The mean over evenly spaced angles is exact but for long ellipses."""
    if not len(solids):
        return np.zeros(0)
    axes = np.linalg.inv(np.stack([solids["row_x"], solids["row_y"], solids["row_z"]], axis=1).astype(np.float64))
    across, along = np.cross(axes[:, :, 1], axes[:, :, 0]), np.cross(axes[:, :, 1], axes[:, :, 2])
    turn = np.arange(AROUND)[:, None, None] * (2 * np.pi / AROUND)
    return np.asarray(4 * np.pi * np.linalg.norm(np.cos(turn) * along - np.sin(turn) * across, axis=2).mean(axis=0))


def _bound_points(out: LightBounds, mine: np.ndarray, points: np.ndarray, sides: np.ndarray) -> None:
    out.set_box(mine, points["position"], points["position"], np.zeros(len(mine)))


def _bound_spheres(out: LightBounds, mine: np.ndarray, balls: np.ndarray, sides: np.ndarray) -> None:
    center, radius = balls["center"].astype(np.float64), balls["radius"].astype(np.float64)
    out.set_box(mine, center - radius[:, None], center + radius[:, None], radius)


def _bound_quads(out: LightBounds, mine: np.ndarray, quads: np.ndarray, sides: np.ndarray) -> None:
    o, u, v = (quads[name].astype(np.float64) for name in ("origin", "u", "v"))
    _flats(out, mine, np.stack([o, o + u, o + u + v, o + v], axis=1), quads["normal"], sides)


def _bound_triangles(out: LightBounds, mine: np.ndarray, triangles: np.ndarray, sides: np.ndarray) -> None:
    corners = np.stack([triangles[name].astype(np.float64) for name in ("v0", "v1", "v2")], axis=1)
    _flats(out, mine, corners, np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), sides)


def _flats(out: LightBounds, mine: np.ndarray, corners: np.ndarray, across: np.ndarray, sides: np.ndarray) -> None:
    """Fill in flat lights with the `corners` (n, k, 3); `across` (n, 3) points along the outward normals."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    away = np.linalg.norm(corners - 0.5 * (low + high)[:, None], axis=2).max(axis=1)
    out.set_box(mine, low, high, away)
    across = across.astype(np.float64)
    peak = np.abs(across).max(axis=1, keepdims=True)  # first, or squares of tiny areas would be denormal
    across = across / np.where(peak > 0, peak, 1.0)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    one = (sides[mine] == 1) & (length[:, 0] > 0)
    out.axis[mine[one]] = across[one] / length[one]
    out.normals[mine[one]] = 1.0
    out.solid_angle[mine] = np.pi * sides[mine]


def _bound_ellipsoids(out: LightBounds, mine: np.ndarray, solids: np.ndarray, sides: np.ndarray) -> None:
    axes = _half_axes(solids)
    half = np.linalg.norm(axes, axis=2)
    center = solids["center"].astype(np.float64)
    longest = np.linalg.svd(axes, compute_uv=False)[:, 0] if len(axes) else np.zeros(0)
    out.set_box(mine, center - half, center + half, longest)


def _bound_cylinders(out: LightBounds, mine: np.ndarray, solids: np.ndarray, sides: np.ndarray) -> None:
    axes = _half_axes(solids)
    half = np.abs(axes[:, :, 1]) + np.hypot(axes[:, :, 0], axes[:, :, 2])
    center = solids["center"].astype(np.float64)
    widest = np.linalg.svd(axes[:, :, ::2], compute_uv=False)[:, 0] if len(axes) else np.zeros(0)
    out.set_box(mine, center - half, center + half, np.linalg.norm(axes[:, :, 1], axis=1) + widest)
    # Of a side of length l and radius r: the power 2 pi r l pi L over the intensity across it, 2 r l L
    out.solid_angle[mine] = np.pi**2 * sides[mine]


def _half_axes(solids: np.ndarray) -> np.ndarray:
    """(n, 3, 3): the half axes of solids, as columns."""
    rows = np.stack([solids["row_x"], solids["row_y"], solids["row_z"]], axis=1).astype(np.float64)
    return np.linalg.inv(rows) if len(rows) else rows


def _bound_spots(out: LightBounds, mine: np.ndarray, spots: np.ndarray, sides: np.ndarray) -> None:
    """Fill in spots, whose angles their records have as in spot.glsl: 1 / (2 rim) is the square of the direction's
    length, outer / rim is `spread`."""
    out.set_box(mine, spots["position"], spots["position"], np.zeros(len(mine)))
    direction = spots["direction"].astype(np.float64)
    length2 = (direction**2).sum(axis=1)
    rim = 0.5 / length2
    outer = np.minimum(spots["spread"] * rim * (1 + 1e-6), 1.0)  # 1 - cos
    inner = np.maximum(outer - rim, 0.0)
    out.axis[mine] = direction / np.sqrt(length2)[:, None]
    out.normals[mine] = 1 - inner
    beyond = 2 * (np.arcsin(np.sqrt(outer / 2)) - np.arcsin(np.sqrt(inner / 2)))
    out.beyond[mine] = np.maximum(np.cos(beyond), 0.0)
    out.solid_angle[mine] = np.pi * (inner + outer)


def _point(record: np.ndarray, light: PointLight | SpotLight, origin: np.ndarray, radius: float = 0.0) -> float:
    record["kind"] = LightKind.POINT
    record["position"], record["intensity"] = np.subtract(light.position, origin), light.intensity
    return 4 * math.pi


def _spot(record: np.ndarray, light: SpotLight, origin: np.ndarray, radius: float) -> float:
    """Fill the record. Returns the solid angle (sr) that holds as much light as the cone with its rim, as smoothstep
    has a mean of a half."""
    inner, outer = (2 * math.sin(math.radians(a) / 2) ** 2 for a in (light.inner_angle, light.outer_angle))
    _point(record, light, origin)
    record["kind"] = LightKind.SPOT
    if outer == 0:
        return 0.0
    rim = max(outer - inner, LEAST_RIM * outer)
    record["direction"] = _unit(light.direction) / math.sqrt(2 * rim)
    record["spread"] = outer / rim
    return math.pi * (inner + outer)


def _sun(record: np.ndarray, light: DirectionalLight, origin: np.ndarray, radius: float) -> float:
    """Fill the record. Returns the area in m^2 (times sr where there is a disk) that gives the power when multiplied
    by the record's intensity."""
    half = math.radians(light.angular_diameter) / 2
    record["kind"], record["direction"] = LightKind.DIRECTIONAL, _unit(light.direction)
    facing = 1.0
    if half > LEAST_DISK:
        record["spread"] = 2 * math.sin(half / 2) ** 2
        facing = math.pi * math.sin(half) ** 2  # the integral of the cosine over the disk
    record["intensity"] = np.divide(light.irradiance, facing)
    return facing * math.pi * radius**2


def _unit(v: Sequence[float]) -> np.ndarray:
    return np.divide(v, math.hypot(*v))


# Shapes' lights are in this order among all of a scene's.
KINDS = {
    LightKind.POINT: LightRow(_bound_points),
    LightKind.SPOT: LightRow(_bound_spots),
    LightKind.DIRECTIONAL: LightRow(),
    LightKind.ENVIRONMENT: LightRow(),
    LightKind.SPHERE: LightRow(_bound_spheres, ShapeKind.SPHERE, _sphere_area),
    LightKind.QUAD: LightRow(_bound_quads, ShapeKind.QUAD, lambda quads: np.asarray(quads["area"]), is_open=True),
    LightKind.ELLIPSOID: LightRow(_bound_ellipsoids, ShapeKind.ELLIPSOID, _ellipsoid_area),
    LightKind.TRIANGLE: LightRow(_bound_triangles, ShapeKind.TRIANGLE, _triangle_area, is_open=True),
    # A box that shines was packed as quads, so that one among the lights is a cylinder's side.
    LightKind.CYLINDER: LightRow(_bound_cylinders, ShapeKind.BOX, _cylinder_area, is_open=True),
}
FILL: dict[type[Light], Fill] = {PointLight: _point, SpotLight: _spot, DirectionalLight: _sun}
