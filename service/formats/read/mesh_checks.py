"""Oddities of a mesh that can be rendered all the same."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from service.formats.types import Doubles, Floats, Indices, MeshOddities

FLAT = 4 * float(np.finfo(np.float32).eps)
CHUNK = 1 << 14  # triangles at once: float64 copies of a million take 0.25 GB
SHARE = 1 << 20  # triangles whose edges are sorted together: those of a million take 0.1 GB


def mesh_oddities(
    vertices: Doubles, faces: Indices, uvs: Floats | None = None, colors: Floats | None = None
) -> MeshOddities:
    """Repeated triangles, triangles back to back or inside out, and edges of more than two triangles."""
    flat = _flat(vertices, faces)
    if flat.any():  # packing warns about these
        faces = faces[~flat]
    if not len(faces):
        return MeshOddities()
    welded = _places(vertices).take(faces)
    count = len(vertices)
    coinciding, differing = _repeated(welded, count), 0
    looks = [rows for rows in (uvs, colors) if rows is not None]
    if coinciding and looks:
        differing = coinciding - _repeated(_places(np.column_stack([vertices, *looks])).take(faces), count)
    boundary, crowded, turned = _edges(welded, count)
    inwards = not boundary and not crowded and not turned and _volume(vertices, faces) < 0
    return MeshOddities(coinciding, differing, crowded, turned, inwards, boundary)


def _flat(vertices: Doubles, faces: Indices) -> npt.NDArray[np.bool_]:
    """(m,) which triangles have an angle whose sine float32 cannot distinguish from 0."""
    flat = np.empty(len(faces), bool)
    for at in range(0, len(faces), CHUNK):
        a, b, c = (vertices.take(faces[at : at + CHUNK, k], axis=0) for k in range(3))
        b -= a
        c -= a
        flat[at : at + CHUNK] = _squares(np.cross(b, c)) <= FLAT**2 * (_squares(b) * _squares(c))
    return flat


def _squares(rows: Doubles) -> Doubles:
    squares: Doubles = np.einsum("ij,ij->i", rows, rows)
    return squares


def _places(rows: Doubles) -> Indices:
    """(n,) a number for each vertex, equal for equal rows, as files repeat vertices along their seams."""
    bits = np.ascontiguousarray(rows + 0.0).view(np.uint64)  # + 0.0: -0 becomes 0
    mixed = np.zeros(len(bits), np.uint64)
    for axis in range(bits.shape[1]):  # two positions that mix to one number are as good as never: 1e-8 for a million
        mixed = (mixed ^ bits[:, axis]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    order = np.argsort(mixed)
    ranked = mixed[order]
    begins = np.concatenate([[True], ranked[1:] != ranked[:-1]])[: len(ranked)]
    place = np.empty(len(mixed), np.int32)
    place[order] = np.cumsum(begins, dtype=np.int32) - 1
    return place


def _repeated(faces: Indices, count: int) -> int:
    """The number of triangles with the same corners as an earlier one, whichever way they face."""
    keys = np.empty(len(faces), np.uint64)
    for at in range(0, len(faces), CHUNK):
        a, b, c = faces[at : at + CHUNK].astype(np.uint64).T
        least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        middle = a + b + c - least - most
        keys[at : at + CHUNK] = (least * np.uint64(count) + middle) * np.uint64(0x9E3779B97F4A7C15) ^ most
    keys.sort()
    return int(np.count_nonzero(keys[1:] == keys[:-1]))


def _edges(faces: Indices, count: int) -> tuple[int, int, int]:
    """The numbers of edges with one triangle, with more than two, and with two in the same direction."""
    boundary, crowded, turned = 0, 0, 0
    shares = -(-len(faces) // SHARE)  # by the remainder of an end's number
    for share in range(shares):
        pieces = []
        for at in range(0, len(faces), CHUNK):
            for k in range(3):
                start = faces[at : at + CHUNK, k].astype(np.int64)
                end = faces[at : at + CHUNK, (k + 1) % 3].astype(np.int64)
                least = np.minimum(start, end)
                edges = (least * count + np.maximum(start, end)) * 2 + (start > end)
                pieces.append(edges if shares == 1 else edges[least % shares == share])
        keys = np.concatenate(pieces)
        if not len(keys):
            continue
        keys.sort()
        edge = keys >> 1
        begins = np.flatnonzero(np.concatenate([[True], edge[1:] != edge[:-1]]))
        sizes = np.diff(begins, append=len(edge))
        pairs = begins[sizes == 2]
        boundary += int(np.count_nonzero(sizes == 1))
        crowded += int(np.count_nonzero(sizes > 2))
        turned += int(np.count_nonzero((keys[pairs] ^ keys[np.minimum(pairs + 1, len(keys) - 1)]) & 1 == 0))
    return boundary, crowded, turned


def _volume(vertices: Doubles, faces: Indices) -> float:
    """Six times the volume of a closed mesh; negative where it faces inwards."""
    middle, volume = vertices.mean(axis=0), 0.0
    for at in range(0, len(faces), CHUNK):
        a, b, c = (vertices[faces[at : at + CHUNK, k]] - middle for k in range(3))
        volume += float(np.einsum("ij,ij->", a, np.cross(b, c)))
    return volume
