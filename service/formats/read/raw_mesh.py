"""A mesh as its reader found it, before anybody may trust it."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from service.formats.types import Doubles, Floats, Indices

MAX_COORDINATE = 1e9  # metres; the contract's range of a coordinate
ROUNDING = 1e-6  # by which lengths of unit vectors in single precision differ from 1
Numbers = npt.NDArray[np.floating]


@dataclass
class RawMesh:
    """Rows as the file has them; `faces` may be of any integer type, the others of any floating one."""

    vertices: Numbers  # (n, 3)
    faces: npt.NDArray[np.integer]  # (m, 3)
    normals: Numbers | None = None  # (n, 3), of any length; zero: to be computed
    uvs: Numbers | None = None  # (n, 2), v pointing up
    uvs_1: Numbers | None = None
    colors: Numbers | None = None  # (n, 3 or 4), linear
    warnings: list[str] = field(default_factory=list)
    tangents: Numbers | None = None  # (n, 4), as glTF's TANGENT; zero: none
    groups: npt.NDArray[np.integer] | None = None  # (m,) smoothing groups, 0 for facets; None: one for all


def unit_normals(vertices: Doubles, faces: Indices, normals: Numbers) -> Floats:
    """The file's normals at unit length; one of length zero (a vertex without any) comes from its triangles.

    One of unit length already stays as it is: dividing it again would change its last bit whenever a mesh is written
    and read."""
    missing = ~normals.any(axis=1)
    if missing.any():
        normals = normals.astype(np.float64)
        normals[missing] = area_weighted(vertices, faces)[missing]
    with np.errstate(over="ignore"):
        given, is_unit = normals, np.abs(np.linalg.norm(normals.astype(np.float64), axis=1) - 1) < ROUNDING
    length = np.abs(normals).max(axis=1, keepdims=True)  # first, or a normal of 1e200 squares to infinity
    normals = normals / np.where(length > 0, length, 1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 0, normals / np.where(length > 0, length, 1), (0.0, 1.0, 0.0))
    normals = np.where(is_unit[:, None], given, normals)
    return np.ascontiguousarray(normals, np.float32)


def unit_colors(colors: Numbers, warnings: list[str]) -> Floats:
    """Red, green, blue and perhaps alpha within 0 and 1, which the contract asks of an albedo."""
    beyond = int(np.count_nonzero(((colors < 0) | (colors > 1)).any(axis=1)))
    if beyond:
        warnings.append(f"the colours of {beyond} vertices were clamped to 0..1")
    return np.ascontiguousarray(np.clip(colors, 0, 1), np.float32)


def area_weighted(vertices: Doubles, faces: Indices) -> Doubles:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    weighted = np.cross(b - a, c - a)
    sums = [sum(np.bincount(faces[:, k], weighted[:, axis], len(vertices)) for k in range(3)) for axis in range(3)]
    return np.stack(sums, axis=1)
