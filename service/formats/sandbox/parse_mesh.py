"""Mesh files -> arrays that are finite, in range and of bounded size. Runs in the parsing process."""

from collections.abc import Callable

import numpy as np

from service.formats.errors import ParseError
from service.formats.formats import text
from service.formats.read.mesh_checks import mesh_oddities
from service.formats.read.raw_mesh import Numbers, RawMesh, check_raw_mesh, unit_colors, unit_normals
from service.formats.read.stl import read_stl
from service.formats.sandbox.parse_usd import read_usd_mesh
from service.formats.types import AssetLimits, Floats, Indices, MeshData


def parse_mesh(format: str, data: memoryview, limits: AssetLimits) -> MeshData:
    """Raises ParseError, or whatever a library raises on nonsense."""
    parts = READERS[format](data, limits)
    check_raw_mesh(parts, limits.max_triangles)
    # One after the other, so that a million triangles are not there twice.
    vertices = np.ascontiguousarray(parts.vertices, np.float64)
    faces: Indices = np.ascontiguousarray(parts.faces, np.int32)
    parts.vertices, parts.faces = vertices, faces
    normals = None if parts.normals is None else unit_normals(vertices, faces, parts.normals)
    parts.normals = None
    groups = None if parts.groups is None or normals is not None else np.ascontiguousarray(parts.groups, np.int32)
    uvs, uvs_1 = _floats(parts.uvs), _floats(parts.uvs_1)
    tangents = _floats(parts.tangents)
    parts.uvs = parts.uvs_1 = parts.tangents = None
    colors = None if parts.colors is None else unit_colors(parts.colors, parts.warnings)
    odd = mesh_oddities(vertices, faces, uvs, colors)
    return MeshData(vertices, faces, normals, uvs, uvs_1, colors, tuple(parts.warnings), tangents, groups, odd)


def _floats(rows: Numbers | None) -> Floats | None:
    return None if rows is None else np.ascontiguousarray(rows, np.float32)


def _obj(data: memoryview, limits: AssetLimits) -> RawMesh:
    from service.formats.read.obj_mesh import read_obj

    return read_obj(text(bytes(data)) if bytes(data[:1]) in (b"\xef", b"\xfe", b"\xff") else data)


def _ply(data: memoryview, limits: AssetLimits) -> RawMesh:
    from service.formats.read.ply import read_ply

    return read_ply(data)


def _gltf(data: memoryview, limits: AssetLimits) -> RawMesh:
    from service.formats.read.gltf.merged_mesh import read_merged

    return read_merged(data, limits)


def _mtlx(data: memoryview, limits: AssetLimits) -> RawMesh:
    raise ParseError("it holds materials; a mesh or an image is needed here")


def _zip(data: memoryview, limits: AssetLimits) -> RawMesh:
    from service.formats.read.obj.importer import read_zipped_obj

    return read_zipped_obj(data, limits)


READERS: dict[str, Callable[[memoryview, AssetLimits], RawMesh]] = {
    "obj": _obj,
    "ply": _ply,
    "stl": read_stl,
    "glb": _gltf,
    "gltf": _gltf,
    "zip": _zip,
    "mtlx": _mtlx,
    "usd": read_usd_mesh,
}
