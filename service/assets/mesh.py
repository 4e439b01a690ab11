"""Mesh files -> arrays that the rest may trust: finite, in range, bounded. Runs in the parsing child."""

import io
import re
import warnings
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from service.assets.data import AssetLimits, Doubles, Floats, Indices, MeshData
from service.assets.errors import ParseError

MAX_COORDINATE = 1e9  # metres; the contract's range of a coordinate


def parse_mesh(format: str, data: bytes, limits: AssetLimits) -> MeshData:
    """Raises ParseError, or whatever a library raises on nonsense."""
    vertices, faces, normals = READERS[format](data, limits)
    if not len(faces):
        raise ParseError("it has no faces")
    if len(faces) > limits.max_triangles:
        raise ParseError(f"{len(faces)} triangles are more than the {limits.max_triangles} allowed")
    if not np.isfinite(vertices).all():
        bad = int(np.flatnonzero(~np.isfinite(vertices).all(axis=1))[0])
        raise ParseError(f"vertex {bad} (counted from 0) is not finite: {vertices[bad].tolist()}")
    if np.abs(vertices).max() > MAX_COORDINATE:
        bad = int(np.flatnonzero((np.abs(vertices) > MAX_COORDINATE).any(axis=1))[0])
        raise ParseError(f"vertex {bad} (counted from 0) lies beyond 1e9 m: {vertices[bad].tolist()}")
    if faces.min() < 0 or faces.max() >= len(vertices):
        bad = int(np.flatnonzero(((faces < 0) | (faces >= len(vertices))).any(axis=1))[0])
        raise ParseError(
            f"triangle {bad} (counted from 0) names vertices {faces[bad].tolist()}; there are {len(vertices)}"
        )
    vertices = np.ascontiguousarray(vertices, np.float64)
    indices: Indices = np.ascontiguousarray(faces, np.int32)
    return MeshData(vertices, indices, None if normals is None else unit_normals(vertices, indices, normals))


def unit_normals(vertices: Doubles, faces: Indices, normals: npt.NDArray[np.floating]) -> Floats:
    """The file's normals at unit length; one of length zero (a vertex without any) comes from its triangles."""
    if not np.isfinite(normals).all():
        bad = int(np.flatnonzero(~np.isfinite(normals).all(axis=1))[0])
        raise ParseError(f"the normal of vertex {bad} (counted from 0) is not finite")
    normals = normals.astype(np.float64)
    if (~normals.any(axis=1)).any():
        missing = ~normals.any(axis=1)
        normals[missing] = _area_weighted(vertices, faces)[missing]
    length = np.abs(normals).max(axis=1, keepdims=True)  # first, or a normal of 1e200 squares to infinity
    normals /= np.where(length > 0, length, 1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 0, normals / np.where(length > 0, length, 1), (0.0, 1.0, 0.0))
    return np.ascontiguousarray(normals, np.float32)


def _area_weighted(vertices: Doubles, faces: Indices) -> Doubles:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    weighted = np.cross(b - a, c - a)
    sums = [sum(np.bincount(faces[:, k], weighted[:, axis], len(vertices)) for k in range(3)) for axis in range(3)]
    return np.stack(sums, axis=1)


Parts = tuple[Doubles, npt.NDArray[np.integer], npt.NDArray[np.floating] | None]


def _obj(data: bytes, limits: AssetLimits) -> Parts:
    from service.assets.obj import read_obj

    return read_obj(data)


def _ply(data: bytes, limits: AssetLimits) -> Parts:
    from service.assets.ply import read_ply

    return read_ply(data)


def _gltf(data: bytes, limits: AssetLimits) -> Parts:
    from service.assets.gltf import read_gltf

    return read_gltf(data, limits)


def _stl(data: bytes, limits: AssetLimits) -> Parts:
    """Through trimesh, whose text reader stops in silence where a number or an `endsolid` is missing: we count."""
    from trimesh.exchange.stl import load_stl

    promised = int.from_bytes(data[80:84], "little")
    if len(data) < 84 or len(data) != 84 + 50 * promised:
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
    return vertices, np.arange(len(vertices)).reshape(-1, 3), None


READERS: dict[str, Callable[[bytes, AssetLimits], Parts]] = {
    "obj": _obj,
    "ply": _ply,
    "stl": _stl,
    "glb": _gltf,
    "gltf": _gltf,
}
