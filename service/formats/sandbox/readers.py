"""Files -> what the rest may trust, in the parsing process. Meshes are arrays that are finite, in range and of
bounded size; a zip is what is in it; USD is read where its extra is installed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from service.formats.errors import ParseError
from service.formats.formats import FOREIGN, text
from service.formats.read.bad_elements import mend
from service.formats.read.materialx.importer import ALONE, read_materialx
from service.formats.read.mesh_checks import mesh_oddities
from service.formats.read.raw_mesh import Numbers, RawMesh, unit_colors, unit_normals
from service.formats.read.references import Finder
from service.formats.read.stl import read_stl
from service.formats.read.zips.contents import START_OF_ZIP
from service.formats.read.zips.importer import read_zip, read_zip_as_mesh, usd_importer
from service.formats.types import AssetLimits, Floats, Indices, MeshData, Pose, SceneFile


def parse_mesh(format: str, data: memoryview, limits: AssetLimits) -> MeshData:
    """Raises ParseError, or whatever a library raises on nonsense."""
    parts = MESH_READERS[format](data, limits)
    mend(parts, limits.max_triangles)
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


def read_usd_scene(data: memoryview, limits: AssetLimits, pose: Pose | None = None) -> SceneFile:
    """A layer, or a zip that begins with one. Raises ParseError, MissingExtra."""
    if bytes(data[:4]) == START_OF_ZIP:
        return read_zip(data, limits, pose)
    found: SceneFile = usd_importer().read_scene(data, limits)
    return found


def read_usd_mesh(data: memoryview, limits: AssetLimits) -> RawMesh:
    """Raises ParseError, MissingExtra."""
    if bytes(data[:4]) == START_OF_ZIP:
        return read_zip_as_mesh(data, limits)
    found: RawMesh = usd_importer().read_merged(data, limits)
    return found


def parse_mtlx(data: memoryview, limits: AssetLimits) -> SceneFile:
    """A `.mtlx` file that came without images. Raises ParseError."""
    return read_materialx([ALONE], Finder([ALONE]), lambda name: bytes(data), limits)


def _foreign(format: str) -> Callable[[memoryview, AssetLimits], RawMesh]:
    def read(data: memoryview, limits: AssetLimits) -> RawMesh:
        from service.formats.read.foreign.importer import read_foreign_mesh

        return read_foreign_mesh(format, data, limits)

    return read


MESH_READERS: dict[str, Callable[[memoryview, AssetLimits], RawMesh]] = {
    "obj": _obj,
    "ply": _ply,
    "stl": read_stl,
    "glb": _gltf,
    "gltf": _gltf,
    "zip": read_zip_as_mesh,
    "mtlx": _mtlx,
    "usd": read_usd_mesh,
    **{format: _foreign(format) for format in FOREIGN},
}
