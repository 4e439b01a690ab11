"""Meshes of grids: turned curves, boxes with rounded edges, sheets."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from service.document.presets.encoders import encode_ply

# Of normals that come from differences, whose last digits are another machine's: assets are named by their bytes.
DIGITS = 4
Curve = tuple[np.ndarray, np.ndarray]  # points and outward unit normals (n, 2)


class Mesh:
    """Grids of vertices, joined to triangles that face the way that their normals do."""

    def __init__(self) -> None:
        self._vertices: list[np.ndarray] = []
        self._faces: list[np.ndarray] = []
        self._count = 0

    def add(self, points: np.ndarray, normals: np.ndarray, uvs: np.ndarray, colors: np.ndarray | None = None) -> None:
        """A grid (m, n, 3) with texture coordinates (m, n, 2), and colours (m, n, 3) if all grids have them."""
        m, n = points.shape[:2]
        corner = np.arange(m * n).reshape(m, n)
        a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
        faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
        flat, up = points.reshape(-1, 3), normals.reshape(-1, 3)
        facing = np.cross(flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]])
        away = (facing * up[faces].sum(axis=1)).sum(axis=1) < 0
        faces[away] = faces[away][:, ::-1]
        self._faces.append(faces[np.linalg.norm(facing, axis=1) > 1e-12] + self._count)
        columns = [flat, up, uvs.reshape(-1, 2)] + ([] if colors is None else [colors.reshape(-1, 3)])
        self._vertices.append(np.hstack(columns))
        self._count += m * n

    def copy(self, other: Mesh, turn: np.ndarray, move: Sequence[float] | np.ndarray) -> None:
        """All of another mesh, turned by a rotation (3, 3) and moved."""
        vertices = np.concatenate(other._vertices)
        turned = [vertices[:, :3] @ turn.T + move, vertices[:, 3:6] @ turn.T, vertices[:, 6:]]
        self._vertices.append(np.hstack(turned))
        self._faces.append(np.concatenate(other._faces) + self._count)
        self._count += other._count

    def file(self) -> bytes:
        columns = np.concatenate(self._vertices).round(6).T + 0.0  # no -0
        names = ("x", "y", "z", "nx", "ny", "nz", "s", "t", "red", "green", "blue")[: len(columns)]
        return encode_ply(dict(zip(names, columns, strict=True)), np.concatenate(self._faces))


def filleted(corners: Sequence[tuple[float, float, float]], steps: int = 4) -> Curve:
    """A line through corners (x, y, radius), each rounded by an arc; outward is on the right of the way.

    The ends' radii do not count.
    """
    points = np.array([corner[:2] for corner in corners])
    ways = np.diff(points, axis=0)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    made, normals = [points[:1]], [_right(ways[:1])]
    for i, (x, y, radius) in enumerate(corners[1:-1]):
        before, after = ways[i], ways[i + 1]
        turn = math.atan2(before[0] * after[1] - before[1] * after[0], float(before @ after))
        out = _right(before[None])[0]
        start = np.array([x, y]) - before * radius * math.tan(abs(turn) / 2)
        center = start - out * radius * math.copysign(1, turn)
        angles = np.linspace(0, turn, max(2, steps + 1))
        spin = np.stack([out[0] * np.cos(angles) - out[1] * np.sin(angles),
                         out[0] * np.sin(angles) + out[1] * np.cos(angles)], axis=1)  # fmt: skip
        made.append(center + spin * radius * math.copysign(1, turn))
        normals.append(spin)
    return np.concatenate([*made, points[-1:]]), np.concatenate([*normals, _right(ways[-1:])])


def smooth(points: Sequence[tuple[float, float]], steps: int = 6) -> Curve:
    """A Catmull-Rom spline through points; outward is on the right of the way."""
    p = np.array(points, dtype=float)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = np.linspace(0, 1, steps, endpoint=False)[:, None]
    rows, ways = [], []
    for a, b, c, d in zip(p[:-3], p[1:-2], p[2:-1], p[3:], strict=True):
        rows.append(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3))
        ways.append((c - a) + 2 * (2 * a - 5 * b + 4 * c - d) * t + 3 * (3 * b - a - 3 * c + d) * t**2)
    line, way = np.concatenate([*rows, p[-2:-1]]), np.concatenate([*ways, p[-1:] - p[-3:-2]])
    return line, _right(way / np.linalg.norm(way, axis=1, keepdims=True))


def joined(*curves: Curve) -> Curve:
    """One curve after the other; where they meet at an angle, the edge stays sharp."""
    return np.concatenate([points for points, _ in curves]), np.concatenate([normals for _, normals in curves])


def _right(ways: np.ndarray) -> np.ndarray:
    return np.stack([ways[:, 1], -ways[:, 0]], axis=1)


def lathe(mesh: Mesh, curve: Curve, around: int = 96, shape: Callable[..., np.ndarray] | None = None) -> None:
    """Turn a curve of (distance from the axis, height) once about +Y.

    `shape(angles, heights)` is a factor on the distances (around + 1, n); normals follow from the surface then.
    """
    points, normals = curve
    angles = np.linspace(0, 2 * math.pi, around + 1)[:, None]
    factor = np.ones((around + 1, len(points))) if shape is None else shape(angles, points[None, :, 1])
    radius = points[None, :, 0] * factor
    grid = np.stack(np.broadcast_arrays(radius * np.sin(angles), points[:, 1], radius * np.cos(angles)), axis=-1)
    out = np.stack(
        np.broadcast_arrays(normals[:, 0] * np.sin(angles), normals[:, 1], normals[:, 0] * np.cos(angles)), axis=-1
    )
    path = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    reach = float(points[:, 0].max())
    uvs = np.stack(np.broadcast_arrays(angles * reach, path), axis=-1)
    mesh.add(grid, out if shape is None else bent_normals(grid, out, closed=True), uvs)


def bent_normals(grid: np.ndarray, rough: np.ndarray, closed: bool = False) -> np.ndarray:
    """Unit normals of a grid by its differences, on the side of `rough`; `closed`: its first row is its last one."""
    if closed:
        ring = np.concatenate([grid[-2:-1], grid, grid[1:2]])
        along = ring[2:] - ring[:-2]
    else:
        along = np.gradient(grid, axis=0)
    normal = np.cross(along, np.gradient(grid, axis=1))
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = np.where(length > 1e-12, normal / np.maximum(length, 1e-12), rough)
    return np.asarray(np.where((normal * rough).sum(-1, keepdims=True) < 0, -normal, normal)).round(DIGITS)


def rounded_box(
    mesh: Mesh,
    half: tuple[float, float, float],
    radius: float,
    steps: int = 4,
    flats: tuple[int, int, int] = (1, 1, 1),
    moved: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    hollow: bool = False,
) -> None:
    """A box about 0 with rounded edges: `steps` across each of them, `flats` along each axis.

    `hollow`: it is a hole in what is around it. `moved(points, normals)` gives other points; normals follow from the
    surface then.
    """
    inner = np.array(half) - radius
    turn = np.tan(np.linspace(-math.pi / 4, 0, steps // 2 + 1))
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        rows, columns = (_across(half[k], radius, turn, flats[k]) for k in (a, b))
        for side in (-1.0, 1.0):
            cube = np.empty((len(rows), len(columns), 3))
            cube[..., axis] = side * half[axis]
            cube[..., a], cube[..., b] = rows[:, None], columns[None]
            core = np.clip(cube, -inner, inner)
            normals = (cube - core) / np.linalg.norm(cube - core, axis=-1, keepdims=True)
            points = core + radius * normals
            if moved is not None:
                points, normals = _moved(points, normals, moved)
            mesh.add(points, -normals if hollow else normals, cube[..., [a, b]])


def _across(half: float, radius: float, turn: np.ndarray, flats: int) -> np.ndarray:
    """Places along an edge, closer together in the rounded ends, where they are equal steps of the angle."""
    end = -half + radius + radius * turn
    return np.concatenate([end, np.linspace(end[-1], -end[-1], flats + 1)[1:-1], -end[::-1]])


def _moved(
    points: np.ndarray, normals: np.ndarray, moved: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """By differences along two tangents, so that normals agree where faces meet."""
    step = 1e-4
    helper = np.where(np.abs(normals[..., :1]) < 0.6, [1.0, 0, 0], [0, 1.0, 0])
    one = np.cross(normals, helper)
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    two = np.cross(normals, one)
    at = moved(points, normals)
    facing = np.cross(moved(points + step * one, normals) - at, moved(points + step * two, normals) - at)
    out = moved(points + step * normals, normals) - at  # on the other side where `moved` mirrors
    facing *= np.sign((facing * out).sum(-1, keepdims=True))
    return at, (facing / np.linalg.norm(facing, axis=-1, keepdims=True)).round(DIGITS)


def denser(points: np.ndarray, step: float) -> np.ndarray:
    """A line with further points, none more than `step` from the next."""
    rows = [points[:1]]
    for a, b in pairwise(points):
        n = math.ceil(float(np.linalg.norm(b - a)) / step)  # none where both are one point
        if not n:
            continue
        rows.append(a + (b - a) * (np.arange(1, n + 1) / n)[:, None])
    return np.concatenate(rows)


def on_the_right(points: np.ndarray) -> np.ndarray:
    """Unit normals (n, 2) of a line, to the right of its way."""
    way = np.gradient(points, axis=0)
    return _right(way / np.linalg.norm(way, axis=1, keepdims=True))


def waves(points: np.ndarray, seed: int, finest: float, count: int = 24) -> np.ndarray:
    """Smooth random numbers of standard deviation 1 over points (..., 3): sines, the shortest `finest` m long."""
    draw = np.random.default_rng(seed)
    ways = draw.normal(size=(count, 3))
    ways *= (2 * math.pi / (finest * draw.uniform(1, 3, count)) / np.linalg.norm(ways, axis=1))[:, None]
    return np.asarray(np.sin(points @ ways.T + draw.uniform(0, 2 * math.pi, count)).sum(-1) * math.sqrt(2 / count))
