"""Triangles cut until no edge is longer than a bound.

Whether and where an edge is cut depends on its two ends alone, so that both triangles that share it cut it alike,
also across a seam of texture coordinates, where each has vertices of its own.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

CUT_ONE, CUT_TWO, CUT_THREE = range(1, 4)


class TooManyTriangles(Exception):
    pass


def subdivided(
    rows: np.ndarray, faces: np.ndarray, axes: np.ndarray, max_edge: float, room: int,
    grows: Callable[[int], None] = lambda count: None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(rows (n, c), faces (m, 3)) with further vertices in the middle of edges: means of the rows of their ends.

    The first three columns are positions, and lengths are those under the linear map `axes`. `grows` is called with
    the number of triangles before these are there. Raises TooManyTriangles before there are more than `room`.
    """
    done = [np.zeros((0, 3), np.int64)]
    faces = faces.astype(np.int64)
    while len(faces):
        place = moved(rows[:, :3], axes)
        long = _squares(place[faces] - place[np.roll(faces, -1, axis=1)]) > max_edge**2
        cuts = long.sum(axis=1)
        done.append(faces[cuts == 0])
        faces, long, cuts = faces[cuts > 0], long[cuts > 0], cuts[cuts > 0]
        count = sum(map(len, done)) + len(faces) + int(cuts.sum())
        if count > room:
            raise TooManyTriangles
        grows(count)
        middles, rows = _cut(rows, faces, long)
        faces = _pieces(faces, middles, cuts, moved(rows[:, :3], axes))
    return rows, np.concatenate(done)


def moved(points: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Points under a linear map: to the bit the same for equal points, wherever they stand, which `@` is not."""
    return np.asarray(points[:, :1] * axes[:, 0] + points[:, 1:2] * axes[:, 1] + points[:, 2:] * axes[:, 2])


def _cut(rows: np.ndarray, faces: np.ndarray, long: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) the vertex in the middle of each edge that is `long`, else -1; and the rows with these."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)[long]
    edges, which = np.unique(ends.min(axis=1) * len(rows) + ends.max(axis=1), return_inverse=True)
    a, b = np.divmod(edges, max(len(rows), 1))
    middles = np.full(faces.shape, -1, np.int64)
    middles[long] = len(rows) + which
    return middles, np.concatenate([rows, (rows[a] + rows[b]) / 2])


def _pieces(faces: np.ndarray, middles: np.ndarray, cuts: np.ndarray, place: np.ndarray) -> np.ndarray:
    """The triangles that the middles of edges, edge k from corner k to the next, cut the faces into."""
    out = []
    # Each is turned so that what is cut comes first: edge 0 of one, edges 0 and 1 of two.
    for count, first in ((CUT_ONE, middles >= 0), (CUT_TWO, np.roll(middles < 0, 1, axis=1))):
        some = cuts == count
        turn = (np.argmax(first[some], axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(faces[some], turn, axis=1).T
        m, n, _ = np.take_along_axis(middles[some], turn, axis=1).T
        if count == CUT_ONE:
            out += [(a, m, c), (m, b, c)]
        else:
            # Two triangles fill the rest, along the shorter diagonal.
            from_a = _squares(place[a] - place[n]) <= _squares(place[m] - place[c])
            out += [(m, b, n), (a, m, np.where(from_a, n, c)), (np.where(from_a, a, m), n, c)]
    some = cuts == CUT_THREE
    (a, b, c), (m, n, o) = faces[some].T, middles[some].T
    out += [(a, m, o), (m, b, n), (o, n, c), (m, n, o)]
    return np.concatenate([np.stack(piece, axis=1) for piece in out])


def _squares(v: np.ndarray) -> np.ndarray:
    return np.asarray(v[..., 0] ** 2 + v[..., 1] ** 2 + v[..., 2] ** 2)
