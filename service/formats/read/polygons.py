"""Polygons into triangles: fans where the polygon is convex, ears where it is not."""

from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.types import Doubles

Longs = npt.NDArray[np.int64]


def triangulate(points: npt.NDArray[np.floating], corners: npt.NDArray[np.signedinteger], counts: Longs) -> Longs:
    """Triangles in file order, (m, 3), as places in `corners`: whatever else a corner carries follows along.

    `corners` are the vertex indices of all faces, one face after the other; `counts` how many each has, at least 3.
    """
    if len(counts) and counts.min() == counts.max() == 3:
        return np.arange(len(corners)).reshape(-1, 3)
    starts = np.cumsum(counts) - counts
    first = np.cumsum(counts - 2) - (counts - 2)
    triangles = np.empty((int((counts - 2).sum()), 3), np.int64)
    for n in np.unique(counts):
        rows = np.flatnonzero(counts == n)
        place = starts[rows, None] + np.arange(n)
        local = _fans(points[corners[place]])
        triangles[first[rows, None] + np.arange(n - 2)] = np.take_along_axis(
            place, local.reshape(len(rows), -1), axis=1
        ).reshape(len(rows), n - 2, 3)
    return triangles


def _fans(polygons: npt.NDArray[Any]) -> Longs:
    """(r, n, 3) points -> (r, n - 2, 3) local corner indices."""
    r, n, _ = polygons.shape
    fan = np.stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    local = np.repeat(fan[None], r, axis=0)
    if n == 3:
        return local
    spokes = polygons[:, 1:] - polygons[:, :1]
    normals = np.cross(spokes[:, :-1], spokes[:, 1:])
    whole = normals.sum(axis=1)  # twice the area, along the polygon's own normal
    concave = np.flatnonzero((np.einsum("rkc,rc->rk", normals, whole) < 0).any(axis=1))
    if n == 4:
        local[concave] = np.array([[1, 2, 3], [1, 3, 0]])  # the other diagonal
        return local
    for row in concave:
        local[row] = _ears(_project(polygons[row], whole[row]))
    return local


def _project(polygon: Doubles, normal: Doubles) -> Doubles:
    """The polygon in two dimensions, counter-clockwise: without the axis that its normal follows most."""
    axis = int(np.abs(normal).argmax())
    flat: Doubles = polygon[:, [(axis + 1) % 3, (axis + 2) % 3]]
    return flat if normal[axis] > 0 else flat[:, ::-1]


def _ears(flat: Doubles) -> list[tuple[int, int, int]]:
    """Ear clipping; a polygon without an ear crosses itself, and any corner is then as good as another."""
    ring, triangles, at, misses = list(range(len(flat))), [], 0, 0
    while len(ring) > 3:
        at %= len(ring)
        ear = ring[at - 1], ring[at], ring[(at + 1) % len(ring)]
        if misses > len(ring) or _is_ear(flat, ear, ring):
            triangles.append(ear)
            del ring[at]
            misses = 0
        else:
            at += 1
            misses += 1
    return [*triangles, (ring[0], ring[1], ring[2])]


def _is_ear(flat: Doubles, ear: tuple[int, int, int], ring: list[int]) -> bool:
    a, b, c = flat[list(ear)]
    if _side(a, b, c) <= 0:
        return False
    others = flat[[i for i in ring if i not in ear]]
    inside = (_side(a, b, others) >= 0) & (_side(b, c, others) >= 0) & (_side(c, a, others) >= 0)
    return not bool(inside.any())


def _side(a: Doubles, b: Doubles, p: Doubles) -> npt.NDArray[Any]:
    """Positive where p lies to the left of the line from a to b."""
    left: npt.NDArray[Any] = (b[0] - a[0]) * (p[..., 1] - a[1]) - (b[1] - a[1]) * (p[..., 0] - a[0])
    return left
