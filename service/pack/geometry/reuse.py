"""Reuse of the parts of earlier geometries in the next one."""

from __future__ import annotations

import operator
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gpu.layout import ShapeKind
from service.document.shape import Shape
from service.pack.geometry import scene_bvh
from service.pack.geometry.geometry import Geometry
from service.pack.geometry.rebase import rebase
from service.pack.geometry.shape_records import area_lights, hide
from service.pack.geometry.shared_meshes import SharedMesh
from service.pack.geometry.world import ShapeMaterials, World, place_analytic
from service.pack.parameters import vec3


@dataclass(frozen=True)
class Earlier:
    """Geometries that were packed before, the newest last, and the keys by which a new one is compared with them."""

    geometries: Sequence[Geometry] = ()
    contents: Sequence[Hashable] | None = None  # a key of each shape
    mesh_key: Hashable = None  # of all meshes, none of which shines; None: they cannot be compared

    @property
    def models(self) -> Mapping[Hashable, SharedMesh]:
        """The shared meshes that need not be made again, by their keys."""
        return {model.key: model for earlier in self.geometries for model in earlier.models}

    def among_other_shapes(self, shapes: Sequence[Shape], materials: ShapeMaterials) -> Geometry | None:
        """The newest geometry with the same meshes, now beside `shapes`; None where no geometry has them.

        Raises InvalidDocument.
        """
        for earlier in reversed(self.geometries):
            if self.mesh_key is not None and earlier.meshes.key == self.mesh_key:
                same = _among_other_shapes(earlier, shapes, materials)
                if same is not None:
                    return same
        return None

    def unshared_key(self, world: World, origin: np.ndarray, materials: ShapeMaterials) -> Hashable:
        """The key of the triangles that no instance shows."""
        if self.contents is None or any(materials.names[m.material] in materials.emissive for m in world.meshes):
            return None
        own = tuple((mesh.shape, self.contents[mesh.shape]) for mesh in world.meshes)
        return own, vec3(origin) if own else None, tuple(materials.names), tuple(materials.charts.items())

    def same_triangles(self, unshared_key: Hashable, models: Sequence[SharedMesh]) -> Geometry | None:
        """The newest geometry with the same triangles in the same order, or None."""
        for earlier in reversed(self.geometries):
            same = len(earlier.models) == len(models) and all(map(operator.is_, earlier.models, models))
            if same and unshared_key is not None and earlier.unshared_key == unshared_key:
                return earlier
        return None


def _among_other_shapes(earlier: Geometry, shapes: Sequence[Shape], materials: ShapeMaterials) -> Geometry | None:
    """The meshes of `earlier` among these shapes; None where the meshes' records or their tree would differ."""
    if earlier.bvh_kinds - {ShapeKind.TRIANGLE, ShapeKind.INSTANCE}:
        return None
    rebased = rebase(place_analytic(shapes, materials), earlier.meshes)
    crowded = any(len(records) > scene_bvh.LINEAR[kind] for kind, records in rebased.records.items())
    if crowded or vec3(rebased.origin) != earlier.origin:
        return None
    triangles = earlier.shapes[ShapeKind.TRIANGLE]
    hide(tuple(rebased.records.values()), shapes)
    lights, areas = area_lights(rebased.records, triangles[:0], materials)  # none of the triangles shines
    return replace(
        earlier,
        shapes={**rebased.records, ShapeKind.TRIANGLE: triangles},
        lights=lights,
        areas=areas,
        radius=rebased.radius,
        warnings=(*earlier.meshes.warnings, *rebased.warnings),
    )
