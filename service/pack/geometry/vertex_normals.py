"""Vertex normals: computed where a mesh has none, and as 32 bits."""

from __future__ import annotations

import numpy as np

from service.pack.geometry.parallel import chunks, in_threads


def encode(normals: np.ndarray) -> np.ndarray:
    """(n,) uint32 of (n, 3) directions of any length: octahedral, as GLSL's packSnorm2x16 [Cigolle et al. 2014].

    Decoded: e = unpackSnorm2x16(code); n = (e.x, e.y, 1 - |e.x| - |e.y|); where n.z < 0, n.x and n.y move towards
    zero by -n.z; normalise. Off by at most 0.004 degrees. A zero normal becomes +z.
    """
    codes = np.empty(len(normals), np.uint32)

    def some(which: slice) -> None:
        codes[which] = _encoded(np.asarray(normals[which], np.float64))

    in_threads(some, chunks(len(normals)))
    return codes


def _encoded(n: np.ndarray) -> np.ndarray:
    size = np.abs(n).sum(axis=1)
    n = n / np.where(size > 0, size, 1.0)[:, None]
    sign = np.where(n[:, :2] >= 0, 1.0, -1.0)
    folded = (1.0 - np.abs(n[:, 1::-1])) * sign
    e = np.where((n[:, 2] < 0)[:, None], folded, n[:, :2])
    bits = np.rint(e * 32767).astype(np.int16).astype(np.uint16).astype(np.uint32)
    return np.asarray(bits[:, 0] | bits[:, 1] << np.uint32(16))


def decode(codes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float64 unit directions of (n,) codes, and which of them point below the plane z = 0, or along it."""
    halves = np.ascontiguousarray(codes, np.uint32).view(np.int16).reshape(-1, 2)
    e = halves.astype(np.float64) / 32767
    z = 1 - np.abs(e).sum(axis=1)
    fold = np.maximum(-z, 0.0)[:, None] * np.where(e >= 0, 1.0, -1.0)
    n = np.column_stack([e - fold, z])
    below = np.abs(halves.astype(np.int32)).sum(axis=1) >= 32767
    return n / np.linalg.norm(n, axis=1, keepdims=True), below


def corner_normals(
    vertices: np.ndarray, faces: np.ndarray, groups: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(normals (k, 3) of the distinct positions, faces (m, 3) counting in them).

    A position's normal is the mean of its faces', weighted by their angles there [Thuermer and Wuethrich 1998], so
    that it depends on neither the tessellation nor on vertices that a file repeats along its seams. Zero where the
    faces cancel. Positions of different `groups` (n,) are distinct.
    """
    place = same(vertices) if groups is None else same(vertices, groups[:, None])
    sums = np.zeros((int(place.max(initial=-1)) + 1, 3))
    joined = np.ascontiguousarray(place.take(faces))  # raises IndexError, which the loop does not
    from service.pack.geometry.corner_angles import add_faces  # numba is loaded for meshes alone

    add_faces(np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int32), joined, sums)
    length = np.sqrt(np.einsum("ij,ij->i", sums, sums))
    cancelled = length < 1e-9  # where faces are back to back, only rounding is left
    sums /= np.where(cancelled, np.inf, length)[:, None]
    return sums, joined


def split(faces: np.ndarray, groups: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices of their own for each smoothing group: (the former vertex of each, its group, faces (m, 3) in them).

    `groups` (m,) are those of the faces; a face of group 0 is a group by itself.
    """
    first = int(groups.max()) + 1
    face_groups = np.where(groups > 0, groups, first + np.arange(len(faces), dtype=np.int64))
    keys, corners = np.unique(
        faces.astype(np.int64) * (first + len(faces)) + face_groups[:, None], return_inverse=True
    )
    which, group = np.divmod(keys, first + len(faces))
    return which, group, corners.reshape(-1, 3).astype(np.int32)


def add_up(sums: np.ndarray, which: np.ndarray, rows: np.ndarray) -> None:
    """Add each of `rows` (n, 3) to the column of `sums` (3, k) that `which` (n,) names."""
    index = which.astype(np.intp)  # numpy is fast with this type only
    for axis in range(3):
        np.add.at(sums[axis], index, rows[:, axis])


def same(*columns: np.ndarray) -> np.ndarray:
    """(n,) int32: a number for each row of all the arrays (n, ...) together, equal for equal rows: positions, say."""
    # Sorting one mixed number per row is ten times as fast as sorting rows.
    mixed = np.zeros(len(columns[0]), np.uint64)
    for axis in (column[:, k] for column in columns for k in range(column.shape[1])):
        mixed ^= _bits(axis)
        mixed *= np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    order = np.argsort(mixed)
    ranked = mixed[order]
    begins = np.concatenate([[True], ranked[1:] != ranked[:-1]])[: len(ranked)]
    if begins.all():
        return np.arange(len(mixed), dtype=np.int32)
    place = np.empty(len(mixed), np.int32)
    place[order] = np.cumsum(begins, dtype=np.int32) - 1
    first = order[begins]
    del mixed, ranked, order
    if all(_same(column, first, place) for column in columns):
        return place
    bits = np.stack([_bits(column[:, k]) for column in columns for k in range(column.shape[1])], axis=1)
    return np.unique(bits, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int32)  # two rows gave one number


def _same(column: np.ndarray, first: np.ndarray, place: np.ndarray) -> bool:
    """True if all rows that have the same number are equal."""
    rows = column.take(first, axis=0)
    return all(np.array_equal(rows.take(place[some], axis=0), column[some]) for some in chunks(len(column)))


def _bits(numbers: np.ndarray) -> np.ndarray:
    return (numbers + 0.0).astype(np.float64).view(np.uint64)  # + 0.0: -0 becomes 0
