"""What is odd about a mesh that can be rendered all the same, told to whoever made it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from service.assets.data import Doubles, Indices
from service.assets.polygons import Longs

FLAT = 4 * float(np.finfo(np.float32).eps)
CHUNK = 1 << 16  # triangles at once: a million's float64 copies take a quarter of a gigabyte


def oddities(vertices: Doubles, faces: Indices) -> list[str]:
    """Triangles twice in a place, back to back or inside out; edges of more than two."""
    found: list[str] = []
    flat = _flat(vertices, faces)
    if flat.any():  # packing tells of these
        faces = faces[~flat]
    welded = _places(vertices)[faces]
    count = len(vertices)
    twice = _repeated(welded, count)
    if twice:
        found.append(f"{twice} triangles stand where another one does: chance says which of them is met")
    if not len(welded):
        return found
    boundary, crowded, turned = _edges(welded, count)
    if crowded:
        found.append(f"{crowded} edges belong to more than two triangles: inside and outside are not clear there")
    if turned:
        found.append(f"{turned} edges lie between triangles that face opposite ways")
    if not boundary and not crowded and not turned and _volume(vertices, faces) < 0:
        found.append("it is closed and all of it faces inwards: light and glass take the inside for the outside")
    return found


def _flat(vertices: Doubles, faces: Indices) -> npt.NDArray[np.bool_]:
    """(m,) which triangles have no area to speak of: the sine of an angle below what float32 tells from 0."""
    flat = np.empty(len(faces), bool)
    for at in range(0, len(faces), CHUNK):
        a, b, c = (vertices[faces[at : at + CHUNK, k]] for k in range(3))
        sides = ((b - a) ** 2).sum(axis=1) * ((c - a) ** 2).sum(axis=1)
        flat[at : at + CHUNK] = (np.cross(b - a, c - a) ** 2).sum(axis=1) <= FLAT**2 * sides
    return flat


def _places(vertices: Doubles) -> Indices:
    """(n,) a number of each vertex's position, the same for the same: files repeat vertices along their seams."""
    bits = np.ascontiguousarray(vertices + 0.0).view(np.uint64)  # + 0.0: -0 becomes 0
    mixed = np.zeros(len(bits), np.uint64)
    for axis in range(3):  # two positions that mix to one number are as good as never: 1e-8 for a million
        mixed = (mixed ^ bits[:, axis]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    place: Indices = np.unique(mixed, return_inverse=True)[1].astype(np.int32)
    return place


def _repeated(faces: Indices, count: int) -> int:
    """How many triangles have the corners of an earlier one, whichever way they face."""
    corners = np.sort(faces, axis=1).astype(np.uint64)
    keys = (corners[:, 0] * np.uint64(count) + corners[:, 1]) * np.uint64(0x9E3779B97F4A7C15) ^ corners[:, 2]
    keys.sort()
    return int(np.count_nonzero(keys[1:] == keys[:-1]))


def _edges(faces: Indices, count: int) -> tuple[int, int, int]:
    """How many edges have one triangle, more than two, and two that run along it the same way."""
    keys = np.empty((3, len(faces)), np.int64)
    for k in range(3):
        start, end = faces[:, k].astype(np.int64), faces[:, (k + 1) % 3]
        keys[k] = (np.minimum(start, end) * count + np.maximum(start, end)) * 2 + (start > end)
    flat: Longs = keys.reshape(-1)
    flat.sort()
    edge = flat >> 1
    begins = np.flatnonzero(np.concatenate([[True], edge[1:] != edge[:-1]]))
    sizes = np.diff(begins, append=len(edge))
    pairs = begins[sizes == 2]
    turned = int(np.count_nonzero((flat[pairs] ^ flat[np.minimum(pairs + 1, len(flat) - 1)]) & 1 == 0))
    return int(np.count_nonzero(sizes == 1)), int(np.count_nonzero(sizes > 2)), turned


def _volume(vertices: Doubles, faces: Indices) -> float:
    """Six times what a closed mesh encloses; negative where it faces inwards."""
    middle = vertices.mean(axis=0)
    a, b, c = (vertices[faces[:, k]] - middle for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)))
