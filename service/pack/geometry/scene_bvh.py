"""The tree over a scene: the kinds of shapes in it, and their order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpu import SceneTooLarge
from gpu.layout import Node, ShapeKind
from service.document.numbers import Vec3
from service.pack.geometry.parallel import chunks, in_threads
from service.pack.geometry.records import Bounds
from service.pack.geometry.vertex_normals import corner_normals
from service.problems import FieldError, InvalidDocument

# A kind with more shapes than this goes through the tree; the loop over fewer costs less than the walk.
LINEAR = {
    ShapeKind.SPHERE: 8,
    ShapeKind.QUAD: 24,
    ShapeKind.BOX: 8,
    ShapeKind.ELLIPSOID: 6,
    ShapeKind.TRIANGLE: 12,
}

# The most shapes of a kind in the tree that stand in the loop instead: the largest, whose boxes most rays would hit.
LARGE = {
    ShapeKind.SPHERE: 4,
    ShapeKind.QUAD: 12,
    ShapeKind.BOX: 4,
    ShapeKind.ELLIPSOID: 3,
    ShapeKind.TRIANGLE: 6,
    ShapeKind.INSTANCE: 0,
}
LARGE_SHARE = 1 / 32  # least share of the area of the box around everything
LARGE_RATIO = 16.0  # least ratio to the median of its kind: a ball of few triangles would gain nothing


@dataclass(frozen=True)
class SceneBvh:
    """The threaded tree over a scene."""

    nodes: np.ndarray  # layout.Node
    count: int  # of one octant's order
    order: dict[ShapeKind, np.ndarray]  # of each kind: the shapes that stand in the loop, then those of the leaves
    origin: Vec3
    scale: Vec3

    @classmethod
    def empty(cls) -> SceneBvh:
        return cls(np.zeros(0, Node.dtype), 0, {}, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def stand_out(bounds: dict[ShapeKind, Bounds]) -> dict[ShapeKind, np.ndarray]:
    """For each kind in the tree the indices of the few shapes that stand in the loop instead, the largest first."""
    area = {kind: _areas(*box) for kind, box in bounds.items()}
    ranked = {kind: _largest(a, LARGE[kind]) for kind, a in area.items()}
    ranked = {kind: r[area[kind][r] > LARGE_RATIO * float(np.median(area[kind]))] for kind, r in ranked.items()}
    out = dict.fromkeys(bounds, 0)
    # A shape that stands out no longer counts for the box around the others: a room on a globe has walls.
    while any(map(len, ranked.values())):
        rest = [_without(box, ranked[kind][: out[kind]]) for kind, box in bounds.items()]
        low = np.min([low.min(axis=0) for low, _ in rest], axis=0)
        high = np.max([high.max(axis=0) for _, high in rest], axis=0)
        least = LARGE_SHARE * float(_areas(low[None], high[None])[0])
        found = {kind: int((area[kind][places] > least).sum()) for kind, places in ranked.items()}
        if found == out:
            break
        out = {kind: max(count, out[kind]) for kind, count in found.items()}
    return {kind: ranked[kind][:count] for kind, count in out.items()}


def _largest(values: np.ndarray, count: int) -> np.ndarray:
    """The indices of the `count` largest values, the largest first; equal ones in their order."""
    if not count:
        return np.zeros(0, np.intp)
    if len(values) > count:
        least = np.partition(values, len(values) - count)[len(values) - count]
        some = np.flatnonzero(values >= least)
    else:
        some = np.arange(len(values))
    return np.asarray(some[np.argsort(-values[some], kind="stable")[:count]])


def _without(box: Bounds, places: np.ndarray) -> Bounds:
    low, high = box
    return (np.delete(low, places, axis=0), np.delete(high, places, axis=0)) if len(places) else box


def _areas(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n,) half the surface area of each box."""
    areas = np.empty(len(low))

    def some(which: slice) -> None:
        x, y, z = np.subtract(high[which], low[which], dtype=np.float64).T
        areas[which] = x * y + y * z + z * x

    in_threads(some, chunks(len(low)))
    return areas


def build_scene_bvh(bounds: dict[ShapeKind, Bounds], large: dict[ShapeKind, np.ndarray]) -> SceneBvh:
    """The tree over shapes with these bounds, without the `large` ones. Instances stay in their order.

    Raises InvalidDocument.
    """
    from gpu.accel import bvh  # loads numba: only a scene that needs a tree waits for it

    small = {kind: np.delete(np.arange(len(low), dtype=np.uint32), large[kind]) for kind, (low, _) in bounds.items()}
    counts = [len(places) for places in small.values()]
    kinds = np.repeat(np.array(list(bounds), np.uint8), counts)
    rest = [_without(box, large[kind]) for kind, box in bounds.items()]
    low, high = (
        np.concatenate([box[k] for box in rest], dtype=np.float32) if len(rest) > 1 else rest[0][k].astype(np.float32)
        for k in range(2)
    )
    del rest
    starts = np.cumsum([0, *counts])
    firsts = {int(k): len(places) for k, places in large.items() if len(places)}
    staying = {int(k): int(at) for k, at in zip(small, starts, strict=False) if k == ShapeKind.INSTANCE}
    try:
        tree = bvh.build(low, high, kinds, firsts=firsts, staying=staying)
    except SceneTooLarge as error:
        raise InvalidDocument([FieldError("/shapes", str(error))]) from None
    nodes, count = bvh.thread(tree)
    order = dict[ShapeKind, np.ndarray]()
    for (kind, places), start in zip(small.items(), starts, strict=False):
        if kind == ShapeKind.INSTANCE:
            continue
        leaves = tree.order if len(small) == 1 else tree.order[kinds[tree.order] == kind] - np.uint32(start)
        order[kind] = np.concatenate([large[kind].astype(np.uint32), places[leaves]])
    return SceneBvh(nodes, count, order, tree.origin, tree.scale)


def warm_builder() -> None:
    """Load numba and the compiled code for trees and normals, or compile it: the first mesh waits half a second for
    it, or several."""
    corner_normals(np.zeros((3, 3)), np.zeros((1, 3), np.int32))
    low = np.arange(3.0 * (LINEAR[ShapeKind.TRIANGLE] + 1), dtype=np.float32).reshape(-1, 3)
    build_scene_bvh({ShapeKind.TRIANGLE: (low, low + 1)}, {ShapeKind.TRIANGLE: np.zeros(0, np.intp)})
