"""Meshes -> triangles in the world, with their normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpu import layout
from service.pack.normals import corner_normals, encode

# Sine of an angle below which a triangle's area is rounding noise in float32, whatever its size.
FLAT = 4 * float(np.finfo(np.float32).eps)
SMALLEST = float(np.finfo(np.float32).tiny)


@dataclass(frozen=True)
class PlacedMesh:
    """Vertices in the world (n, 3) float64, faces (m, 3) counter-clockwise from outside.

    `normals` (k, 3) float64 in the world, some perhaps zero, met through `normal_faces` (m, 3); None: flat.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    normal_faces: np.ndarray
    single_sided: bool
    material: int
    shape: int
    uvs: np.ndarray | None = None  # (n, 2), as the vertices
    uvs_1: np.ndarray | None = None
    colors: np.ndarray | None = None  # (n, 3 or 4)


def place(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray | None, smooth: bool,
    matrix: np.ndarray | None, single_sided: bool, used: tuple[int, int],
    uvs: np.ndarray | None = None, uvs_1: np.ndarray | None = None, colors: np.ndarray | None = None,
) -> PlacedMesh:  # fmt: skip
    """The mesh under its transform; a smooth one without normals gets them here, in its own space."""
    normal_faces = faces
    if not smooth:
        normals = None
    elif normals is None:
        normals, normal_faces = corner_normals(vertices, faces)
    if matrix is not None:
        axes = matrix[:3, :3]
        vertices = vertices @ axes.T + matrix[:3, 3]
        if normals is not None:  # by the inverse transpose; rows, so from the right; its size does not matter
            normals = normals @ (np.linalg.inv(axes) * np.abs(axes).max())
        if np.linalg.det(axes) < 0:
            faces, normal_faces = faces[:, [0, 2, 1]], normal_faces[:, [0, 2, 1]]
    return PlacedMesh(vertices, faces, normals, normal_faces, single_sided, *used, uvs, uvs_1, colors)


def triangles(
    meshes: list[PlacedMesh], origin: np.ndarray
) -> tuple[np.ndarray, np.ndarray, dict[int, int], list[np.ndarray]]:
    """(`layout.Triangle` records, their `layout.TriangleNormals` or none if all are flat, degenerate ones by shape,
    by mesh which faces are left).

    Degenerate triangles are left out: those whose normal would not survive float32.
    """
    records, normals, degenerate, kept = [], [], {}, []
    any_smooth = any(mesh.normals is not None for mesh in meshes)
    for mesh in meshes:
        vertices = (mesh.vertices - origin).astype(np.float32)
        corners = vertices[mesh.faces]
        e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        cross = np.cross(e1, e2)
        size = _squares(cross)
        limit = np.maximum(FLAT**2 * _squares(e1) * _squares(e2), SMALLEST)
        keep = np.flatnonzero((size > limit) & np.isfinite(size))
        if len(keep) < len(corners):
            degenerate[mesh.shape] = len(corners) - len(keep)
        kept.append(keep)
        record = np.zeros(len(keep), layout.Triangle.dtype)
        record["v0"], record["v1"], record["v2"] = corners[keep, 0], corners[keep, 1], corners[keep, 2]
        record["material"], record["light"] = mesh.material, layout.NONE
        record["shape"] = mesh.shape | (layout.SINGLE_SIDED if mesh.single_sided else 0)
        records.append(record)
        if any_smooth:
            normals.append(_normals(mesh, keep, cross[keep]))
    empty = [np.zeros(0, layout.Triangle.dtype)], [np.zeros(0, layout.TriangleNormals.dtype)]
    return np.concatenate(records or empty[0]), np.concatenate(normals or empty[1]), degenerate, kept


def at_corners(meshes: list[PlacedMesh], kept: list[np.ndarray], name: str) -> np.ndarray:
    """`uvs`, `uvs_1` (triangles, 3, 2) float32 or `colors` (triangles, 3, 4) float16 of the kept faces; none where no
    mesh has them, else zeros or white for those without.
    """
    width, dtype, missing = (4, np.float16, 1) if name == "colors" else (2, np.float32, 0)
    if all(getattr(mesh, name) is None for mesh in meshes):
        return np.zeros((0, 3, width), dtype)
    out = np.full((sum(map(len, kept)), 3, width), missing, dtype)
    end = 0
    for mesh, keep in zip(meshes, kept, strict=True):
        values = getattr(mesh, name)
        start, end = end, end + len(keep)
        if values is not None:
            out[start:end, :, : values.shape[1]] = values.astype(dtype)[mesh.faces[keep]]
    return out


def _squares(v: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("ij,ij->i", v, v, dtype=np.float64))


def _normals(mesh: PlacedMesh, keep: np.ndarray, cross: np.ndarray) -> np.ndarray:
    """`layout.TriangleNormals` of the faces `keep`, whose geometric normals are along `cross`."""
    records = np.zeros(len(keep), layout.TriangleNormals.dtype)
    if mesh.normals is None:
        return records
    records["smoothed"] = 1
    codes = encode(mesh.normals)
    missing = ~np.asarray(np.any(mesh.normals, axis=1))
    corners = mesh.normal_faces[keep]
    behind = np.ones(len(keep), bool)
    for k in range(3):
        behind &= np.einsum("ij,ij->i", mesh.normals[corners[:, k]], cross) < 0
    turned = encode(-mesh.normals) if behind.any() else codes
    flat = encode(cross) if missing.any() else np.zeros(len(keep), np.uint32)
    for k, name in enumerate(("n0", "n1", "n2")):
        index = corners[:, k]
        # Outward is counter-clockwise: normals of a file that all point inwards are turned round.
        code = np.where(behind, turned[index], codes[index])
        records[name] = np.where(missing[index], flat, code)
    return records
