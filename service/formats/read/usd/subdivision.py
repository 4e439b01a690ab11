"""Whether subdivision would change the shape of a mesh of polygons."""

from __future__ import annotations

import numpy as np

from service.formats.read.polygons import Longs
from service.formats.types import Doubles

FLAT = 1e-5  # the sine of an angle between faces, and a distance as a share of the mesh's extent, that are roundings


def bends(points: Doubles, corners: Longs, counts: Longs) -> bool:
    """True if a surface subdivided from this cage leaves it: where faces meet at an angle or are not flat, and where
    an outline turns at a point of several faces. The points of a single face are sharp corners."""
    if not len(corners):
        return False
    face = np.repeat(np.arange(len(counts)), counts)
    first = (np.cumsum(counts) - counts)[face]
    following = first + (np.arange(len(corners)) - first + 1) % counts[face]
    here, there = points[corners], points[corners[following]]
    extent = float(np.ptp(points[corners], axis=0).max())
    if not np.isfinite(extent) or extent == 0:
        return False
    # Newell's normals, about each face's first point so that places far from the origin lose nothing.
    origin = points[corners[first]]
    crosses = np.cross(here - origin, there - origin)
    normals = np.stack([np.bincount(face, crosses[:, k], len(counts)) for k in range(3)], axis=1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 0, normals / np.where(length > 0, length, 1), 0.0)[face]
    if (np.abs(np.sum((here - origin) * normals, axis=1)) > FLAT * extent).any():
        return True
    some = np.zeros_like(points)
    some[corners] = normals
    if (np.linalg.norm(np.cross(normals, some[corners]), axis=1) > FLAT).any():
        return True
    return _outline_turns(points, corners, corners[following])


def _outline_turns(points: Doubles, here: Longs, there: Longs) -> bool:
    """True if edges of a single face meet at an angle in a point of several faces."""
    ends = np.sort(np.stack([here, there], axis=1), axis=1)
    edges, times = np.unique(ends, axis=0, return_counts=True)
    border = edges[times == 1]
    shared = np.bincount(here, minlength=len(points)) > 1
    along = points[border[:, 1]] - points[border[:, 0]]
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    some = np.zeros_like(points)
    for end in (0, 1):
        some[border[:, end]] = along
    turned = [np.linalg.norm(np.cross(along, some[border[:, end]]), axis=1) > FLAT for end in (0, 1)]
    return any(bool((turned[end] & shared[border[:, end]]).any()) for end in (0, 1))
