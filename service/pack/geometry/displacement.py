"""Meshes whose surface a height moves: cut into small triangles, whose vertices move along the normal.

The moved mesh has the normals of the one before, and kernels bend these by the same height as where nothing moves: so
its shading is that of the displaced surface to the texel, however long the edges are.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from service.formats import MeshData
from service.formats.types import array_bytes
from service.pack.geometry.vertex_normals import corner_normals, same, split
from service.pack.textures.heights import HeightField
from service.problems import FieldError, InvalidDocument
from service.system.memory import takes

PARTS = 200  # of a mesh's size is the longest edge where the document gives none
# Triangles of a mesh are this times its area over the square of the longest edge, at most: edges are cut in halves.
DENSITY = 20.0
BYTES_PER_TRIANGLE = 300  # while triangles are cut and moved; 275 to 295 were measured
LARGEST_TRIANGLE = math.sqrt(3) / 4  # its area over the square of its longest edge

CUT_ONE, CUT_TWO, CUT_THREE = range(1, 4)


@dataclass(frozen=True)
class Displacement:
    """A height that moves a mesh. `axes` is the linear part of its transform: heights and edges are metres in the
    world."""

    field: HeightField
    max_edge: float | None
    axes: np.ndarray
    shape: int  # its index in the document


def displaced(data: MeshData, smooth: np.ndarray | bool, by: Displacement, room: int) -> MeshData:
    """The moved mesh, in its own space, with the normals of the surface before. Raises InvalidDocument where it would
    have more than `room` triangles."""
    if not len(data.faces):
        return data
    part = f"/shapes/{by.shape}"
    if _area(data, by) > room * LARGEST_TRIANGLE * _max_edge(data, by) ** 2:
        raise _too_many(data, by, room)  # at once, and not after seconds in which most of them are made
    rows, faces, columns = _rows(data, smooth)
    try:
        rows, faces = subdivided(
            rows, faces, by.axes, _max_edge(data, by), room, lambda count: takes(part, BYTES_PER_TRIANGLE * count)
        )
    except TooManyTriangles:
        raise _too_many(data, by, room) from None
    uvs = columns["uvs_1" if by.field.uv_set else "uvs"]
    vertices, normals = rows[:, :3], rows[:, columns["normals"]]
    # One displacement for each position: else the surface would open along seams of texture coordinates or normals.
    place = same(vertices)
    heights = _means(place, by.field.at(rows[:, uvs])[:, None])
    along = _along(place, normals, same(vertices, normals.astype(np.float32)), by.axes)
    vertices = vertices + moved(along * heights, np.linalg.inv(by.axes))[place]

    def column(name: str) -> np.ndarray | None:
        return rows[:, columns[name]].astype(np.float32) if name in columns else None

    result = replace(
        data,
        vertices=vertices,
        faces=faces.astype(np.int32),
        normals=column("normals"),
        groups=None,
        uvs=column("uvs"),
        uvs_1=column("uvs_1"),
        colors=column("colors"),
        tangents=column("tangents"),
    )
    takes(part, array_bytes(result))
    return result


def _rows(data: MeshData, smooth: np.ndarray | bool) -> tuple[np.ndarray, np.ndarray, dict[str, slice]]:
    """The attributes of vertices side by side, a vertex for each normal at a position; the faces in these; and the
    columns by their names."""
    normals, places = _normals(data, smooth)
    keys, corners = np.unique(data.faces.astype(np.int64) * len(normals) + places, return_inverse=True)
    which, normal = np.divmod(keys, len(normals))
    parts, columns, end = [data.vertices[which], normals[normal]], {"normals": slice(3, 6)}, 6
    for name in ("uvs", "uvs_1", "colors", "tangents"):
        values = getattr(data, name)
        if values is not None:
            parts.append(values[which])
            columns[name] = slice(end, end + values.shape[1])
            end = columns[name].stop
    return np.concatenate(parts, axis=1, dtype=np.float64), corners.reshape(-1, 3), columns


def _normals(data: MeshData, smooth: np.ndarray | bool) -> tuple[np.ndarray, np.ndarray]:
    """(unit normals (k, 3), (m, 3) which of them each corner has), outward; facets have those of the faces."""
    vertices, faces = data.vertices, data.faces
    across = _unit(
        np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    )
    of_face = np.repeat(np.arange(len(faces))[:, None], 3, axis=1)
    if not np.any(smooth):
        return across, of_face
    if data.normals is not None:
        normals, places = _unit(data.normals.astype(np.float64)), faces.astype(np.int64)
    elif isinstance(smooth, np.ndarray):
        which, group, parts = split(faces, smooth)
        normals, joined = corner_normals(vertices[which], parts, group)
        places = joined.astype(np.int64)
    else:
        normals, joined = corner_normals(vertices, faces)
        places = joined.astype(np.int64)
    behind = (np.einsum("ikj,ij->ik", normals[places], across) < 0).all(axis=1)
    missing = np.asarray(~normals.any(axis=1))[places]
    places = np.where(behind[:, None], places + len(normals), places)
    places = np.where(missing, 2 * len(normals) + of_face, places)
    return np.concatenate([normals, -normals, across]), places


def _along(place: np.ndarray, normals: np.ndarray, distinct: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """(k, 3): for each position the world's direction in which it moves, the mean of the normals there; zero where
    they cancel. Equal ones, by their numbers `distinct`, count once."""
    _, first = np.unique(distinct, return_index=True)
    total = np.zeros((int(place.max()) + 1, 3))
    for k in range(3):
        total[:, k] = np.bincount(place[first], _unit(normals[first])[:, k], len(total))
    total[np.einsum("ij,ij->i", total, total) < 1e-12] = 0
    return _unit(moved(total, np.linalg.inv(axes).T))


def _means(place: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(k, c): the mean of the rows of each position."""
    counts = np.bincount(place)
    sums = [np.bincount(place, column) for column in rows.T]
    return np.asarray(np.stack(sums, axis=1) / counts[:, None])


def _max_edge(data: MeshData, by: Displacement) -> float:
    if by.max_edge is not None:
        return by.max_edge
    low, high = data.bounds
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    return max(float(np.ptp(moved(corners, by.axes), axis=0).max()) / PARTS, 1e-30)


def _area(data: MeshData, by: Displacement) -> float:
    """Square metres in the world."""
    p = moved(data.vertices, by.axes)[data.faces]
    return float(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum()) / 2


def _too_many(data: MeshData, by: Displacement, room: int) -> InvalidDocument:
    enough = math.sqrt(DENSITY * _area(data, by) / max(room, 1))
    detail = (
        f"edges of at most {_max_edge(data, by):.3g} m take more triangles than the {room} that SUNBOX_MAX_TRIANGLES "
        f"leaves for this mesh; {enough:.2g} m would do"
    )
    return InvalidDocument([FieldError(f"/shapes/{by.shape}/max_edge", detail)])


def _unit(v: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(np.divide(v, length, out=np.zeros_like(v, dtype=np.float64), where=length > 0))


class TooManyTriangles(Exception):
    pass


def subdivided(
    rows: np.ndarray, faces: np.ndarray, axes: np.ndarray, max_edge: float, room: int,
    grows: Callable[[int], None] = lambda count: None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(rows (n, c), faces (m, 3)) with further vertices in the middle of edges: means of the rows of their ends.

    The first three columns are positions, and lengths are those under the linear map `axes`. `grows` is called with
    the number of triangles before these are there. Whether and where an edge is cut depends on its two ends alone, so
    that both triangles that share it cut it alike, also across a seam of texture coordinates, where each has vertices
    of its own. Raises TooManyTriangles before there are more than `room`.
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
