"""Tangents at the corners of triangles, for normal maps and anisotropic highlights, in ten bits a corner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gpu import layout
from service.pack.geometry.parallel import chunks
from service.pack.geometry.vertex_normals import add_up, decode, same


@dataclass(frozen=True)
class Tangents:
    """Directions (k, 3) float32 of any length; `corners` (m, 3) are indices into them."""

    rows: np.ndarray
    corners: np.ndarray
    left: np.ndarray  # (m,) whether v grows to the right of u, seen from outside

    def moved(self, axes: np.ndarray) -> Tangents:
        """The tangents under a linear map; where it mirrors, corners follow the faces, whose order is reversed."""
        rows = self.rows @ (axes.T / np.abs(axes).max()).astype(np.float32)
        if np.linalg.det(axes) > 0:
            return Tangents(rows, self.corners, self.left)
        return Tangents(rows, self.corners[:, [0, 2, 1]], ~self.left)


def tangents(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray | None, normal_faces: np.ndarray,
    uvs: np.ndarray | None, given: np.ndarray | None,
) -> Tangents:  # fmt: skip
    """The tangents of a mesh in its own space, from `given` (n, 4), as glTF's TANGENT, or else from `uvs` (n, 2).

    A flat mesh (without normals) has those of its triangles. A vertex for which neither gives a direction gets the
    direction of a rotation about +Y, as on a sphere.
    """

    def charted() -> Tangents:
        if uvs is None:
            return around()
        return _otherwise(_charted(vertices, faces, normals, normal_faces, uvs), around)

    def around() -> Tangents:
        x, _, z = vertices.T
        return Tangents(_small(np.stack([z, 0 * z, -x], axis=1)), faces, np.zeros(len(faces), bool))

    if given is None or normals is None:
        return charted()
    # A bitangent is w cross(normal, tangent) about the file's normals, which may point inwards.
    left = given[:, 3].take(faces).sum(axis=1) < 0
    for some in chunks(len(faces)):
        p = vertices.take(faces[some], axis=0)
        across = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        left[some] ^= (np.einsum("ikj,ij->ik", normals.take(normal_faces[some], axis=0), across) < 0).all(axis=1)
    return _otherwise(Tangents(_small(given[:, :3]), faces, left), charted)


def _otherwise(first: Tangents, other: Callable[[], Tangents]) -> Tangents:
    """`first`, but `other` wherever the first has no direction."""
    without = ~first.rows.any(axis=1).take(first.corners)
    if not without.any():
        return first
    second = other()
    corners = np.where(without, second.corners + len(first.rows), first.corners).astype(np.int32)
    left = np.where(without.all(axis=1), second.left, first.left)
    return Tangents(np.concatenate([first.rows, second.rows]), corners, left)


def _charted(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray | None, normal_faces: np.ndarray, uvs: np.ndarray
) -> Tangents:
    """The tangents of [Mikkelsen 2008, "Simulation of wrinkled surfaces revisited"], which glTF prescribes: at each
    corner the triangle's direction of growing u is projected into the plane of the normal, and the directions of a
    vertex' triangles are summed, weighted by their angles in that plane.

    A vertex is a position, a normal and a uv; triangles with mirrored coordinates are summed apart. Departing from
    Mikkelsen's code, triangles that share only the vertex are one group, too, and polygons are the triangles that
    they were cut into. A triangle whose uvs have no area takes the tangent of its neighbours.
    """
    if normals is None:
        rows = np.empty((len(faces), 3))
        left = np.empty(len(faces), bool)
        for some in chunks(len(faces)):
            rows[some], turned = _along(vertices.take(faces[some], axis=0), uvs.take(faces[some], axis=0))
            left[some] = turned < 0
        return Tangents(_small(rows), np.repeat(np.arange(len(faces), dtype=np.int32)[:, None], 3, axis=1), left)
    by_normal = [normals] if normal_faces is faces else []  # else there is one normal for each position
    place = same(vertices, *by_normal, uvs)
    sums = np.zeros((3, 2 * (int(place.max(initial=-1)) + 1)))
    flat, left = np.empty(len(faces), bool), np.empty(len(faces), bool)
    for some in chunks(len(faces)):
        p = vertices.take(faces[some], axis=0)
        along, turned = _along(p, uvs.take(faces[some], axis=0))
        flat[some], left[some] = turned == 0, turned < 0
        weighted = _weighted(p, along, normals.take(normal_faces[some], axis=0))
        which = 2 * place.take(faces[some]) + left[some, None]
        add_up(sums, which.reshape(-1), weighted.reshape(-1, 3))
    # Where directions cancel, only rounding is left.
    sums *= np.einsum("ij,ij->j", sums, sums) > 1e-18
    rows = _small(sums.T)
    if flat.any():
        lone = 2 * place.take(faces[flat])
        left[flat] = ~rows[lone].any(axis=(1, 2)) & rows[lone + 1].any(axis=(1, 2))
    return Tangents(rows, 2 * place.take(faces) + left[:, None].astype(np.int32), left)


def _small(rows: np.ndarray) -> np.ndarray:
    """The rows as float32 of length 1 at most; those that were not zero are still not."""
    most = np.abs(rows).max(axis=1, keepdims=True)
    small: np.ndarray = np.divide(
        rows, most, out=np.zeros(rows.shape, np.float32), where=most > 0, casting="same_kind"
    )
    return small


def _along(p: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The direction of growing u (c, 3) of triangles p (c, 3, 3) with coordinates w (c, 3, 2), zero where these have
    no area; and twice that area (c,), below zero where they are mirrored."""
    w = w.astype(np.float64)
    e1, e2, d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], w[:, 1] - w[:, 0], w[:, 2] - w[:, 0]
    turned = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    return _unit(np.sign(turned)[:, None] * (d2[:, 1:] * e1 - d1[:, 1:] * e2)), turned


def _weighted(p: np.ndarray, along: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(c, 3, 3): for corners at p with the normals n the direction in the normal's plane, with the angle as
    length."""
    edges = p[:, [1, 2, 0]] - p
    out = np.empty_like(p)
    for k in range(3):
        normal = _unit(n[:, k].astype(np.float64))
        ahead, back = _laid(edges[:, k], normal), _laid(-edges[:, k - 1], normal)
        cosine, sine = _dot(ahead, back), np.linalg.norm(np.cross(ahead, back), axis=1)
        out[:, k] = np.arctan2(sine, cosine)[:, None] * _unit(_laid(along, normal))
    return out


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("ij,ij->i", a, b))


def _laid(v: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return np.asarray(v - _dot(v, normal)[:, None] * normal)


def _unit(v: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(np.divide(v, length, out=np.zeros_like(v), where=length > 0))


def codes(normals: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(n,) uint32 from 1 to TANGENT_STEPS: the angle of each row in the plane of the normal with these bits, which
    triangle_tangent in triangle.glsl decodes."""
    n, below = decode(normals)
    s = np.where(below, -1.0, 1.0)
    a = -1.0 / (s + n[:, 2])
    x = np.stack([1 + s * n[:, 0] ** 2 * a, s * n[:, 0] * n[:, 1] * a, -s * n[:, 0]], axis=1)
    angle = np.arctan2(_dot(rows, np.cross(n, x)), _dot(rows, x))
    steps = np.rint(angle * (layout.TANGENT_STEPS / (2 * np.pi))).astype(np.int64) % layout.TANGENT_STEPS
    return np.asarray(steps + 1, np.uint32)
