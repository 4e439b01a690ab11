"""The geometry that `assemble` makes from a scene's shapes, and the arrays of all its triangles, written once into
their final place: records, normals, corners and the models' trees.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gpu.layout import Node, ShapeKind, Triangle, TriangleNormals
from service.document.numbers import Vec3
from service.pack.geometry.instances import SharedMesh
from service.pack.geometry.meshes import Triangles
from service.pack.geometry.warnings import OddMesh
from service.system.shared_memory import SharedArena


@dataclass(frozen=True)
class TriangleBuffers:
    """The arrays of all triangles in final order, those of the models last, and the models' nodes."""

    triangles: np.ndarray
    normals: np.ndarray
    tangents: bool
    uvs: np.ndarray
    uvs_1: np.ndarray
    colors: np.ndarray
    nodes: np.ndarray

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        return self.triangles, self.normals, self.uvs, self.uvs_1, self.colors, self.nodes


def write_triangles(
    triangles: Triangles, places: np.ndarray | None, shared: Sequence[SharedMesh]
) -> tuple[TriangleBuffers, tuple[SharedMesh, ...]]:
    """Write everything into one arena, in which the models stay from now on."""
    start = len(triangles)
    count, node_count = start + sum(each.count for each in shared), sum(len(each.nodes) for each in shared)
    tangents = triangles.any_tangents or any(each.any_tangents for each in shared)
    smooth = count if tangents or triangles.any_smooth or any(each.any_smooth for each in shared) else 0
    shapes = {name: (count * _some_have(name, triangles, shared), 3, width) for name, width in CORNERS.items()}
    sizes = [int(np.prod(shape)) * _at_corner(name).itemsize for name, shape in shapes.items()]
    parts = count * Triangle.dtype.itemsize, smooth * TriangleNormals.dtype.itemsize, node_count * Node.dtype.itemsize
    arena = SharedArena(*parts, *sizes)
    out, normals = arena.room((count,), Triangle.dtype), arena.room((smooth,), TriangleNormals.dtype)
    nodes = arena.room((node_count,), Node.dtype)
    corners = {name: arena.room(shape, _at_corner(name)) for name, shape in shapes.items()}
    triangles.write(places, out[:start])
    if smooth:
        triangles.write_normals(places, normals[:start])
    for name, values in corners.items():
        if len(values):
            triangles.write_corners(name, places, values[:start])
    written, node = list[SharedMesh](), 0
    for each in shared:
        part = slice(start, start + each.count)
        nodes[node : node + len(each.nodes)] = each.nodes
        at = nodes[node : node + len(each.nodes)]
        start, node = part.stop, node + len(at)
        mesh = each.write(out[part], normals[part], {name: values[part] for name, values in corners.items()})
        written.append(replace(mesh, nodes=at))
    return TriangleBuffers(out, normals, tangents, corners["uvs"], corners["uvs_1"], corners["colors"], nodes), tuple(
        written
    )


CORNERS = {"uvs": 2, "uvs_1": 2, "colors": 4}  # the attributes of corners, with how many numbers each has


def _at_corner(name: str) -> np.dtype[Any]:
    return np.dtype(np.float16 if name == "colors" else np.float32)


def _some_have(name: str, triangles: Triangles, shared: Sequence[SharedMesh]) -> bool:
    return triangles.have(name) or any(each.has(name) for each in shared)


@dataclass(frozen=True)
class MeshExtents:
    """The places of a geometry's meshes. Keys are equal where the meshes and all that goes into their triangles
    are."""

    key: Hashable
    low: np.ndarray  # (n, 3) boxes around the meshes that have vertices, and their shapes' indices in the document
    high: np.ndarray
    owners: np.ndarray
    warnings: tuple[str, ...]
    odd: tuple[OddMesh, ...]


@dataclass(frozen=True)
class Geometry:
    """Records by kind, in final order: for a kind in `bvh_kinds` that of the leaves. Large arrays are shared
    memory."""

    shapes: dict[ShapeKind, np.ndarray]
    triangle_normals: np.ndarray
    tangents: bool  # whether the normals have tangents
    triangle_uvs: np.ndarray
    triangle_uvs_1: np.ndarray
    triangle_colors: np.ndarray
    lights: np.ndarray  # layout.Light of the shapes that shine, not yet weighted
    areas: np.ndarray  # of these, m^2
    nodes: np.ndarray
    node_count: int
    node_origin: Vec3
    node_scale: Vec3
    bvh_kinds: frozenset[ShapeKind]
    large: dict[ShapeKind, int]  # the number of shapes of such a kind that stand first, outside the tree
    instances: np.ndarray
    instance_nodes: np.ndarray
    models: tuple[SharedMesh, ...]  # that the instances show, in the order of their triangles
    # Equal for equal triangles without those of models; None: they shine, or compare with none
    unshared_key: Hashable
    origin: Vec3
    radius: float  # of a ball around everything; 1 for an empty scene
    meshes: MeshExtents
    warnings: tuple[str, ...]

    @property
    def triangle_buffers(self) -> TriangleBuffers:
        corners = self.triangle_uvs, self.triangle_uvs_1, self.triangle_colors
        arrays = self.shapes[ShapeKind.TRIANGLE], self.triangle_normals, self.tangents
        return TriangleBuffers(*arrays, *corners, self.instance_nodes)
