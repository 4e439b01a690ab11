"""Shapes -> records, lights among them, and the tree: all that the camera, the sky and a colour leave as it is."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gpu import layout
from gpu.layout import Node, ShapeKind
from service.assets import Assets
from service.pack import lights, meshes, records
from service.pack.placed import Placed
from service.pack.placing import place
from service.pack.records import Bounds
from service.pack.tree import LINEAR, plant, triangle_bounds
from service.pack.values import vec3
from service.scene.numbers import Vec3
from service.scene.shape import Shape

FAR = 4.0  # extents from 0 at which a scene's float32 positions begin to lose digits it needs


@dataclass(frozen=True)
class Geometry:
    """Records by kind, in final order: of a kind in `bvh_kinds` that of the leaves."""

    shapes: dict[ShapeKind, np.ndarray]
    triangle_normals: np.ndarray
    triangle_uvs: np.ndarray
    triangle_uvs_1: np.ndarray
    triangle_colors: np.ndarray
    lights: np.ndarray  # layout.Light of the shapes that shine, not yet weighted
    areas: np.ndarray  # of these, m^2
    nodes: np.ndarray
    node_origin: Vec3
    node_scale: Vec3
    bvh_kinds: frozenset[ShapeKind]
    origin: Vec3
    radius: float  # of a ball around everything; 1 where there is nothing
    warnings: tuple[str, ...]


def geometry(
    shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str], assets: Assets, max_triangles: int,
    uv_sets: Mapping[str, frozenset[int]],
) -> Geometry:  # fmt: skip
    """`names`: the materials in order; `emissive`: those that shine; `uv_sets`: which texture coordinates they read.

    Raises InvalidDocument.
    """
    placed, placed_meshes = place(shapes, names, emissive, assets, max_triangles, uv_sets)
    analytic = _analytic(placed, np.zeros(3))
    vertices = [mesh.vertices for mesh in placed_meshes]
    origin, radius = _frame([*(bounds for _, bounds in analytic.values()), *zip(vertices, vertices, strict=True)])
    if origin.any():
        analytic = _analytic(placed, origin)
    triangles, normals, degenerate, kept = meshes.triangles(placed_meshes, origin)
    corners = {name: meshes.at_corners(placed_meshes, kept, name) for name in ("uvs", "uvs_1", "colors")}
    found = {kind: array for kind, (array, _) in analytic.items()} | {ShapeKind.TRIANGLE: triangles}
    bounds = {kind: bounds for kind, (_, bounds) in analytic.items() if len(found[kind]) > LINEAR[kind]}
    if len(triangles) > LINEAR[ShapeKind.TRIANGLE]:
        bounds[ShapeKind.TRIANGLE] = triangle_bounds(triangles)
    nodes, node_origin, node_scale = np.zeros(0, Node.dtype), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if bounds:
        nodes, order, node_origin, node_scale = plant(bounds)
        found |= {kind: found[kind][places] for kind, places in order.items()}
        if len(normals) and ShapeKind.TRIANGLE in order:
            normals = normals[order[ShapeKind.TRIANGLE]]
        if ShapeKind.TRIANGLE in order:
            corners = {n: a[order[ShapeKind.TRIANGLE]] if len(a) else a for n, a in corners.items()}
    _hide(found, shapes)
    shining = lights.mark(found, np.array([name in emissive for name in names]))
    areas = lights.areas(found, shining)
    warnings = [f"/shapes/{i}: {n} degenerate triangles skipped" for i, n in degenerate.items()]
    warnings += [f"/shapes/{i}: too small to be traced, left out" for i in dict.fromkeys(placed.vanished)]
    return Geometry(
        found, normals, corners["uvs"], corners["uvs_1"], corners["colors"], shining, areas, nodes, node_origin,
        node_scale, frozenset(bounds), vec3(origin), radius, tuple(warnings),
    )  # fmt: skip


def _hide(records: dict[ShapeKind, np.ndarray], shapes: Sequence[Shape]) -> None:
    """Marks the records of shapes that the camera looks through."""
    hidden = np.array([not shape.visible_to_camera for shape in shapes], bool)
    if hidden.any():
        for array in records.values():
            index = array["shape"] & np.uint32(~layout.SINGLE_SIDED & layout.NONE)
            array["shape"] |= np.where(hidden[index], layout.HIDDEN, 0).astype(np.uint32)


def _analytic(placed: Placed, origin: np.ndarray) -> dict[ShapeKind, tuple[np.ndarray, Bounds]]:
    return {
        ShapeKind.SPHERE: records.spheres(placed, origin),
        ShapeKind.QUAD: records.quads(placed, origin),
        ShapeKind.BOX: records.boxes(placed, origin),
        ShapeKind.ELLIPSOID: records.ellipsoids(placed, origin),
    }


def _frame(bounds: Iterable[Bounds]) -> tuple[np.ndarray, float]:
    """(origin, radius). The origin is 0 unless everything lies far from it: most scenes keep their numbers."""
    some = [(low.min(axis=0), high.max(axis=0)) for low, high in bounds if len(low)]
    if not some:
        return np.zeros(3), 1.0
    low, high = np.min([b[0] for b in some], axis=0), np.max([b[1] for b in some], axis=0)
    center, extent = (low + high) / 2, high - low
    size = float(extent.max())
    radius = float(np.linalg.norm(extent)) / 2
    if np.abs(center).max() <= FAR * size:
        return np.zeros(3), radius or 1.0
    step = 2.0 ** math.floor(math.log2(size)) if size else 1.0  # a power of two: round numbers stay round
    return np.rint(center / step) * step, radius or 1.0
