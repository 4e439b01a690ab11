"""A tree in winter: branches of branches, as tubes that grow thinner."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.mesh import Mesh

TALL, THICK = 1.5, 0.15  # length and radius of the trunk, in metres; the whole is three times as high
LEVELS, AROUND = 6, 7  # of branching; sides of a tube
SHORTER, THINNER = 0.76, 0.66  # what a branch keeps of its parent's length and radius


def bare_tree() -> bytes:
    mesh = Mesh()
    _grow(mesh, np.random.default_rng(17), np.zeros(3), np.array([0.03, 1.0, 0.0]), TALL, THICK, LEVELS)
    return mesh.file()


def _grow(
    mesh: Mesh,
    draw: np.random.Generator,
    start: np.ndarray,
    way: np.ndarray,
    length: float,
    radius: float,
    level: int,
) -> None:
    way = way / np.linalg.norm(way)
    bend = np.cross(way, draw.normal(size=3))
    t = np.linspace(0, 1, 4)[:, None]
    middle = start + length * (t * way + 0.12 * t * (1 - t) * bend)
    side = np.cross(way, [0.0, 0.0, 1.0] if abs(way[2]) < 0.8 else [1.0, 0, 0])
    side /= np.linalg.norm(side)
    turn = np.linspace(0, 2 * math.pi, AROUND + 1)[:, None]
    out = np.cos(turn) * side + np.sin(turn) * np.cross(way, side)
    out[-1] = out[0]
    grid = middle[:, None] + out * (radius * (1 - (1 - THINNER) * t))[:, None]
    mesh.add(grid, np.broadcast_to(out, grid.shape), np.stack(np.broadcast_arrays(turn[:, 0], t * length), axis=-1))
    if level == 0:
        return
    for k in range(3 if level in (LEVELS, 3) else 2):
        angle = 2.4 * k + draw.uniform(0, 2 * math.pi)
        spread = draw.uniform(0.35, 0.75)
        around = math.cos(angle) * side + math.sin(angle) * np.cross(way, side)
        ahead = way * math.cos(spread) + around * math.sin(spread) + np.array([0, 0.12, 0])
        _grow(mesh, draw, middle[-1], ahead, length * SHORTER * draw.uniform(0.75, 1.1), radius * THINNER, level - 1)
