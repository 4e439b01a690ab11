"""The document's shapes -> shapes in world space."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gpu import SceneTooLarge
from service.document.numbers import LARGEST
from service.document.shape import MeshShape, Shape
from service.formats import Assets, MeshData, MeshOddities
from service.formats.read.mesh_checks import mesh_oddities
from service.pack.geometry import instances, meshes
from service.pack.geometry.analytic import AnalyticShapes, check_reach
from service.pack.geometry.displacement import Displacement, displaced
from service.pack.geometry.instances import Instance, MeshRequest, SharedMesh, blank, shared_mesh
from service.pack.geometry.meshes import Chart, PlacedMesh
from service.pack.geometry.shape_kinds import KINDS
from service.pack.geometry.warnings import OddMesh
from service.pack.textures.heights import HeightField
from service.pack.textures.uses import RequiredCharts
from service.problems import AssetError, FieldError, InvalidDocument
from service.system.memory import takes

WITHOUT = "; an image or a checker needs none with mapping 'box' or 'sphere'"
BYTES_PER_TRIANGLE = 220  # while it is packed; 150 were measured for flat ones, 180 with normals, 216 with tangents


@dataclass(frozen=True)
class ShapeMaterials:
    """The properties of the materials on which the shapes depend."""

    names: Sequence[str]  # in order
    emissive: Collection[str] = frozenset()  # those that shine
    charts: Mapping[str, RequiredCharts] = field(default_factory=dict)  # the charts that they need of shapes
    heights: Mapping[str, HeightField] = field(default_factory=dict)  # those that move meshes


@dataclass
class World:
    """The shapes of a scene in the world."""

    analytic: AnalyticShapes = field(default_factory=AnalyticShapes)
    meshes: list[PlacedMesh] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)  # meshes that share their triangles
    mesh_warnings: list[tuple[int, str]] = field(default_factory=list)  # each with its shape's number
    odd: list[OddMesh] = field(default_factory=list)

    @property
    def models(self) -> list[SharedMesh]:
        return list({id(each.model): each.model for each in self.instances}.values())


def place(
    shapes: Sequence[Shape], materials: ShapeMaterials, assets: Assets, max_triangles: int,
    known: Mapping[Hashable, SharedMesh] | None = None, apart: bool = False,
) -> World:  # fmt: skip
    """All shapes in world space. `known` are shared meshes that need not be made again; with `apart` large meshes get
    trees of their own.

    Raises InvalidDocument.
    """
    out = World(place_analytic(shapes, materials))
    numbers, files = {name: i for i, name in enumerate(materials.names)}, dict[str, MeshData]()
    wanted = list[MeshRequest]()
    for i, shape in enumerate(shapes):
        if isinstance(shape, MeshShape):
            data = _data(shape, i, assets, files)
            out.mesh_warnings += [(i, warning) for warning in data.warnings]
            read = materials.charts.get(shape.material, RequiredCharts())
            _check_charts(i, shape, data, read.uv_sets)
            used, matrix = (numbers[shape.material], i), _matrix(shape)
            if data.oddities != MeshOddities():
                is_smoothed = data.normals is None and bool(np.any(_smooth(shape, data)))
                out.odd.append(OddMesh(i, used[0], data.oddities, is_smoothed, shape.double_sided))
            request = MeshRequest(shape, data, matrix, used, read, shape.material in materials.emissive)
            if shape.displacement:
                made = sum(len(other.data.faces) for other in wanted if other.is_displaced)
                request = _displaced(request, materials, max_triangles - made, out)
            wanted.append(request)
    shown, room = _instances(wanted, known or {}, apart, max_triangles)
    for each, instance in zip(wanted, shown, strict=True):
        if instance is not None:
            _check_reach(instance, each)
            out.instances.append(instance)
            continue
        _check_room(each, room)
        room -= len(each.data.faces)
        _take(max_triangles - room)
        out.meshes.append(_mesh(each, each.matrix))
        if each.matrix is not None:
            check_reach(each.used[1], float(np.abs(out.meshes[-1].vertices).max(initial=0.0)))
    return out


def _instances(
    wanted: Sequence[MeshRequest], known: Mapping[Hashable, SharedMesh], apart: bool, room: int
) -> tuple[list[Instance | None], int]:
    """Each mesh as an instance, or None where its triangles are its own; and the number of these that there is room
    for."""
    out: list[Instance | None] = [None] * len(wanted)
    most = room
    groups = dict[Hashable, list[int]]()
    for i, key in enumerate(instances.keys(wanted, apart)):
        if key is not None:
            groups.setdefault(key, []).append(i)
    for key, group in groups.items():
        first = wanted[group[0]]
        _check_room(first, room)
        left = room - len(first.data.faces)
        if key not in known:
            _take(most - left)
        shared = known.get(key) or _model(key, first)
        if shared is None:
            continue
        room = left
        matrices = np.array([np.eye(4) if wanted[i].matrix is None else wanted[i].matrix for i in group])
        fitting = instances.place(shared, matrices, [wanted[i].used for i in group])
        for i, instance in zip(group, fitting, strict=True):
            out[i] = instance
    return out, room


def place_analytic(shapes: Sequence[Shape], materials: ShapeMaterials) -> AnalyticShapes:
    """All shapes but meshes. Raises InvalidDocument."""
    numbers, placed = {name: i for i, name in enumerate(materials.names)}, AnalyticShapes()
    for i, shape in enumerate(shapes):
        if isinstance(shape, MeshShape):
            continue
        matrix, used = _matrix(shape), (numbers[shape.material], i)
        if 1 in materials.charts.get(shape.material, RequiredCharts()).uv_sets:
            raise _uncharted(i, "material", shape.material, f"uv set 1; a {shape.type} has set 0 only{WITHOUT}")
        KINDS[type(shape)].place(placed, shape, matrix, used, shape.material in materials.emissive)
    return placed


def _matrix(shape: Shape) -> np.ndarray | None:
    return None if shape.transform is None else shape.transform.matrix4()


def _mesh(each: MeshRequest, matrix: np.ndarray | None) -> PlacedMesh:
    data, shape, read = each.data, each.shape, each.read
    smooth = each.is_displaced or _smooth(shape, data)
    return meshes.place(
        data.vertices, data.faces, data.normals, smooth, matrix, not shape.double_sided, each.used,
        data.uvs if read.uv_sets else None, data.uvs_1 if 1 in read.uv_sets else None,
        None if data.colors is None or (data.colors == 1).all() else data.colors,
        None if read.tangents is None else Chart(data.uvs_1 if read.tangents else data.uvs, data.tangents),
    )  # fmt: skip


def _displaced(each: MeshRequest, materials: ShapeMaterials, room: int, out: World) -> MeshRequest:
    """The mesh as its material's height moves it. Raises InvalidDocument."""
    field = materials.heights.get(each.shape.material)
    if field is None:
        detail = f"displacement: material {each.shape.material[:80]!r} has no height, so nothing is displaced"
        out.mesh_warnings.append((each.used[1], detail))
        return each
    _check_room(each, room)
    axes = np.eye(3) if each.matrix is None else each.matrix[:3, :3]
    by = Displacement(field, each.shape.max_edge, axes, each.used[1])
    return replace(each, data=displaced(each.data, _smooth(each.shape, each.data), by, room), is_displaced=True)


def _smooth(shape: MeshShape, data: MeshData) -> np.ndarray | bool:
    """The document's value, or else the file's."""
    return data.smoothing if shape.smooth is None else shape.smooth


def _model(key: Hashable, each: MeshRequest) -> SharedMesh | None:
    try:
        return shared_mesh(key, blank(_mesh(each, None)))
    except SceneTooLarge as error:
        raise InvalidDocument([FieldError(f"/shapes/{each.used[1]}", str(error))]) from None


def _take(count: int) -> None:
    """Say that so many triangles are about to be made in all."""
    takes("triangles", BYTES_PER_TRIANGLE * count)


def _check_room(each: MeshRequest, room: int) -> None:
    if len(each.data.faces) > room:
        room_left = f"this server has room for {room} more in a scene (SUNBOX_MAX_TRIANGLES)"
        detail = f"has {len(each.data.faces)} triangles; {room_left}"
        raise InvalidDocument([FieldError(f"/shapes/{each.used[1]}", detail)])


def _check_reach(instance: Instance, each: MeshRequest) -> None:
    """Check an instance's reach, by the boxes of its parts where they suffice."""
    reach = float(np.abs(instance.box).max())
    if reach > LARGEST:
        matrix = np.eye(4) if each.matrix is None else each.matrix
        reach = float(np.abs(each.data.vertices @ matrix[:3, :3].T + matrix[:3, 3]).max())
        check_reach(each.used[1], reach)


def _check_charts(number: int, shape: MeshShape, data: MeshData, sets: frozenset[int]) -> None:
    for which, uvs in ((0, data.uvs), (1, data.uvs_1)):
        if which in sets and uvs is None:
            field = "uvs" if shape.asset is None and which == 0 else "material" if shape.asset is None else "asset"
            raise _uncharted(number, field, shape.material, f"uv set {which}, which this mesh does not have{WITHOUT}")


def _data(shape: MeshShape, number: int, assets: Assets, files: dict[str, MeshData]) -> MeshData:
    if shape.asset is None:
        assert shape.vertices is not None and shape.faces is not None
        odd = mesh_oddities(shape.vertices, shape.faces, shape.uvs, shape.colors)
        return MeshData(shape.vertices, shape.faces, shape.normals, shape.uvs, None, shape.colors, oddities=odd)
    try:
        if shape.asset not in files:
            files[shape.asset] = assets.mesh(shape.asset)
        return files[shape.asset]
    except AssetError as error:
        raise InvalidDocument([FieldError(f"/shapes/{number}/asset", error.detail)]) from None


def triangles(shape: MeshShape, assets: Assets) -> int:
    """The number of its triangles; 0 for a file that cannot be read, which is reported when it is packed."""
    try:
        return len(_data(shape, 0, assets, {}).faces)
    except InvalidDocument:
        return 0


def _uncharted(shape: int, field: str, material: str, what: str) -> InvalidDocument:
    return InvalidDocument([FieldError(f"/shapes/{shape}/{field}", f"material {material[:80]!r} reads {what}")])
