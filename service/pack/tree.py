"""Which kinds of shape go through a tree, and the order in which it wants them."""

from __future__ import annotations

import numpy as np

from gpu import SceneTooLarge
from gpu.layout import ShapeKind
from service.pack.records import Bounds
from service.problems import FieldError, InvalidDocument
from service.scene.numbers import Vec3

# A kind with more shapes than this goes through the tree; the loop over fewer costs less than the walk.
LINEAR = {
    ShapeKind.SPHERE: 8,
    ShapeKind.QUAD: 24,
    ShapeKind.BOX: 8,
    ShapeKind.ELLIPSOID: 6,
    ShapeKind.TRIANGLE: 12,
}


def triangle_bounds(triangles: np.ndarray) -> Bounds:
    a, b, c = triangles["v0"], triangles["v1"], triangles["v2"]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


# Of a kind in the tree at most so many stand in the loop, too: the largest, whose boxes most rays would meet.
LARGE = {
    ShapeKind.SPHERE: 4,
    ShapeKind.QUAD: 12,
    ShapeKind.BOX: 4,
    ShapeKind.ELLIPSOID: 3,
    ShapeKind.TRIANGLE: 6,
}
LARGE_SHARE = 1 / 32  # of the area of the box around everything, at least
LARGE_RATIO = 16.0  # times the median of its kind, at least: a ball of few triangles is none the better for it


def stand_out(bounds: dict[ShapeKind, Bounds]) -> dict[ShapeKind, np.ndarray]:
    """Of each kind in the tree the indices of those few that stand in the loop instead, the largest first."""
    area = {kind: _areas(*box) for kind, box in bounds.items()}
    ranked = {kind: np.argsort(-a, kind="stable")[: LARGE[kind]] for kind, a in area.items()}
    ranked = {kind: r[area[kind][r] > LARGE_RATIO * float(np.median(area[kind]))] for kind, r in ranked.items()}
    out = dict.fromkeys(bounds, 0)
    # What stands out no longer counts for the box around the others: a room on a globe has walls.
    while True:
        rest = [np.delete(np.stack(box), ranked[kind][: out[kind]], axis=1) for kind, box in bounds.items()]
        low = np.min([low.min(axis=0) for low, _ in rest], axis=0)
        high = np.max([high.max(axis=0) for _, high in rest], axis=0)
        least = LARGE_SHARE * float(_areas(low, high))
        found = {kind: int((area[kind][places] > least).sum()) for kind, places in ranked.items()}
        if found == out:
            return {kind: ranked[kind][:count] for kind, count in out.items()}
        out = {kind: max(count, out[kind]) for kind, count in found.items()}


def _areas(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Half the surface area of each box."""
    x, y, z = np.moveaxis(np.subtract(high, low, dtype=np.float64), -1, 0)
    return np.asarray(x * y + y * z + z * x)


def plant(
    bounds: dict[ShapeKind, Bounds], large: dict[ShapeKind, np.ndarray]
) -> tuple[np.ndarray, int, dict[ShapeKind, np.ndarray], Vec3, Vec3]:
    """(nodes, nodes of one octant, each kind's order: the `large` ones, then the leaves'; grid origin and scale).

    Raises InvalidDocument.
    """
    from gpu import bvh  # loads numba: only a scene that needs a tree waits for it

    small = {kind: np.setdiff1d(np.arange(len(low)), large[kind]) for kind, (low, _) in bounds.items()}
    counts = [len(places) for places in small.values()]
    kinds = np.repeat(np.array(list(bounds), np.uint8), counts)
    low = np.concatenate([bounds[k][0][places] for k, places in small.items()]).astype(np.float32)
    high = np.concatenate([bounds[k][1][places] for k, places in small.items()]).astype(np.float32)
    try:
        tree = bvh.build(low, high, kinds, firsts={int(k): len(places) for k, places in large.items() if len(places)})
    except SceneTooLarge as error:
        raise InvalidDocument([FieldError("/shapes", str(error))]) from None
    nodes, count = bvh.thread(tree)
    starts = np.cumsum([0, *counts])
    leaf_kinds = kinds[tree.order]
    order = {
        kind: np.concatenate([large[kind], places[(tree.order[leaf_kinds == kind] - start).astype(np.int64)]])
        for (kind, places), start in zip(small.items(), starts, strict=False)
    }
    return nodes, count, order, tree.origin, tree.scale
