"""A row for each kind of record of shapes: its array in a scene, and balls around what it holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gpu import layout
from gpu.arrays import SceneArrays
from gpu.layout import ShapeBit, ShapeKind

_GRID = 65535.0  # steps of a tree's grid
_CORNERS = np.array([(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)], float)  # one of each two that face each other
_FACES, _CAPS = 6, 2  # quads that a box becomes when it shines, and a cylinder besides its side


class ShapeRow(NamedTuple):
    records: str  # its array in `SceneArrays`
    around: Callable[[np.ndarray], np.ndarray]  # records -> balls around them, (n, 4): centre and radius


def solid_axes(solids: np.ndarray) -> np.ndarray:
    """(n, 3, 3): world from object."""
    rows = np.stack([solids["row_x"], solids["row_y"], solids["row_z"]], axis=1).astype(float)
    return np.linalg.inv(rows) if len(rows) else rows


def half_axes2(solids: np.ndarray) -> np.ndarray:
    """The squares of the half axes, (n, 3)."""
    return np.asarray((solid_axes(solids) ** 2).sum(axis=1))


def corners(triangles: np.ndarray) -> np.ndarray:
    return np.stack([triangles["v0"], triangles["v1"], triangles["v2"]], axis=1).astype(float)


def quads_when_shining(boxes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,): the number of quads that each record of a box becomes when it begins to shine, and 1 where it is then no
    longer among the boxes."""
    bits = boxes["shape"]
    is_round, is_open = (bits & np.uint32(ShapeBit.ROUND)) > 0, (bits & np.uint32(ShapeBit.OPEN)) > 0
    return np.where(is_round, np.where(is_open, 0, _CAPS), _FACES), (~is_round).astype(int)


def _around_spheres(spheres: np.ndarray) -> np.ndarray:
    return np.column_stack([spheres["center"].astype(float), spheres["radius"]])


def _around_quads(quads: np.ndarray) -> np.ndarray:
    u, v = quads["u"].astype(float), quads["v"].astype(float)
    radius = 0.5 * np.maximum(np.linalg.norm(u + v, axis=1), np.linalg.norm(u - v, axis=1))
    return np.column_stack([quads["origin"] + 0.5 * (u + v), radius])


def _around_boxes(boxes: np.ndarray) -> np.ndarray:
    """As far as the farthest corner."""
    away = np.linalg.norm(np.einsum("nij,kj->nki", solid_axes(boxes), _CORNERS), axis=2)
    return np.column_stack([boxes["center"].astype(float), away.max(axis=1)])


def _around_ellipsoids(ellipsoids: np.ndarray) -> np.ndarray:
    return np.column_stack([ellipsoids["center"].astype(float), np.sqrt(half_axes2(ellipsoids).sum(axis=1))])


def _around_meshes(triangles: np.ndarray) -> np.ndarray:
    """A ball around all triangles of each shape."""
    owners = triangles["shape"] & np.uint32(~layout.SHAPE_BITS & layout.NONE)
    order = np.argsort(owners, kind="stable")
    firsts = np.flatnonzero(np.diff(owners[order], prepend=-1))
    points = corners(triangles[order])
    low = np.minimum.reduceat(points.min(axis=1), firsts)
    high = np.maximum.reduceat(points.max(axis=1), firsts)
    center = 0.5 * (low + high)
    mine = np.repeat(np.arange(len(firsts)), np.diff(firsts, append=len(order)))
    away = np.linalg.norm(points - center[mine][:, None], axis=2).max(axis=1)
    return np.column_stack([center, np.maximum.reduceat(away, firsts)])


def _around_instances(instances: np.ndarray) -> np.ndarray:
    origin, size = instances["node_origin"].astype(float), _GRID * instances["node_scale"].astype(float)
    third = np.stack([instances["axis_z_x"], instances["axis_z_y"], instances["axis_z_z"]], axis=1)
    axes = np.stack([instances["axis_x"], instances["axis_y"], third], axis=2).astype(float)
    center = np.einsum("nij,nj->ni", axes, origin + 0.5 * size) + instances["center"]
    halves = np.einsum("nij,knj->nki", axes, 0.5 * size[None] * _CORNERS[:, None])
    return np.column_stack([center, np.linalg.norm(halves, axis=2).max(axis=1)])


KINDS = {
    ShapeKind.SPHERE: ShapeRow("spheres", _around_spheres),
    ShapeKind.QUAD: ShapeRow("quads", _around_quads),
    ShapeKind.BOX: ShapeRow("boxes", _around_boxes),
    ShapeKind.ELLIPSOID: ShapeRow("ellipsoids", _around_ellipsoids),
    ShapeKind.TRIANGLE: ShapeRow("triangles", _around_meshes),
    ShapeKind.INSTANCE: ShapeRow("instances", _around_instances),
}

# The arrays of the kinds that may stand in a kernel's loop; instances never do.
LOOPED = {kind: row.records for kind, row in KINDS.items() if kind is not ShapeKind.INSTANCE}


def records(scene: SceneArrays, kind: ShapeKind) -> np.ndarray:
    found: np.ndarray = getattr(scene, KINDS[kind].records)
    return found
