"""Meshes whose triangles several shapes share, each with a tree of its own; the choice of these, and the records of
the shapes that show them.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gpu import layout
from gpu.arrays import SHAREABLE
from gpu.layout import ShapeKind
from service.document.numbers import Vec3
from service.document.shape import MeshShape
from service.formats import MeshData
from service.pack.geometry.meshes import PlacedMesh, Triangles, survey
from service.pack.textures.uses import RequiredCharts
from service.problems import FieldError, InvalidDocument

LEAST = SHAREABLE  # triangles of a mesh
WORTH = 1 << 17  # triangles that sharing must save a scene: 26 MB, in exchange for slower walks through two levels
# Bounds on transforms whose inverse float32 represents well enough: on lengths, and on the factors of both maps.
SCALES = 1e-9, 1e9
TWIST = 32.0
# Twice the area of a triangle in the world, so that its square stays inside float32.
AREAS = 1e-18, 1e18

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
        present = {name: values for name, values in corners.items() if self.has(name)}
        bits = self.any_smooth, self.any_tangents
        return replace(self, source=WrittenTriangles(triangles, normals if any(bits) else None, *bits, present))


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


@dataclass(frozen=True)
class MeshRequest:
    """A mesh of the document before it is decided whether it shares its triangles."""

    shape: MeshShape
    data: MeshData
    matrix: np.ndarray | None
    used: tuple[int, int]  # material, shape
    read: RequiredCharts  # by its material
    shines: bool
    is_displaced: bool = False  # `data` has moved already, and has the normals to show


@dataclass(frozen=True)
class Instance:
    """A shape that shows a model: world = axes (model) + center, float64; `box` (6,) is around it there."""

    model: SharedMesh
    used: tuple[int, int]
    axes: np.ndarray
    center: np.ndarray
    box: np.ndarray


def keys(wanted: Sequence[MeshRequest], apart: bool = False) -> list[Hashable | None]:
    """A key of each mesh, equal where its triangles are; None where they become the scene's own, because no other
    shape shares them or sharing saves too little. With `apart` all meshes that are large enough are instances.
    """
    digests = dict[int, Hashable]()
    sized = [
        None if each.shines or each.is_displaced or len(each.data.faces) < LEAST else _size(each) for each in wanted
    ]
    many = Counter(sized)
    found: list[Hashable | None] = [
        None if size is None or (many[size] < 2 and not apart) else (*size, _content(each, digests))
        for each, size in zip(wanted, sized, strict=True)
    ]
    if apart:
        return found
    many_of, first = Counter(found), dict(zip(found, wanted, strict=True))
    shared = {key for key, count in many_of.items() if key is not None and count > 1}
    spared = sum((many_of[key] - 1) * len(first[key].data.faces) for key in shared)
    return [key if spared >= WORTH and key in shared else None for key in found]


def _size(each: MeshRequest) -> tuple[Hashable, ...]:
    """The part of that key that is quickly found."""
    shape = each.shape
    same = shape.asset, shape.smooth, shape.double_sided, bool(each.read.uv_sets), 1 in each.read.uv_sets
    return *same, each.read.tangents, len(each.data.vertices), len(each.data.faces)


def _content(each: MeshRequest, digests: dict[int, Hashable]) -> Hashable:
    shape = each.shape
    if shape.asset is not None:
        return None
    if id(shape) not in digests:
        arrays = (shape.vertices, shape.faces, shape.normals, shape.uvs, shape.colors)
        whole = hashlib.blake2b(digest_size=16)
        for array in arrays:
            whole.update(b"-" if array is None else np.ascontiguousarray(array).data)
        digests[id(shape)] = whole.digest()
    return digests[id(shape)]


def place(model: SharedMesh, matrices: np.ndarray, used: Sequence[tuple[int, int]]) -> list[Instance | None]:
    """Instances of the model under these transforms (n, 4, 4); None where float32 cannot map a ray there and back."""
    axes = matrices[:, :3, :3]
    lengths = np.linalg.svd(axes, compute_uv=False)
    least, greatest = model.least * lengths[:, 1] * lengths[:, 2], model.greatest * lengths[:, 0] * lengths[:, 1]
    fits = (lengths[:, 2] > SCALES[0]) & (lengths[:, 0] < SCALES[1]) & (least > AREAS[0]) & (greatest < AREAS[1])
    twist = np.abs(axes) @ np.abs(np.linalg.inv(np.where(fits[:, None, None], axes, np.eye(3))))
    fits &= twist.sum(axis=2).max(axis=1) < TWIST
    centers = axes @ model.center + matrices[:, :3, 3]
    low, high = model.parts[:, :3], model.parts[:, 3:]
    middle = (low + high) / 2 @ axes.transpose(0, 2, 1) + centers[:, None]
    half = (high - low) / 2 @ np.abs(axes).transpose(0, 2, 1)
    boxes = np.concatenate([(middle - half).min(axis=1), (middle + half).max(axis=1)], axis=1)
    rows = zip(fits, used, axes, centers, boxes, strict=True)
    return [Instance(model, *row) if fit else None for fit, *row in rows]


def records(
    instances: Sequence[Instance], models: Sequence[SharedMesh], origin: np.ndarray, first: int
) -> np.ndarray:
    """`layout.Instance` of each; the models' triangles begin at `first`, in this order, and so do their nodes at 0.

    Raises InvalidDocument.
    """
    out = np.zeros(len(instances), layout.Instance.dtype)
    if not len(out):
        return out
    bits = shift(models)
    if len(out) << bits > MOST_SEEN:
        detail = f"show {len(out)} instances of up to {1 << bits} triangles; at most {MOST_SEEN + 1} in all"
        raise InvalidDocument([FieldError("/shapes", detail)])
    number = {id(model): i for i, model in enumerate(models)}
    which = np.array([number[id(each.model)] for each in instances])
    triangles = first + np.cumsum([0, *(model.count for model in models)])
    nodes = np.cumsum([0, *(len(model.nodes) for model in models)])
    axes, center = np.array([each.axes for each in instances]), np.array([each.center for each in instances])
    rows = np.linalg.inv(axes)
    out["row_x"], out["row_y"], out["row_z"] = rows[:, 0], rows[:, 1], rows[:, 2]
    out["axis_x"], out["axis_y"] = axes[:, :, 0], axes[:, :, 1]
    out["axis_z_x"], out["axis_z_y"], out["axis_z_z"] = axes[:, :, 2].T
    out["center"] = center - origin
    out["error"] = _errors(axes, rows, np.abs(center - origin), np.array([model.reach for model in models])[which])
    out["side"] = np.where(np.linalg.det(axes) < 0, -1.0, 1.0)
    out["material"], out["shape"] = np.array([each.used for each in instances], np.uint32).T
    out["first"], out["node_first"] = triangles[which], nodes[which]
    for name in ("node_count", "node_origin", "node_scale"):
        out[name] = np.array([getattr(model, name) for model in models])[which]
    return out


def _errors(axes: np.ndarray, rows: np.ndarray, away: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """(n, 3), in units of a rounding: the largest distance between a place on each model and the origin that a ray
    which begins there gets in the model's space. There are seven roundings on the way out, two more when the centre
    is added, and eight on the way back, as the float32 numbers of the two maps are not exactly inverse. `reach` (n,
    3) are the models' half extents.
    """
    far: np.ndarray = np.einsum("nij,nj->ni", np.abs(axes), reach)
    back = np.einsum("nij,njk,nk->ni", np.abs(axes), np.abs(rows), far)
    return np.asarray(7 * far + 2 * (far + away) + 8 * back)
