"""Subjects that materials are shown on: a shader ball, a torus knot, and the cyclorama behind them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from service.document.presets.encoders import encode_ply
from service.document.presets.mesh import Curve, Mesh

# The shader ball: an upper shell without a wedge of it, whose cut is flat; a lower shell, and a seam between them; a
# thin dish that carries both. All edges are rounded: the light along an edge tells much of a material. The stand is a
# mesh of its own.
CENTER = 0.98  # metres above the floor
OUTER, INNER = 0.8, 0.67  # radii of the shells
FOOT = 0.165  # height of the dish's middle, just above the stand
HOLE = 12.0  # degrees from the pole to the shell's upper rim
SEAM = 0.014  # metres between the shells
EDGE = 0.016  # radius of the shells' edges
CUT = (-12.0, 80.0)  # degrees from +Z to +X, which are cut out
AROUND, ALONG = 64, 8  # steps of a full turn, and of a quarter circle
ROUND = 2  # steps of an edge


def shader_ball() -> bytes:
    """A binary PLY with vertex normals and texture coordinates; it stands on the stand."""
    mesh = Mesh()
    gap = math.degrees((SEAM / 2) / OUTER)
    _shell(mesh, HOLE, 90 - gap, CUT)
    _shell(mesh, 90 + gap, 166, None)
    _lathe(mesh, *_dish(), 0, 2 * math.pi)
    return mesh.file()


def stand() -> bytes:
    """A binary PLY like that of the ball; its lowest point lies 2 mm above y = 0."""
    mesh = Mesh()
    _slab(mesh)
    return mesh.file()


def _band(half_length: float, half_width: float, radius: float, along: int) -> Curve:
    """A rectangle with rounded corners about 0: from the right over the upper side to the left, and back below.
    Point i and point -1 - i mirror one another."""
    x, y = half_length - radius, half_width - radius
    turn = np.linspace(0, math.pi / 2, ROUND + 1)
    ways = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    side = np.stack([np.linspace(x, -x, along + 1), np.full(along + 1, half_width)], axis=1)[1:-1]
    upper = np.concatenate([[x, y] + radius * ways, side, [-x, y] + radius * ways[::-1] * [-1, 1]])
    normals = np.concatenate([ways, np.tile([0.0, 1.0], (len(side), 1)), ways[::-1] * [-1, 1]])
    flip = np.array([1, -1])
    return np.concatenate([upper, upper[::-1] * flip]), np.concatenate([normals, normals[::-1] * flip])


def _bent(curve: Curve, middle: float, radius: float) -> Curve:
    """A band bent along a circle about the centre: x runs along it to the equator, y away from the centre. Points are
    (distance from the axis, height)."""
    (along, out), (n_along, n_out) = curve[0].T, curve[1].T
    angle = middle + along / radius
    away, down = np.stack([np.sin(angle), np.cos(angle)], 1), np.stack([np.cos(angle), -np.sin(angle)], 1)
    points = (radius + out)[:, None] * away + [0, CENTER]
    return points, n_along[:, None] * down + n_out[:, None] * away


def _shell(mesh: Mesh, top: float, bottom: float, cut: tuple[float, float] | None) -> None:
    """From the polar angle `top` to `bottom`, degrees."""
    radius, middle = (OUTER + INNER) / 2, math.radians(top + bottom) / 2
    length, width = radius * math.radians(bottom - top) / 2, (OUTER - INNER) / 2
    steps = max(4, round(ALONG * (bottom - top) / 90))
    turns = (0.0, 2 * math.pi) if cut is None else (math.radians(cut[1]), math.radians(cut[0]) + 2 * math.pi)
    _lathe(mesh, *_bent(_band(length, width, EDGE, steps), middle, radius), *turns)
    if cut is None:
        return
    ease = EDGE * 0.8  # less than the corners have, so that none of them becomes a point
    for angle, side in ((turns[0], -1.0), (turns[1], 1.0)):
        across = np.array([math.cos(angle), 0, -math.sin(angle)]) * side
        rings, normals, charts = [], [], []
        for t in np.linspace(0, math.pi / 2, ROUND + 1):
            less = ease * (1 - math.cos(t))
            points, out = _bent(_band(length - less, width - less, EDGE - less, steps), middle, radius)
            rings.append(_turned(points, angle) + across * ease * math.sin(t))
            normals.append(_turned(out, angle) * math.cos(t) + across * math.sin(t))
            charts.append(points)
        mesh.add(*(np.pad(np.array(rows), ((0, 0), (0, 1), (0, 0)), "wrap") for rows in (rings, normals, charts)))
        half = len(rings[-1]) // 2  # the flat face, between the outer side and the inner
        face = np.stack([rings[-1][:half], rings[-1][: half - 1 : -1]])
        mesh.add(
            face, np.broadcast_to(across, face.shape), np.stack([charts[-1][:half], charts[-1][: half - 1 : -1]])
        )


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    """(distance from the axis, height) at an angle from +Z to +X -> (x, y, z)."""
    r, y = points[..., 0], points[..., 1]
    return np.stack([r * math.sin(angle), y, r * math.cos(angle)], axis=-1)


def _lathe(mesh: Mesh, points: np.ndarray, normals: np.ndarray, begin: float, end: float) -> None:
    """Turn a closed curve of (distance from the axis, height) about the axis, from one angle to the other."""
    points, normals = np.concatenate([points, points[:1]]), np.concatenate([normals, normals[:1]])
    angles = np.linspace(begin, end, round(AROUND * (end - begin) / (2 * math.pi)) + 1)
    path = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    u = np.broadcast_to((angles * OUTER)[:, None], (len(angles), len(points)))
    uvs = np.stack([u, np.broadcast_to(path, u.shape)], axis=-1)
    mesh.add(np.stack([_turned(points, a) for a in angles]), np.stack([_turned(normals, a) for a in angles]), uvs)


def _dish() -> Curve:
    """A thin sheet below the ball, which rises to a level rim."""
    near, far, thick = 0.02, 0.84, 0.012
    points, normals = _band((far - near) / 2, thick, thick * 0.98, 9)
    x = points[:, 0] + (near + far) / 2
    t = np.clip((x - 0.14) / 0.5, 0, 1)
    height, steep = FOOT + 0.17 * t * t * (3 - 2 * t), 0.17 * 6 * t * (1 - t) / 0.5
    length = np.sqrt(1 + steep**2)
    along, up = np.stack([1 / length, steep / length], 1), np.stack([-steep / length, 1 / length], 1)
    sheet = np.stack([x, height], 1) + points[:, 1:] * up
    return sheet, normals[:, :1] * along + normals[:, 1:] * up


def _slab(mesh: Mesh) -> None:
    """A square with rounded corners and edges, from the middle of its lower face up to that of its upper one."""
    half, corner, low, high, edge = 0.88, 0.2, 0.002, 0.15, 0.018
    quarter = np.linspace(0, math.pi / 2, 9)
    angles = np.concatenate([quarter + k * math.pi / 2 for k in range(4)] + [quarter[:1]])
    way = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=1)
    centers = np.repeat([[1, 0, 1], [1, 0, -1], [-1, 0, -1], [-1, 0, 1]], 9, axis=0) * (half - corner)
    centers = np.concatenate([centers, centers[:1]])
    rise = np.linspace(-math.pi / 2, 0, ROUND + 1)
    rings = [(corner - edge + edge * math.cos(t), low + edge + edge * math.sin(t), t) for t in rise]
    rings += [(r, low + high - y, -t) for r, y, t in reversed(rings)]
    points = [centers + r * way + [0, y, 0] for r, y, _ in rings]
    normals = [way * math.cos(t) + [0, math.sin(t), 0] for _, _, t in rings]
    for end in (0, -1):
        face = np.stack([points[end] * [0, 1, 0], points[end]])
        mesh.add(face, np.broadcast_to(normals[end], face.shape), face[:, :, ::2])
    path = np.cumsum([0.0] + [float(np.linalg.norm(b[0] - a[0])) for a, b in pairwise(points)])
    length = np.concatenate([[0.0], np.linalg.norm(np.diff(points[0], axis=0), axis=1).cumsum()])
    u, v = np.meshgrid(length, path)
    mesh.add(np.array(points), np.array(normals), np.stack([u, v], axis=-1))


# A torus knot: a smooth tube, closed on itself.
TURNS, TWISTS = 2, 3  # the trefoil
KNOT_ALONG, KNOT_AROUND = 512, 24  # 24 576 triangles: no facet shows at 1080p
RING, TUBE = 0.62, 0.21  # metres: of the torus, of the tube; the whole is about 2 m across and lies on y = 0
DEPTH = 0.30


def torus_knot() -> bytes:
    """A binary PLY with vertex normals, counter-clockwise from outside."""
    vertices, normals = _tube()
    vertices[:, 1] -= vertices[:, 1].min()
    names = ("x", "y", "z", "nx", "ny", "nz")
    return encode_ply(dict(zip(names, np.hstack([vertices, normals]).T, strict=True)), _knot_faces())


def _tube() -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(KNOT_ALONG) * (2 * math.pi / KNOT_ALONG)
    middle = _curve(t)
    # The frame of Frenet and Serret: a torus knot is nowhere straight, so it is smooth and closes without a twist.
    step = 1e-4
    tangent = _unit(_curve(t + step) - _curve(t - step))
    bend = _curve(t + step) - 2 * middle + _curve(t - step)
    inward = _unit(bend - tangent * (bend * tangent).sum(axis=1, keepdims=True))
    across = np.cross(tangent, inward)
    turn = np.arange(KNOT_AROUND) * (2 * math.pi / KNOT_AROUND)
    normals = np.cos(turn)[:, None] * inward[:, None] + np.sin(turn)[:, None] * across[:, None]
    return (middle[:, None] + TUBE * normals).reshape(-1, 3), normals.reshape(-1, 3)


def _curve(t: np.ndarray) -> np.ndarray:
    """Standing upright: the hole of the torus looks along z."""
    radius = RING + DEPTH * np.cos(TWISTS * t)
    return np.stack([radius * np.cos(TURNS * t), radius * np.sin(TURNS * t), DEPTH * np.sin(TWISTS * t)], axis=1)


def _unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


def _knot_faces() -> np.ndarray:
    i, j = np.meshgrid(np.arange(KNOT_ALONG), np.arange(KNOT_AROUND), indexing="ij")
    a, b = i * KNOT_AROUND + j, (i + 1) % KNOT_ALONG * KNOT_AROUND + j
    c, d = (i + 1) % KNOT_ALONG * KNOT_AROUND + (j + 1) % KNOT_AROUND, i * KNOT_AROUND + (j + 1) % KNOT_AROUND
    return np.stack([a, c, b, a, d, c], axis=-1).reshape(-1, 3)


# A cyclorama: a floor that rises to a wall without an edge, as photographers have it behind a product.
WIDTH, FRONT, BACK, BEND, HEIGHT = 20.0, 10.0, 4.4, 2.4, 5.0  # metres; the bend is a quarter circle of that radius
POOL = 3.4  # metres from the middle at which it reflects half as much, as if the lamp's light fell off


def cyclorama() -> bytes:
    """A binary PLY with normals and vertex colours: brightest in the middle, where its floor lies on y = 0."""
    turn = np.linspace(0, math.pi / 2, 13)
    floor = np.linspace(FRONT, BEND - BACK, 12, endpoint=False)
    wall = np.linspace(BEND, HEIGHT, 5)[1:]
    z = np.concatenate([floor, BEND - BACK - BEND * np.sin(turn), np.full(4, -BACK)])
    y = np.concatenate([np.zeros(12), BEND - BEND * np.cos(turn), wall])
    lean = np.concatenate([np.zeros(12), turn, np.full(4, math.pi / 2)])
    x = np.linspace(-1, 1, 17) ** 3 * WIDTH / 2  # closer together where the picture looks
    rows, columns = len(z), len(x)
    points = np.stack(np.broadcast_arrays(x, y[:, None], z[:, None]), axis=-1).reshape(-1, 3)
    normals = np.stack(np.broadcast_arrays(0.0 * x, np.cos(lean)[:, None], np.sin(lean)[:, None]), -1).reshape(-1, 3)
    light = 1 / (1 + ((points - [0, 0.4, 0]) ** 2).sum(axis=1) / POOL**2)
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    names = ("x", "y", "z", "nx", "ny", "nz", "red", "green", "blue")
    columns_ = np.hstack([points, normals, light[:, None].repeat(3, axis=1)]).round(6) + 0.0
    return encode_ply(dict(zip(names, columns_.T, strict=True)), faces)
