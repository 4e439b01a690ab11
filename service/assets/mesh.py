"""Mesh files -> arrays that the rest may trust: finite, in range, bounded. Runs in the parsing child."""

import io
import re
import warnings
from collections.abc import Callable

import numpy as np

from service.assets.data import AssetLimits, Floats, Indices, MeshData
from service.assets.errors import ParseError
from service.assets.oddities import oddities
from service.assets.parts import Numbers, Parts, check, unit_colors, unit_normals
from service.assets.sniff import text


def parse_mesh(format: str, data: memoryview, limits: AssetLimits) -> MeshData:
    """Raises ParseError, or whatever a library raises on nonsense."""
    parts = READERS[format](data, limits)
    check(parts, limits.max_triangles)
    # One after the other, so that a million triangles are not there twice.
    vertices = np.ascontiguousarray(parts.vertices, np.float64)
    faces: Indices = np.ascontiguousarray(parts.faces, np.int32)
    parts.vertices, parts.faces = vertices, faces
    normals = None if parts.normals is None else unit_normals(vertices, faces, parts.normals)
    parts.normals = None
    uvs, uvs_1 = _floats(parts.uvs), _floats(parts.uvs_1)
    tangents = _floats(parts.tangents)
    parts.uvs = parts.uvs_1 = parts.tangents = None
    parts.warnings += oddities(vertices, faces)
    colors = None if parts.colors is None else unit_colors(parts.colors, parts.warnings)
    return MeshData(vertices, faces, normals, uvs, uvs_1, colors, tuple(parts.warnings), tangents)


def _floats(rows: Numbers | None) -> Floats | None:
    return None if rows is None else np.ascontiguousarray(rows, np.float32)


def _obj(data: memoryview, limits: AssetLimits) -> Parts:
    from service.assets.obj import read_obj

    return read_obj(text(bytes(data)) if bytes(data[:1]) in (b"\xef", b"\xfe", b"\xff") else data)


def _ply(data: memoryview, limits: AssetLimits) -> Parts:
    from service.assets.ply import read_ply

    return read_ply(data)


def _gltf(data: memoryview, limits: AssetLimits) -> Parts:
    from service.assets.gltf.whole import read_whole

    return read_whole(data, limits)


def _stl(view: memoryview, limits: AssetLimits) -> Parts:
    """Through trimesh, whose text reader stops in silence where a number or an `endsolid` is missing: we count."""
    from trimesh.exchange.stl import load_stl

    data = bytes(view)
    promised = int.from_bytes(data[80:84], "little")
    if len(data) < 84 or len(data) != 84 + 50 * promised:
        data = text(data)
        if not re.match(rb"\s*+solid\b", data, re.IGNORECASE):
            raise ParseError(
                f"not an STL file: {len(data)} bytes; its header promises {84 + 50 * promised}, and it is no text"
            )
        promised = len(re.findall(rb"^\s*facet\b", data, re.IGNORECASE | re.MULTILINE))
        if not re.search(rb"^\s*endsolid\b[^\n]*\s*\Z", data[-65536:], re.IGNORECASE | re.MULTILINE):
            raise ParseError("the file is cut off: it does not end with `endsolid`")
        data = data.decode("utf-8", "replace").encode()  # a name in another encoding: trimesh would have to guess
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loaded = load_stl(io.BytesIO(data))
    solids = list(loaded["geometry"].values()) if "geometry" in loaded else [loaded]
    vertices = np.concatenate([solid["vertices"] for solid in solids] or [np.empty((0, 3))])
    if len(vertices) != 3 * promised:
        raise ParseError(f"{promised} facets were begun, {len(vertices) / 3:g} triangles can be read")
    return Parts(vertices, np.arange(len(vertices)).reshape(-1, 3))


READERS: dict[str, Callable[[memoryview, AssetLimits], Parts]] = {
    "obj": _obj,
    "ply": _ply,
    "stl": _stl,
    "glb": _gltf,
    "gltf": _gltf,
}
