"""Shapes -> records, lights among them, and the tree: all that the camera, the sky and a colour leave as it is."""

from __future__ import annotations

import operator
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gpu import layout
from gpu.layout import Node, ShapeKind
from service.assets import Assets
from service.pack.geometry import instances, meshes, records
from service.pack.geometry.analytic import AnalyticShapes
from service.pack.geometry.rebase import choose_origin
from service.pack.geometry.rebase import warnings as lost
from service.pack.geometry.records import Bounds
from service.pack.geometry.scene_bvh import LINEAR, build_scene_bvh, stand_out
from service.pack.geometry.shared_meshes import SharedMesh
from service.pack.geometry.triangle_buffers import TriangleBuffers, write_triangles
from service.pack.geometry.warnings import counted
from service.pack.geometry.world import World, place, place_analytic
from service.pack.lights import lights
from service.pack.parameters import vec3
from service.pack.textures.uses import RequiredCharts
from service.scene.numbers import Vec3
from service.scene.shape import Shape
from service.shared_memory import LEAST, SharedArena, trim

MANY = 100_000  # triangles, after which what was needed on the way is worth giving back


@dataclass(frozen=True)
class Meshes:
    """What a geometry says of its meshes: `key` is equal where they are, with all that goes into their triangles."""

    key: Hashable
    low: np.ndarray  # boxes around those with vertices (n, 3), and which shapes of the document they are
    high: np.ndarray
    owners: np.ndarray
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Geometry:
    """Records by kind, in final order: of a kind in `bvh_kinds` that of the leaves. Large ones are shared memory."""

    shapes: dict[ShapeKind, np.ndarray]
    triangle_normals: np.ndarray
    tangents: bool  # whether these have them
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
    large: dict[ShapeKind, int]  # of such a kind: how many stand first, out of the tree
    instances: np.ndarray
    instance_nodes: np.ndarray
    models: tuple[SharedMesh, ...]  # that the instances show, in the order of their triangles
    flats: Hashable  # equal where all other triangles are; None: of nothing that can be compared, or that shines
    origin: Vec3
    radius: float  # of a ball around everything; 1 where there is nothing
    meshes: Meshes
    warnings: tuple[str, ...]

    @property
    def details(self) -> TriangleBuffers:
        corners = self.triangle_uvs, self.triangle_uvs_1, self.triangle_colors
        own = self.shapes[ShapeKind.TRIANGLE], self.triangle_normals, self.tangents
        return TriangleBuffers(*own, *corners, self.instance_nodes)


def assemble(
    shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str], assets: Assets, max_triangles: int,
    reads: Mapping[str, RequiredCharts], key: Hashable = None, contents: Sequence[Hashable] | None = None,
    kept: Sequence[Geometry] = (), apart: bool = False,
) -> Geometry:  # fmt: skip
    """`names`: the materials in order; `emissive`: those that shine; `reads`: what they read of their shapes;
    `kept`: other geometries, the newest last, of which parts serve again: models; all of the triangles where shapes
    that show them have moved; the tree as well where `key`, of the meshes, none of which shines, is the same, and
    nothing else is in that tree. `contents`: keys of the shapes. `apart`: large meshes shall move without the others.

    Raises InvalidDocument.
    """
    for earlier in reversed(kept):
        if key is not None and earlier.meshes.key == key:
            same = _among_other_shapes(earlier, shapes, names, emissive, reads)
            if same is not None:
                return same
    known = {each.key: each for earlier in kept for each in earlier.models}
    every = place(shapes, names, emissive, assets, max_triangles, reads, known, apart)
    shared: Sequence[SharedMesh] = every.models
    analytic = _analytic(every.placed, np.zeros(3))
    own = _mesh_extents(every, key)
    low, high, owners, exact = _extents(analytic, own)
    origin, radius = choose_origin(low, high)
    if origin.any():
        analytic = _analytic(every.placed, origin)
    records.only_vast(analytic[ShapeKind.SPHERE][0], low, high)
    triangles, boxes = meshes.survey(every.meshes, origin)
    found = {kind: array for kind, (array, _) in analytic.items()}
    bounds = {kind: bounds for kind, (_, bounds) in analytic.items() if len(found[kind]) > LINEAR[kind]}
    if len(triangles) > LINEAR[ShapeKind.TRIANGLE]:
        bounds[ShapeKind.TRIANGLE] = boxes[:, :3], boxes[:, 3:]
    placed = instances.records(every.standing, shared, origin, len(triangles))
    if len(placed):
        around = np.array([each.box for each in every.standing]) - np.tile(origin, 2)
        bounds[ShapeKind.INSTANCE] = around[:, :3], around[:, 3:]
    nodes, node_origin, node_scale = np.zeros(0, Node.dtype), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    standing, order = dict[ShapeKind, np.ndarray](), dict[ShapeKind, np.ndarray]()
    node_count = 0
    if bounds:
        standing = stand_out(bounds)
        nodes, node_count, order, node_origin, node_scale = build_scene_bvh(bounds, standing)
    kinds, large = frozenset(bounds), {kind: len(places) for kind, places in standing.items()}
    if len(placed):  # triangles are met through trees, though perhaps not through the scene's
        large.setdefault(ShapeKind.TRIANGLE, len(triangles))
        kinds |= {ShapeKind.TRIANGLE}
    del boxes, bounds
    if len(triangles) > MANY:
        trim()
    places = _inverse(order.get(ShapeKind.TRIANGLE))
    flats = _flats(every, origin, names, reads, emissive, contents)
    again = _same_triangles(flats, shared, kept) if ShapeKind.TRIANGLE not in order else None
    if again is None:
        details, shared = write_triangles(triangles, places, shared)
    else:
        details, shared = again.details, again.models
    arena = SharedArena(*(array.nbytes for array in (*found.values(), nodes, placed)))
    nodes, placed = arena.put(nodes), arena.put(placed)
    found = {kind: arena.put(array, order.get(kind)) for kind, array in found.items()}
    found[ShapeKind.TRIANGLE] = details.triangles[: len(triangles)]
    _hide((*found.values(), placed) if again is None else _others(found, placed), shapes)
    shining = lights.mark(found, np.array([name in emissive for name in names]))
    areas = lights.areas(found, shining)
    found[ShapeKind.TRIANGLE] = details.triangles
    flat = dict(triangles.degenerate)
    flat |= {each.used[1]: each.model.degenerate for each in every.standing if each.model.degenerate}
    own = replace(own, warnings=own.warnings + _degenerate(flat))
    warnings = [*own.warnings, *_vanished(every.placed), *lost(low, high, owners, exact, origin)]
    for array in (*found.values(), nodes, placed, *details.arrays):
        array.flags.writeable = array.nbytes < LEAST  # others may have it mapped
    if len(found[ShapeKind.TRIANGLE]) > MANY:
        trim()
    return Geometry(
        found, details.normals, details.tangents, details.uvs, details.uvs_1, details.colors, shining, areas,
        nodes, node_count, node_origin, node_scale, kinds, large, placed, details.nodes, tuple(shared), flats,
        vec3(origin), radius, own, tuple(warnings),
    )  # fmt: skip


def _among_other_shapes(
    earlier: Geometry, shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str],
    reads: Mapping[str, RequiredCharts],
) -> Geometry | None:  # fmt: skip
    """The meshes of `earlier` with what else there is now; None where that touches them."""
    if earlier.bvh_kinds - {ShapeKind.TRIANGLE, ShapeKind.INSTANCE}:
        return None
    placed = place_analytic(shapes, names, emissive, reads)
    analytic = _analytic(placed, np.zeros(3))
    low, high, owners, exact = _extents(analytic, earlier.meshes)
    origin, radius = choose_origin(low, high)
    if vec3(origin) != earlier.origin or any(len(array) > LINEAR[kind] for kind, (array, _) in analytic.items()):
        return None
    if origin.any():
        analytic = _analytic(placed, origin)
    records.only_vast(analytic[ShapeKind.SPHERE][0], low, high)
    found = {kind: array for kind, (array, _) in analytic.items()}
    _hide(tuple(found.values()), shapes)
    found[ShapeKind.TRIANGLE] = earlier.shapes[ShapeKind.TRIANGLE][:0]  # none of them shines
    shining = lights.mark(found, np.array([name in emissive for name in names]))
    areas = lights.areas(found, shining)
    found[ShapeKind.TRIANGLE] = earlier.shapes[ShapeKind.TRIANGLE]
    warnings = [*earlier.meshes.warnings, *_vanished(placed), *lost(low, high, owners, exact, origin)]
    return replace(earlier, shapes=found, lights=shining, areas=areas, radius=radius, warnings=tuple(warnings))


def _flats(
    every: World, origin: np.ndarray, names: Sequence[str], reads: Mapping[str, RequiredCharts],
    emissive: Collection[str], contents: Sequence[Hashable] | None,
) -> Hashable:  # fmt: skip
    if contents is None or any(names[mesh.material] in emissive for mesh in every.meshes):
        return None
    own = tuple((mesh.shape, contents[mesh.shape]) for mesh in every.meshes)
    return own, vec3(origin) if own else None, tuple(names), tuple(reads.items())


def _same_triangles(flats: Hashable, shared: Sequence[SharedMesh], kept: Sequence[Geometry]) -> Geometry | None:
    """The newest of `kept` with the same triangles in the same places."""
    for earlier in reversed(kept):
        same = len(earlier.models) == len(shared) and all(map(operator.is_, earlier.models, shared))
        if same and flats is not None and earlier.flats == flats:
            return earlier
    return None


def _others(found: dict[ShapeKind, np.ndarray], placed: np.ndarray) -> tuple[np.ndarray, ...]:
    return *(array for kind, array in found.items() if kind != ShapeKind.TRIANGLE), placed


def _vanished(placed: AnalyticShapes) -> list[str]:
    return [f"/shapes/{i}: too small to be traced, left out" for i in dict.fromkeys(placed.vanished)]


def _inverse(order: np.ndarray | None) -> np.ndarray | None:
    """Where each goes, of which goes where."""
    if order is None:
        return None
    places = np.empty(len(order), np.uint32)
    places[order] = np.arange(len(order), dtype=np.uint32)
    return places


def _degenerate(counts: Mapping[int, int]) -> tuple[str, ...]:
    return counted((i, f"{n} degenerate triangle{'s' if n > 1 else ''} skipped") for i, n in sorted(counts.items()))


def _hide(records: Sequence[np.ndarray], shapes: Sequence[Shape]) -> None:
    """Marks the records of shapes that the camera looks through."""
    hidden = np.array([not shape.visible_to_camera for shape in shapes], bool)
    if hidden.any():
        for array in records:
            index = array["shape"] & np.uint32(~layout.SINGLE_SIDED & layout.NONE)
            array["shape"] |= np.where(hidden[index], layout.HIDDEN, 0).astype(np.uint32)


def _analytic(placed: AnalyticShapes, origin: np.ndarray) -> dict[ShapeKind, tuple[np.ndarray, Bounds]]:
    return {
        ShapeKind.SPHERE: records.spheres(placed, origin),
        ShapeKind.QUAD: records.quads(placed, origin),
        ShapeKind.BOX: records.boxes(placed, origin),
        ShapeKind.ELLIPSOID: records.ellipsoids(placed, origin),
    }


def _mesh_extents(every: World, key: Hashable) -> Meshes:
    some = [mesh for mesh in every.meshes if len(mesh.vertices)]
    boxes = [np.concatenate([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]) for mesh in some]
    boxes += [each.box for each in every.standing]
    around = np.array(boxes).reshape(-1, 6)
    owners = [mesh.shape for mesh in some] + [each.used[1] for each in every.standing]
    return Meshes(key, around[:, :3], around[:, 3:], np.array(owners, np.uint32), counted(every.odd))


def _extents(
    analytic: dict[ShapeKind, tuple[np.ndarray, Bounds]], own: Meshes
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Boxes around all shapes, low and high (n, 3), which of the document they are (n,), and which are balls."""
    low = [*(bounds[0] for _, bounds in analytic.values()), own.low]
    high = [*(bounds[1] for _, bounds in analytic.values()), own.high]
    owners = [*(records["shape"] for records, _ in analytic.values()), own.owners]
    shapes = np.concatenate(owners)
    return np.concatenate(low), np.concatenate(high), shapes, np.arange(len(shapes)) < len(owners[0])
