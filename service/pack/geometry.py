"""Shapes -> records, lights among them, and the tree: all that the camera, the sky and a colour leave as it is."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gpu import layout
from gpu.layout import Node, ShapeKind, Triangle, TriangleNormals
from service.assets import Assets
from service.pack import instances, lights, meshes, records
from service.pack.meshes import Triangles
from service.pack.models import Model
from service.pack.origin import choose
from service.pack.origin import warnings as lost
from service.pack.placed import Placed
from service.pack.placing import World, place, place_analytic
from service.pack.records import Bounds
from service.pack.textures import Reads
from service.pack.tree import LINEAR, plant, stand_out
from service.pack.values import vec3
from service.scene.numbers import Vec3
from service.scene.shape import Shape
from service.shared import LEAST, Shelf, trim

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
    models: tuple[Model, ...]  # that the instances show, in the order of their triangles
    origin: Vec3
    radius: float  # of a ball around everything; 1 where there is nothing
    meshes: Meshes
    warnings: tuple[str, ...]


def geometry(
    shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str], assets: Assets, max_triangles: int,
    reads: Mapping[str, Reads], key: Hashable = None, earlier: Geometry | None = None,
    known: Mapping[Hashable, Model] | None = None,
) -> Geometry:  # fmt: skip
    """`names`: the materials in order; `emissive`: those that shine; `reads`: what they read of their shapes;
    `key`: of the meshes, none of which shines, for `earlier`: a geometry of the same meshes, whose triangles and tree
    serve again where nothing else is in that tree; `known`: models of other geometries, which serve again.

    Raises InvalidDocument.
    """
    if earlier is not None:
        again = _among_other_shapes(earlier, shapes, names, emissive, reads)
        if again is not None:
            return again
    every = place(shapes, names, emissive, assets, max_triangles, reads, known)
    shared: Sequence[Model] = every.models
    analytic = _analytic(every.placed, np.zeros(3))
    own = _mesh_extents(every, key)
    low, high, owners, exact = _extents(analytic, own)
    origin, radius = choose(low, high)
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
        around = np.array([each.box() for each in every.standing]) - np.tile(origin, 2)
        bounds[ShapeKind.INSTANCE] = around[:, :3], around[:, 3:]
    nodes, node_origin, node_scale = np.zeros(0, Node.dtype), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    standing, order = dict[ShapeKind, np.ndarray](), dict[ShapeKind, np.ndarray]()
    node_count = 0
    if bounds:
        standing = stand_out(bounds)
        nodes, node_count, order, node_origin, node_scale = plant(bounds, standing)
    kinds, large = frozenset(bounds), {kind: len(places) for kind, places in standing.items()}
    if len(placed):  # triangles are met through trees, though perhaps not through the scene's
        placed = placed[order[ShapeKind.INSTANCE]]
        large.setdefault(ShapeKind.TRIANGLE, len(triangles))
        kinds |= {ShapeKind.TRIANGLE}
    del boxes, bounds
    if len(triangles) > MANY:
        trim()
    places = _inverse(order.get(ShapeKind.TRIANGLE))
    details, shared = _written(triangles, places, shared)
    shelf = Shelf(*(array.nbytes for array in (*found.values(), nodes, placed)))
    nodes, placed = shelf.put(nodes), shelf.put(placed)
    found = {kind: shelf.put(array, order.get(kind)) for kind, array in found.items()}
    found[ShapeKind.TRIANGLE] = details.triangles[: len(triangles)]
    _hide((*found.values(), placed), shapes)
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
        nodes, node_count, node_origin, node_scale, kinds, large, placed, details.nodes, tuple(shared),
        vec3(origin), radius, own, tuple(warnings),
    )  # fmt: skip


def _among_other_shapes(
    earlier: Geometry, shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str],
    reads: Mapping[str, Reads],
) -> Geometry | None:  # fmt: skip
    """The meshes of `earlier` with what else there is now; None where that touches them."""
    if earlier.bvh_kinds - {ShapeKind.TRIANGLE, ShapeKind.INSTANCE}:
        return None
    placed = place_analytic(shapes, names, emissive, reads)
    analytic = _analytic(placed, np.zeros(3))
    low, high, owners, exact = _extents(analytic, earlier.meshes)
    origin, radius = choose(low, high)
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


def _vanished(placed: Placed) -> list[str]:
    return [f"/shapes/{i}: too small to be traced, left out" for i in dict.fromkeys(placed.vanished)]


def _inverse(order: np.ndarray | None) -> np.ndarray | None:
    """Where each goes, of which goes where."""
    if order is None:
        return None
    places = np.empty(len(order), np.uint32)
    places[order] = np.arange(len(order), dtype=np.uint32)
    return places


def _degenerate(counts: Mapping[int, int]) -> tuple[str, ...]:
    return tuple(
        f"/shapes/{i}: {n} degenerate triangle{'s' if n > 1 else ''} skipped" for i, n in sorted(counts.items())
    )


@dataclass(frozen=True)
class _Details:
    """What triangles have, in final order, those of the models last, and the models' nodes."""

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


def _written(
    triangles: Triangles, places: np.ndarray | None, shared: Sequence[Model]
) -> tuple[_Details, tuple[Model, ...]]:
    """All of it on one shelf, which is what the models are kept on from now on."""
    own = len(triangles)
    count, node_count = own + sum(each.count for each in shared), sum(len(each.nodes) for each in shared)
    tangents = triangles.any_tangents or any(each.any_tangents for each in shared)
    smooth = count if tangents or triangles.any_smooth or any(each.any_smooth for each in shared) else 0
    shapes = {name: (count * _some_have(name, triangles, shared), 3, width) for name, width in CORNERS.items()}
    sizes = [int(np.prod(shape)) * _at_corner(name).itemsize for name, shape in shapes.items()]
    parts = count * Triangle.dtype.itemsize, smooth * TriangleNormals.dtype.itemsize, node_count * Node.dtype.itemsize
    shelf = Shelf(*parts, *sizes)
    out, normals = shelf.room((count,), Triangle.dtype), shelf.room((smooth,), TriangleNormals.dtype)
    nodes = shelf.room((node_count,), Node.dtype)
    corners = {name: shelf.room(shape, _at_corner(name)) for name, shape in shapes.items()}
    triangles.write(places, out[:own])
    if smooth:
        triangles.write_normals(places, normals[:own])
    for name, values in corners.items():
        if len(values):
            triangles.write_corners(name, places, values[:own])
    kept, node = list[Model](), 0
    for each in shared:
        part = slice(own, own + each.count)
        nodes[node : node + len(each.nodes)] = each.nodes
        at = nodes[node : node + len(each.nodes)]
        own, node = part.stop, node + len(at)
        written = each.write(out[part], normals[part], {name: values[part] for name, values in corners.items()})
        kept.append(replace(written, nodes=at))
    return _Details(out, normals, tangents, corners["uvs"], corners["uvs_1"], corners["colors"], nodes), tuple(kept)


CORNERS = {"uvs": 2, "uvs_1": 2, "colors": 4}  # what triangles have there: how many numbers


def _at_corner(name: str) -> np.dtype[Any]:
    return np.dtype(np.float16 if name == "colors" else np.float32)


def _some_have(name: str, triangles: Triangles, shared: Sequence[Model]) -> bool:
    return triangles.have(name) or any(each.has(name) for each in shared)


def _hide(records: Sequence[np.ndarray], shapes: Sequence[Shape]) -> None:
    """Marks the records of shapes that the camera looks through."""
    hidden = np.array([not shape.visible_to_camera for shape in shapes], bool)
    if hidden.any():
        for array in records:
            index = array["shape"] & np.uint32(~layout.SINGLE_SIDED & layout.NONE)
            array["shape"] |= np.where(hidden[index], layout.HIDDEN, 0).astype(np.uint32)


def _analytic(placed: Placed, origin: np.ndarray) -> dict[ShapeKind, tuple[np.ndarray, Bounds]]:
    return {
        ShapeKind.SPHERE: records.spheres(placed, origin),
        ShapeKind.QUAD: records.quads(placed, origin),
        ShapeKind.BOX: records.boxes(placed, origin),
        ShapeKind.ELLIPSOID: records.ellipsoids(placed, origin),
    }


def _mesh_extents(every: World, key: Hashable) -> Meshes:
    some = [mesh for mesh in every.meshes if len(mesh.vertices)]
    boxes = [np.concatenate([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]) for mesh in some]
    boxes += [each.box() for each in every.standing]
    around = np.array(boxes).reshape(-1, 6)
    owners = [mesh.shape for mesh in some] + [each.used[1] for each in every.standing]
    return Meshes(key, around[:, :3], around[:, 3:], np.array(owners, np.uint32), tuple(every.odd))


def _extents(
    analytic: dict[ShapeKind, tuple[np.ndarray, Bounds]], own: Meshes
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Boxes around all shapes, low and high (n, 3), which of the document they are (n,), and which are balls."""
    low = [*(bounds[0] for _, bounds in analytic.values()), own.low]
    high = [*(bounds[1] for _, bounds in analytic.values()), own.high]
    owners = [*(records["shape"] for records, _ in analytic.values()), own.owners]
    shapes = np.concatenate(owners)
    return np.concatenate(low), np.concatenate(high), shapes, np.arange(len(shapes)) < len(owners[0])
