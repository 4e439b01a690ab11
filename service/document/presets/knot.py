"""A torus knot: a smooth tube, closed on itself, as a mesh."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets import ply

TURNS, TWISTS = 2, 3  # the trefoil
ALONG, AROUND = 512, 24  # 24 576 triangles: no facet shows at 1080p
RING, TUBE = 0.62, 0.21  # metres: of the torus, of the tube; the whole is about 2 m across and lies on y = 0
DEPTH = 0.30


def torus_knot() -> bytes:
    """A binary PLY with vertex normals, counter-clockwise from outside."""
    vertices, normals = _tube()
    vertices[:, 1] -= vertices[:, 1].min()
    names = ("x", "y", "z", "nx", "ny", "nz")
    return ply.encode(dict(zip(names, np.hstack([vertices, normals]).T, strict=True)), _faces())


def _tube() -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(ALONG) * (2 * math.pi / ALONG)
    middle = _curve(t)
    # The frame of Frenet and Serret: a torus knot is nowhere straight, so it is smooth and closes without a twist.
    step = 1e-4
    tangent = _unit(_curve(t + step) - _curve(t - step))
    bend = _curve(t + step) - 2 * middle + _curve(t - step)
    inward = _unit(bend - tangent * (bend * tangent).sum(axis=1, keepdims=True))
    across = np.cross(tangent, inward)
    turn = np.arange(AROUND) * (2 * math.pi / AROUND)
    normals = np.cos(turn)[:, None] * inward[:, None] + np.sin(turn)[:, None] * across[:, None]
    return (middle[:, None] + TUBE * normals).reshape(-1, 3), normals.reshape(-1, 3)


def _curve(t: np.ndarray) -> np.ndarray:
    """Standing upright: the hole of the torus looks along z."""
    radius = RING + DEPTH * np.cos(TWISTS * t)
    return np.stack([radius * np.cos(TURNS * t), radius * np.sin(TURNS * t), DEPTH * np.sin(TWISTS * t)], axis=1)


def _unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


def _faces() -> np.ndarray:
    i, j = np.meshgrid(np.arange(ALONG), np.arange(AROUND), indexing="ij")
    a, b = i * AROUND + j, (i + 1) % ALONG * AROUND + j
    c, d = (i + 1) % ALONG * AROUND + (j + 1) % AROUND, i * AROUND + (j + 1) % AROUND
    return np.stack([a, c, b, a, d, c], axis=-1).reshape(-1, 3)
