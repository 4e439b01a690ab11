"""A cyclorama: a floor that rises to a wall without an edge, as photographers have it behind a product."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets import ply

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
    return ply.encode(dict(zip(names, columns_.T, strict=True)), faces)
