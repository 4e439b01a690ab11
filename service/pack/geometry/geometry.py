"""The geometry that `assemble` makes from a scene's shapes."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from gpu.layout import ShapeKind
from service.document.numbers import Vec3
from service.pack.geometry.shared_meshes import SharedMesh
from service.pack.geometry.triangle_buffers import TriangleBuffers
from service.pack.geometry.warnings import OddMesh


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
        own = self.shapes[ShapeKind.TRIANGLE], self.triangle_normals, self.tangents
        return TriangleBuffers(*own, *corners, self.instance_nodes)
