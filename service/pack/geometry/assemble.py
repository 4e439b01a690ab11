"""Shapes -> records, with those of area lights, and the tree: the part that does not depend on camera, sky or
colours. Parts of earlier geometries are reused in the next one.
"""

from __future__ import annotations

import operator
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gpu.layout import ShapeKind
from service.document.shape import Shape
from service.formats import Assets
from service.pack.geometry import instances, meshes, scene_bvh
from service.pack.geometry.geometry import Geometry, MeshExtents, write_triangles
from service.pack.geometry.instances import SharedMesh
from service.pack.geometry.meshes import Triangles
from service.pack.geometry.rebase import Rebased, rebase
from service.pack.geometry.records import Bounds
from service.pack.geometry.scene_bvh import SceneBvh, build_scene_bvh, stand_out
from service.pack.geometry.shape_records import area_lights, hide
from service.pack.geometry.warnings import counted
from service.pack.geometry.world import ShapeMaterials, World, place, place_analytic
from service.pack.parameters import vec3
from service.system.shared_memory import LEAST, SharedArena, trim

MANY = 100_000  # triangles from which on packing returns its freed memory to the system


@dataclass
class _Tree:
    """The tree, the instances in it, and the order of the shapes."""

    bvh: SceneBvh
    instances: np.ndarray  # layout.Instance
    kinds: frozenset[ShapeKind]  # kinds that rays find through trees
    large: dict[ShapeKind, int]  # of such a kind: the number of shapes that stand first, outside the tree


def assemble(
    shapes: Sequence[Shape], materials: ShapeMaterials, assets: Assets, max_triangles: int,
    earlier: Earlier | None = None, apart: bool = False,
) -> Geometry:  # fmt: skip
    """The geometry of `shapes`.

    Parts of `earlier` ones are used again: shared meshes; all triangles where only instances have moved; the tree as
    well where the meshes are the same and nothing else is in that tree. With `apart` large meshes get trees of their
    own, so that they can be moved. Raises InvalidDocument.
    """
    earlier = earlier or Earlier()
    again = earlier.among_other_shapes(shapes, materials)
    if again is not None:
        return again
    world = place(shapes, materials, assets, max_triangles, earlier.models, apart)
    extents = _mesh_extents(world, earlier.mesh_key)
    rebased = rebase(world.analytic, extents)
    triangles, tree = _grow_tree(world, rebased)
    if len(triangles) > MANY:
        trim()
    unshared_key = earlier.unshared_key(world, rebased.origin, materials)
    order = tree.bvh.order.get(ShapeKind.TRIANGLE)
    same = earlier.same_triangles(unshared_key, world.models) if order is None else None
    if same is None:
        buffers, models = write_triangles(triangles, _inverse(order), world.models)
    else:
        buffers, models = same.triangle_buffers, same.models
    records, nodes, placed = _in_shared_memory(rebased, tree)
    plain = buffers.triangles[: len(triangles)]
    hide((*records.values(), placed) if same is not None else (*records.values(), placed, plain), shapes)
    lights, areas = area_lights(records, plain, materials)
    records[ShapeKind.TRIANGLE] = buffers.triangles
    extents = replace(extents, warnings=extents.warnings + _degenerate(world, triangles))
    for array in (*records.values(), nodes, placed, *buffers.arrays):
        array.flags.writeable = array.nbytes < LEAST  # larger ones may be mapped by other processes
    if len(buffers.triangles) > MANY:
        trim()
    return Geometry(
        records, buffers.normals, buffers.tangents, buffers.uvs, buffers.uvs_1, buffers.colors, lights, areas,
        nodes, tree.bvh.count, tree.bvh.origin, tree.bvh.scale, tree.kinds, tree.large, placed, buffers.nodes,
        tuple(models), unshared_key, vec3(rebased.origin), rebased.radius, extents,
        (*extents.warnings, *rebased.warnings),
    )  # fmt: skip


def _grow_tree(world: World, rebased: Rebased) -> tuple[Triangles, _Tree]:
    """The triangles that have an area, and the tree over all kinds of shapes of which there are too many for a loop.

    Raises InvalidDocument.
    """
    triangles, boxes = meshes.survey(world.meshes, rebased.origin)
    placed = instances.records(world.instances, world.models, rebased.origin, len(triangles))
    bounds = _tree_bounds(world, rebased, boxes)
    outside = stand_out(bounds)
    bvh = build_scene_bvh(bounds, outside) if bounds else SceneBvh.empty()
    kinds, large = frozenset(bounds), {kind: len(places) for kind, places in outside.items()}
    if len(placed):  # rays find triangles through trees, though perhaps not through the scene's
        large.setdefault(ShapeKind.TRIANGLE, len(triangles))
        kinds |= {ShapeKind.TRIANGLE}
    return triangles, _Tree(bvh, placed, kinds, large)


def _tree_bounds(world: World, rebased: Rebased, triangles: np.ndarray) -> dict[ShapeKind, Bounds]:
    """Boxes around the shapes of each kind that goes into the tree; `triangles` (n, 6) are around those."""
    bounds = {kind: box for kind, box in rebased.bounds.items() if len(box[0]) > scene_bvh.LINEAR[kind]}
    if len(triangles) > scene_bvh.LINEAR[ShapeKind.TRIANGLE]:
        bounds[ShapeKind.TRIANGLE] = triangles[:, :3], triangles[:, 3:]
    if world.instances:
        around = np.array([each.box for each in world.instances]) - np.tile(rebased.origin, 2)
        bounds[ShapeKind.INSTANCE] = around[:, :3], around[:, 3:]
    return bounds


def _in_shared_memory(
    rebased: Rebased, tree: _Tree
) -> tuple[dict[ShapeKind, np.ndarray], np.ndarray, np.ndarray]:  # fmt: skip
    """The records of analytic shapes in final order, the nodes and the instances, in one piece of shared memory."""
    arena = SharedArena(*(a.nbytes for a in (*rebased.records.values(), tree.bvh.nodes, tree.instances)))
    nodes, placed = arena.put(tree.bvh.nodes), arena.put(tree.instances)
    return {kind: arena.put(a, tree.bvh.order.get(kind)) for kind, a in rebased.records.items()}, nodes, placed


def _inverse(order: np.ndarray | None) -> np.ndarray | None:
    """The inverse of a permutation."""
    if order is None:
        return None
    places = np.empty(len(order), np.uint32)
    places[order] = np.arange(len(order), dtype=np.uint32)
    return places


def _degenerate(world: World, triangles: Triangles) -> tuple[str, ...]:
    """Warnings about triangles without an area, by shape."""
    counts = dict(triangles.degenerate)
    counts |= {each.used[1]: each.model.degenerate for each in world.instances if each.model.degenerate}
    return counted((i, f"{n} degenerate triangle{'s' if n > 1 else ''} skipped") for i, n in sorted(counts.items()))


def _mesh_extents(world: World, key: Hashable) -> MeshExtents:
    some = [mesh for mesh in world.meshes if len(mesh.vertices)]
    boxes = [np.concatenate([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]) for mesh in some]
    boxes += [each.box for each in world.instances]
    around = np.array(boxes).reshape(-1, 6)
    owners = [mesh.shape for mesh in some] + [each.used[1] for each in world.instances]
    return MeshExtents(
        key, around[:, :3], around[:, 3:], np.array(owners, np.uint32), counted(world.mesh_warnings),
        tuple(world.odd),
    )  # fmt: skip


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
        mesh_contents = tuple((mesh.shape, self.contents[mesh.shape]) for mesh in world.meshes)
        return (
            mesh_contents,
            vec3(origin) if mesh_contents else None,
            tuple(materials.names),
            tuple(materials.charts.items()),
        )

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
