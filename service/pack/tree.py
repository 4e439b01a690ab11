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


def plant(bounds: dict[ShapeKind, Bounds]) -> tuple[np.ndarray, dict[ShapeKind, np.ndarray], Vec3, Vec3]:
    """(nodes, each kind's leaf order, grid origin, grid scale). Raises InvalidDocument."""
    from gpu import bvh  # loads numba: only a scene that needs a tree waits for it

    counts = [len(low) for low, _ in bounds.values()]
    kinds = np.repeat(np.array(list(bounds), np.uint8), counts)
    low = np.concatenate([b[0] for b in bounds.values()]).astype(np.float32)
    high = np.concatenate([b[1] for b in bounds.values()]).astype(np.float32)
    try:
        tree = bvh.build(low, high, kinds)
    except SceneTooLarge as error:
        raise InvalidDocument([FieldError("/shapes", str(error))]) from None
    nodes = bvh.thread(tree)
    starts = np.cumsum([0, *counts])
    leaf_kinds = kinds[tree.order]
    order = {
        kind: (tree.order[leaf_kinds == kind] - start).astype(np.int64)
        for kind, start in zip(bounds, starts, strict=False)
    }
    return nodes, order, tree.origin, tree.scale
