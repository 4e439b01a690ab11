"""The document's shapes -> shapes in the world."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from service.assets import Assets, MeshData
from service.assets.oddities import oddities
from service.pack import meshes
from service.pack.meshes import Chart, PlacedMesh
from service.pack.placed import Placed, check_reach
from service.pack.textures import Reads
from service.problems import AssetError, FieldError, InvalidDocument
from service.scene.shape import BoxShape, MeshShape, QuadShape, Shape, SphereShape

MOST_ODD = 20  # warnings: a model of a thousand parts may have them all


def place(
    shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str], assets: Assets, max_triangles: int,
    reads: Mapping[str, Reads], known_meshes: bool = False,
) -> tuple[Placed, list[PlacedMesh], list[str]]:  # fmt: skip
    """(analytic shapes, meshes, what is odd about them) in the world; `names` and `emissive` are materials, `reads`
    what these read of them. With `known_meshes` these are left out.

    Raises InvalidDocument.
    """
    materials = {name: i for i, name in enumerate(names)}
    placed, placed_meshes, odd, count = Placed(), [], list[str](), 0
    for i, shape in enumerate(shapes):
        matrix = None if shape.transform is None else shape.transform.matrix4()
        used = materials[shape.material], i
        read = reads.get(shape.material, Reads())
        if 1 in read.uv_sets and not isinstance(shape, MeshShape):
            raise _uncharted(i, "material", shape.material, f"uv set 1; a {shape.type} has set 0 only")
        match shape:
            case SphereShape():
                placed.sphere(shape.center, shape.radius, matrix, used)
            case QuadShape():
                placed.quad(shape.origin, shape.u, shape.v, matrix, used)
            case BoxShape():
                placed.box(shape.min, shape.max, matrix, used, shape.material in emissive)
            case MeshShape() if not known_meshes:
                data = _data(shape, i, assets)
                odd += [f"/shapes/{i}: {warning}" for warning in data.warnings]
                mesh = _mesh(shape, data, matrix, used, max_triangles - count, read)
                count += len(mesh.faces)
                placed_meshes.append(mesh)
    if len(odd) > MOST_ODD:
        odd[MOST_ODD:] = [f"and {len(odd) - MOST_ODD} more like these"]
    return placed, placed_meshes, odd


def _mesh(
    shape: MeshShape, data: MeshData, matrix: np.ndarray | None, used: tuple[int, int], room: int,
    read: Reads,
) -> PlacedMesh:  # fmt: skip
    if len(data.faces) > room:
        detail = f"has {len(data.faces)} triangles; this server has room for {room} more in a scene"
        raise InvalidDocument([FieldError(f"/shapes/{used[1]}", detail)])
    for number, uvs in ((0, data.uvs), (1, data.uvs_1)):
        if number in read.uv_sets and uvs is None:
            field = "uvs" if shape.asset is None and number == 0 else "material" if shape.asset is None else "asset"
            raise _uncharted(used[1], field, shape.material, f"uv set {number}, which this mesh does not have")
    mesh = meshes.place(
        data.vertices, data.faces, data.normals, shape.smooth, matrix, not shape.double_sided, used,
        data.uvs if read.uv_sets else None, data.uvs_1 if 1 in read.uv_sets else None,
        None if data.colors is None or (data.colors == 1).all() else data.colors,
        None if read.tangents is None else Chart(data.uvs_1 if read.tangents else data.uvs, data.tangents),
    )  # fmt: skip
    if matrix is not None:
        check_reach(used[1], float(np.abs(mesh.vertices).max(initial=0.0)))
    return mesh


def _data(shape: MeshShape, number: int, assets: Assets) -> MeshData:
    if shape.asset is None:
        assert shape.vertices is not None and shape.faces is not None
        odd = tuple(oddities(shape.vertices, shape.faces))
        return MeshData(shape.vertices, shape.faces, shape.normals, shape.uvs, None, shape.colors, odd)
    try:
        return assets.mesh(shape.asset)
    except AssetError as error:
        raise InvalidDocument([FieldError(f"/shapes/{number}/asset", error.detail)]) from None


def _uncharted(shape: int, field: str, material: str, what: str) -> InvalidDocument:
    return InvalidDocument([FieldError(f"/shapes/{shape}/{field}", f"material {material[:80]!r} reads {what}")])
