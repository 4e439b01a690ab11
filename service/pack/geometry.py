"""Shapes -> records, lights among them, and the tree: all that the camera, the sky and a colour leave as it is."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gpu import layout
from gpu.layout import Node, ShapeKind, Triangle, TriangleNormals
from service.assets import Assets
from service.pack import lights, meshes, records
from service.pack.meshes import PlacedMesh, Triangles
from service.pack.origin import choose
from service.pack.origin import warnings as lost
from service.pack.placed import Placed
from service.pack.placing import place
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
    origin: Vec3
    radius: float  # of a ball around everything; 1 where there is nothing
    meshes: Meshes
    warnings: tuple[str, ...]


def geometry(
    shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str], assets: Assets, max_triangles: int,
    reads: Mapping[str, Reads], key: Hashable = None, earlier: Geometry | None = None,
) -> Geometry:  # fmt: skip
    """`names`: the materials in order; `emissive`: those that shine; `reads`: what they read of their
    shapes; `key`: of the meshes, none of which shines, for `earlier`: a geometry of the same meshes, whose triangles
    and tree serve again where nothing else is in that tree.

    Raises InvalidDocument.
    """
    if earlier is not None:
        again = _among_other_shapes(earlier, shapes, names, emissive, assets, max_triangles, reads)
        if again is not None:
            return again
    placed, placed_meshes, odd = place(shapes, names, emissive, assets, max_triangles, reads)
    analytic = _analytic(placed, np.zeros(3))
    own = _mesh_extents(placed_meshes, key, odd)
    low, high, owners, exact = _extents(analytic, own)
    origin, radius = choose(low, high)
    if origin.any():
        analytic = _analytic(placed, origin)
    records.only_vast(analytic[ShapeKind.SPHERE][0], low, high)
    triangles, boxes = meshes.survey(placed_meshes, origin)
    found = {kind: array for kind, (array, _) in analytic.items()}
    bounds = {kind: bounds for kind, (_, bounds) in analytic.items() if len(found[kind]) > LINEAR[kind]}
    if len(triangles) > LINEAR[ShapeKind.TRIANGLE]:
        bounds[ShapeKind.TRIANGLE] = boxes[:, :3], boxes[:, 3:]
    nodes, node_origin, node_scale = np.zeros(0, Node.dtype), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    standing, order = dict[ShapeKind, np.ndarray](), dict[ShapeKind, np.ndarray]()
    node_count = 0
    if bounds:
        standing = stand_out(bounds)
        nodes, node_count, order, node_origin, node_scale = plant(bounds, standing)
    kinds = frozenset(bounds)
    del boxes, bounds
    if len(triangles) > MANY:
        trim()
    count, smooth = len(triangles), len(triangles) if triangles.any_smooth or triangles.any_tangents else 0
    sizes = count * Triangle.dtype.itemsize, smooth * TriangleNormals.dtype.itemsize
    shelf = Shelf(*(array.nbytes for array in (*found.values(), nodes)), *sizes)
    nodes = shelf.put(nodes)
    found = {kind: shelf.put(array, order.get(kind)) for kind, array in found.items()}
    places = _inverse(order.get(ShapeKind.TRIANGLE))
    found[ShapeKind.TRIANGLE] = shelf.room((count,), Triangle.dtype)
    triangles.write(places, found[ShapeKind.TRIANGLE])
    normals = shelf.room((smooth,), TriangleNormals.dtype)
    if smooth:
        triangles.write_normals(places, normals)
    uvs, uvs_1, colors = (_at_corners(triangles, name, places) for name in ("uvs", "uvs_1", "colors"))
    _hide(found, shapes)
    shining = lights.mark(found, np.array([name in emissive for name in names]))
    areas = lights.areas(found, shining)
    counts = triangles.degenerate.items()
    flat = tuple(f"/shapes/{i}: {n} degenerate triangle{'s' if n > 1 else ''} skipped" for i, n in counts)
    own = replace(own, warnings=own.warnings + flat)
    warnings = [*own.warnings, *_vanished(placed), *lost(low, high, owners, exact, origin)]
    for array in (*found.values(), nodes, normals, uvs, uvs_1, colors):
        array.flags.writeable = array.nbytes < LEAST  # others may have it mapped
    if len(found[ShapeKind.TRIANGLE]) > MANY:
        trim()
    return Geometry(
        found, normals, triangles.any_tangents, uvs, uvs_1, colors, shining, areas, nodes, node_count,
        node_origin, node_scale, kinds, {kind: len(places) for kind, places in standing.items()},
        vec3(origin), radius, own, tuple(warnings),
    )  # fmt: skip


def _among_other_shapes(
    earlier: Geometry, shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str], assets: Assets,
    max_triangles: int, reads: Mapping[str, Reads],
) -> Geometry | None:  # fmt: skip
    """The meshes of `earlier` with what else there is now; None where that touches them."""
    if earlier.bvh_kinds - {ShapeKind.TRIANGLE}:
        return None
    placed, _, _ = place(shapes, names, emissive, assets, max_triangles, reads, known_meshes=True)
    analytic = _analytic(placed, np.zeros(3))
    low, high, owners, exact = _extents(analytic, earlier.meshes)
    origin, radius = choose(low, high)
    if vec3(origin) != earlier.origin or any(len(array) > LINEAR[kind] for kind, (array, _) in analytic.items()):
        return None
    if origin.any():
        analytic = _analytic(placed, origin)
    records.only_vast(analytic[ShapeKind.SPHERE][0], low, high)
    found = {kind: array for kind, (array, _) in analytic.items()}
    _hide(found, shapes)
    found[ShapeKind.TRIANGLE] = earlier.shapes[ShapeKind.TRIANGLE]
    shining = lights.mark(found, np.array([name in emissive for name in names]))
    warnings = [*earlier.meshes.warnings, *_vanished(placed), *lost(low, high, owners, exact, origin)]
    return replace(
        earlier, shapes=found, lights=shining, areas=lights.areas(found, shining), radius=radius,
        warnings=tuple(warnings),
    )  # fmt: skip


def _vanished(placed: Placed) -> list[str]:
    return [f"/shapes/{i}: too small to be traced, left out" for i in dict.fromkeys(placed.vanished)]


def _inverse(order: np.ndarray | None) -> np.ndarray | None:
    """Where each goes, of which goes where."""
    if order is None:
        return None
    places = np.empty(len(order), np.uint32)
    places[order] = np.arange(len(order), dtype=np.uint32)
    return places


def _at_corners(triangles: Triangles, name: str, places: np.ndarray | None) -> np.ndarray:
    """What triangles have at their corners, in final order: none where no mesh has it."""
    width, dtype = (4, np.dtype(np.float16)) if name == "colors" else (2, np.dtype(np.float32))
    shape = len(triangles) if triangles.have(name) else 0, 3, width
    out = Shelf(int(np.prod(shape)) * dtype.itemsize).room(shape, dtype)
    if len(out):
        triangles.write_corners(name, places, out)
    return out


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


def _mesh_extents(placed_meshes: list[PlacedMesh], key: Hashable, odd: list[str]) -> Meshes:
    some = [mesh for mesh in placed_meshes if len(mesh.vertices)]
    low, high = (np.array([end(mesh.vertices, axis=0) for mesh in some]).reshape(-1, 3) for end in (np.min, np.max))
    return Meshes(key, low, high, np.array([mesh.shape for mesh in some], np.uint32), tuple(odd))


def _extents(
    analytic: dict[ShapeKind, tuple[np.ndarray, Bounds]], own: Meshes
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Boxes around all shapes, low and high (n, 3), which of the document they are (n,), and which are balls."""
    low = [*(bounds[0] for _, bounds in analytic.values()), own.low]
    high = [*(bounds[1] for _, bounds in analytic.values()), own.high]
    owners = [*(records["shape"] for records, _ in analytic.values()), own.owners]
    shapes = np.concatenate(owners)
    return np.concatenate(low), np.concatenate(high), shapes, np.arange(len(shapes)) < len(owners[0])
