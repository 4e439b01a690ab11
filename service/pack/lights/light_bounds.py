"""Bounds of lights: their places, the directions of their light and its power, from which their tree is made."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import numpy as np

from gpu.layout import LightKind, ShapeKind
from service.pack.cache import PackCache, digest
from service.pack.lights.lights import SHINING

MANY = 4
APART = 4.0  # least distance between fewer lights, in radii of the largest, for a tree
LASTING = 4096  # lights from which on their tree is cached, as building it takes some milliseconds

Grown = tuple[np.ndarray, np.ndarray, float, np.ndarray]  # the result of `gpu.accel.light_tree.build`
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


def bounds(lights: np.ndarray, shapes: Mapping[ShapeKind, np.ndarray], sides: np.ndarray) -> LightBounds:
    """The bounds of `layout.Light` records (n,) of bounded lights; `sides` (n,) of a flat one send light."""
    out = LightBounds(len(lights))
    kinds = lights["kind"]

    def of(kind: LightKind, shape: ShapeKind | None = None) -> tuple[np.ndarray, np.ndarray]:
        mine = np.flatnonzero(kinds == kind)
        return mine, lights[mine] if shape is None else shapes[shape][lights["index"][mine]]

    mine, points = of(LightKind.POINT)
    out.set_box(mine, points["position"], points["position"], np.zeros(len(mine)))
    mine, spots = of(LightKind.SPOT)
    _spots(out, mine, spots)
    mine, balls = of(LightKind.SPHERE, ShapeKind.SPHERE)
    center, radius = balls["center"].astype(np.float64), balls["radius"].astype(np.float64)
    out.set_box(mine, center - radius[:, None], center + radius[:, None], radius)
    mine, solids = of(LightKind.ELLIPSOID, ShapeKind.ELLIPSOID)
    _ellipsoids(out, mine, solids)
    mine, pipes = of(LightKind.CYLINDER, ShapeKind.BOX)
    _cylinders(out, mine, pipes, sides)
    mine, quads = of(LightKind.QUAD, ShapeKind.QUAD)
    o, u, v = (quads[name].astype(np.float64) for name in ("origin", "u", "v"))
    _flats(out, mine, np.stack([o, o + u, o + u + v, o + v], axis=1), quads["normal"], sides)
    mine, triangles = of(LightKind.TRIANGLE, ShapeKind.TRIANGLE)
    corners = np.stack([triangles[name].astype(np.float64) for name in ("v0", "v1", "v2")], axis=1)
    _flats(out, mine, corners, np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), sides)
    return out


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


def _ellipsoids(out: LightBounds, mine: np.ndarray, solids: np.ndarray) -> None:
    axes = _half_axes(solids)
    half = np.linalg.norm(axes, axis=2)
    center = solids["center"].astype(np.float64)
    longest = np.linalg.svd(axes, compute_uv=False)[:, 0] if len(axes) else np.zeros(0)
    out.set_box(mine, center - half, center + half, longest)


def _cylinders(out: LightBounds, mine: np.ndarray, solids: np.ndarray, sides: np.ndarray) -> None:
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


def _spots(out: LightBounds, mine: np.ndarray, spots: np.ndarray) -> None:
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


def worth(b: LightBounds) -> bool:
    """True if a tree pays: a sample then costs 1.1 to 1.4 times as much. Two lamps some metres apart still have an
    error 1.4 to 2.9 times smaller after equal time; the two triangles of a rectangle gain nothing."""
    middles = 0.5 * (b.low + b.high)
    if not 2 <= len(middles) < MANY:
        return len(middles) >= MANY
    return bool(np.linalg.norm(np.ptp(middles, axis=0)) > APART * b.radius.max())


def grow_light_tree(
    lights: np.ndarray, power: np.ndarray, share: float, shapes: Mapping[ShapeKind, np.ndarray], sides: np.ndarray,
    reach: float, cache: PackCache | None,
) -> Grown | None:  # fmt: skip
    """The result of `light_tree.build` for `layout.Light` records (n,) with their `power` (n,), W of luminance; None
    where a tree would not pay.

    Only ratios of powers count, rounded to float32: a tree in the cache serves whenever all lights of a scene become
    as many times as bright.
    """
    power = (power / (power.max(initial=0.0) or 1.0)).astype(np.float32)

    def make(b: LightBounds) -> _LightTree:
        from gpu.accel.light_tree import build  # here, as it loads numba

        arrays = (b.low, b.high, b.radius, b.axis, b.normals, b.beyond)
        return _LightTree(share, *build(*arrays, power / b.solid_angle, share, reach))

    if cache is None or len(lights) < LASTING:
        b = bounds(lights, shapes, sides)
        return make(b).grown if worth(b) else None
    key = ("light tree", *_content(lights, shapes, sides), digest(power), reach)
    return cache.get(key, lambda: make(bounds(lights, shapes, sides))).with_share(share)


def warm_light_tree() -> None:
    """Load the compiled code of the builder of light trees, or compile it: the first scene with several lamps would
    wait 0.07 s or some seconds for it."""
    from gpu.accel.light_tree import build

    b = LightBounds(MANY)
    build(b.low, b.high, b.radius, b.axis, b.normals, b.beyond, np.ones(MANY, np.float32), 1.0, 1.0)


def _content(lights: np.ndarray, shapes: Mapping[ShapeKind, np.ndarray], sides: np.ndarray) -> list[Hashable]:
    """Keys that are equal where `bounds` are."""
    kinds = lights["kind"]
    places = [lights[name] for name in ("position", "direction", "spread")]
    shining = [shapes[shape][lights["index"][kinds == light]] for shape, light in SHINING.items()]
    # Materials and numbers of lights are in the records of shapes, too: they differ where other shapes shine.
    return [digest(array) for array in (kinds, sides, *places, *shining)]


class _LightTree:
    def __init__(
        self, share: float, words: np.ndarray, trails: np.ndarray, even: float, intensity: np.ndarray
    ) -> None:
        self.words, self.trails, self.even, self.intensity = words, trails, even, intensity
        self._share = share

    @property
    def grown(self) -> Grown:
        return self.words, self.trails, self.even, self.intensity

    def with_share(self, share: float) -> Grown:
        """The tree, whose lights have that share of all picks."""
        if share == self._share:
            return self.grown
        from gpu.accel.light_tree import with_share

        words, even = with_share(self.words, len(self.trails), share)
        return words, self.trails, even, self.intensity
