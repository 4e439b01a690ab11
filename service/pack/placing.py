"""The document's shapes -> shapes in the world."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from service.assets import Assets
from service.pack import meshes
from service.pack.meshes import PlacedMesh
from service.pack.placed import Placed, check_reach
from service.problems import AssetError, FieldError, InvalidDocument
from service.scene.shape import BoxShape, MeshShape, QuadShape, Shape, SphereShape


def place(
    shapes: Sequence[Shape], names: Sequence[str], emissive: Collection[str], assets: Assets, max_triangles: int
) -> tuple[Placed, list[PlacedMesh]]:
    """(analytic shapes, meshes) in the world; `names` and `emissive` are materials. Raises InvalidDocument."""
    materials = {name: i for i, name in enumerate(names)}
    placed, placed_meshes, count = Placed(), [], 0
    for i, shape in enumerate(shapes):
        matrix = None if shape.transform is None else shape.transform.matrix4()
        used = materials[shape.material], i
        match shape:
            case SphereShape():
                placed.sphere(shape.center, shape.radius, matrix, used)
            case QuadShape():
                placed.quad(shape.origin, shape.u, shape.v, matrix, used)
            case BoxShape():
                placed.box(shape.min, shape.max, matrix, used, shape.material in emissive)
            case MeshShape():
                mesh = _mesh(shape, matrix, used, assets, max_triangles - count)
                count += len(mesh.faces)
                placed_meshes.append(mesh)
    return placed, placed_meshes


def _mesh(
    shape: MeshShape, matrix: np.ndarray | None, used: tuple[int, int], assets: Assets, room: int
) -> PlacedMesh:
    if shape.asset is None:
        assert shape.vertices is not None and shape.faces is not None
        vertices, faces, normals = shape.vertices, shape.faces, shape.normals
    else:
        try:
            data = assets.mesh(shape.asset)
        except AssetError as error:
            raise InvalidDocument([FieldError(f"/shapes/{used[1]}/asset", error.detail)]) from None
        vertices, faces, normals = data.vertices, data.faces, data.normals
    if len(faces) > room:
        detail = f"has {len(faces)} triangles; this server has room for {room} more in a scene"
        raise InvalidDocument([FieldError(f"/shapes/{used[1]}", detail)])
    mesh = meshes.place(vertices, faces, normals, shape.smooth, matrix, not shape.double_sided, used)
    if matrix is not None:
        check_reach(used[1], float(np.abs(mesh.vertices).max(initial=0.0)))
    return mesh
