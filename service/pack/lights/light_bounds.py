"""Bounds of lights: their places, the directions of their light and its power, from which their tree is made."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import numpy as np

from gpu.layout import ShapeKind
from service.pack.cache import PackCache, digest
from service.pack.lights.light_kinds import KINDS, LightBounds

MANY = 4
APART = 4.0  # least distance between fewer lights, in radii of the largest, for a tree
LASTING = 4096  # lights from which on their tree is cached, as building it takes some milliseconds

Grown = tuple[np.ndarray, np.ndarray, float, np.ndarray]  # the result of `gpu.accel.light_tree.build`


def bounds(lights: np.ndarray, shapes: Mapping[ShapeKind, np.ndarray], sides: np.ndarray) -> LightBounds:
    """The bounds of `layout.Light` records (n,) of bounded lights; `sides` (n,) of a flat one send light."""
    out = LightBounds(len(lights))
    for kind, row in KINDS.items():
        mine = np.flatnonzero(lights["kind"] == kind)
        if row.bound is not None and len(mine):
            row.bound(
                out, mine, lights[mine] if row.shape is None else shapes[row.shape][lights["index"][mine]], sides
            )
    return out


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
    shining = [
        shapes[row.shape][lights["index"][kinds == kind]] for kind, row in KINDS.items() if row.shape is not None
    ]
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
