"""Meshes that several shapes share: triangles in a space of their own, with a tree of their own."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gpu import layout
from gpu.layout import ShapeKind
from service.document.numbers import Vec3
from service.pack.geometry.meshes import PlacedMesh, Triangles, survey

PARTS = 128  # boxes that stand for a model when a box around it under a transform is computed


@dataclass(frozen=True)
class WrittenTriangles:
    """Finished arrays, in the order of the tree's leaves; an array is None where no triangle has such values."""

    triangles: np.ndarray
    normals: np.ndarray | None
    any_smooth: bool
    any_tangents: bool
    corners: dict[str, np.ndarray]  # uvs, uvs_1 and colors


@dataclass(frozen=True)
class UnwrittenTriangles:
    """Triangles that have not been written anywhere yet, and the final `places` of each."""

    triangles: Triangles
    places: np.ndarray


@dataclass(frozen=True)
class SharedMesh:
    key: Hashable
    center: np.ndarray  # (3,) float64: the origin of this space, in the mesh's own coordinates
    source: WrittenTriangles | UnwrittenTriangles
    count: int
    degenerate: int  # triangles that were skipped
    nodes: np.ndarray
    node_count: int
    node_origin: Vec3
    node_scale: Vec3
    parts: np.ndarray  # (k, 6) float64: boxes around all of it
    least: float  # twice the area of its smallest triangle
    greatest: float

    @property
    def reach(self) -> np.ndarray:
        """(3,) its greatest extent from its centre, per axis."""
        return np.asarray(np.abs(self.parts.reshape(-1, 2, 3)).max(axis=(0, 1)))

    @property
    def any_smooth(self) -> bool:
        return (
            self.source.any_smooth if isinstance(self.source, WrittenTriangles) else self.source.triangles.any_smooth
        )

    @property
    def any_tangents(self) -> bool:
        return (
            self.source.any_tangents
            if isinstance(self.source, WrittenTriangles)
            else self.source.triangles.any_tangents
        )

    def has(self, name: str) -> bool:
        if isinstance(self.source, WrittenTriangles):
            return name in self.source.corners
        return self.source.triangles.have(name)

    def write(self, triangles: np.ndarray, normals: np.ndarray, corners: dict[str, np.ndarray]) -> SharedMesh:
        """Fill its part of the scene's arrays, except those of zero length. Returns the model with views of that
        part."""
        source = self.source
        if isinstance(source, WrittenTriangles):
            triangles[...] = source.triangles
            if source.normals is not None:
                normals[...] = source.normals
            for name, values in source.corners.items():
                corners[name][...] = values
            for name, values in corners.items():
                if len(values) and name not in source.corners:
                    values[...] = name == "colors"
        else:
            source.triangles.write(source.places, triangles)
            if len(normals):
                source.triangles.write_normals(source.places, normals)
            for name, values in corners.items():
                if len(values):
                    source.triangles.write_corners(name, source.places, values)
        own = {name: values for name, values in corners.items() if self.has(name)}
        bits = self.any_smooth, self.any_tangents
        return replace(self, source=WrittenTriangles(triangles, normals if any(bits) else None, *bits, own))


def shared_mesh(key: Hashable, mesh: PlacedMesh) -> SharedMesh | None:
    """The mesh with its tree; None where no triangle has an area. `mesh` is of material 0 and shape 0, in its own
    coordinates.

    Raises SceneTooLarge.
    """
    from gpu.accel import bvh  # loads numba

    center = (mesh.vertices.min(axis=0, initial=np.inf) + mesh.vertices.max(axis=0, initial=-np.inf)) / 2
    triangles, boxes = survey([mesh], center)
    if not len(triangles):
        return None
    kinds = np.full(len(boxes), ShapeKind.TRIANGLE, np.uint8)
    tree = bvh.build(boxes[:, :3], boxes[:, 3:], kinds)
    nodes, node_count = bvh.thread(tree)
    places = np.empty(len(tree.order), np.uint32)
    places[tree.order] = np.arange(len(tree.order), dtype=np.uint32)
    starts = np.unique(np.linspace(0, len(boxes), PARTS, endpoint=False).astype(np.intp))
    ordered = boxes[tree.order].astype(np.float64)
    low = np.minimum.reduceat(ordered[:, :3], starts, axis=0)
    high = np.maximum.reduceat(ordered[:, 3:], starts, axis=0)
    areas = triangles.doubled_areas()
    return SharedMesh(
        key, center, UnwrittenTriangles(triangles, places), len(triangles), sum(triangles.degenerate.values()),
        nodes, node_count, tree.origin, tree.scale, np.concatenate([low, high], axis=1), float(areas.min()),
        float(areas.max()),
    )  # fmt: skip


def blank(mesh: PlacedMesh) -> PlacedMesh:
    """The mesh without a material and a shape, as it is shared."""
    return replace(mesh, material=0, shape=0)


def shift(models: Sequence[SharedMesh]) -> int:
    """The bits that hold the number of a triangle in any of the models: `SceneArrays.instance_shift`."""
    return max(((each.count - 1).bit_length() for each in models), default=0)


MOST_SEEN = layout.INSTANCED - 1  # triangles of all instances at most, their number rounded up to a power of two
