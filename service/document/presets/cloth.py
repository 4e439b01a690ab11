"""Linen: a cloth with a few soft folds, and the picture of its weave."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets import exr
from service.document.presets.mesh import Mesh, bent_normals, waves

HALF, STEPS = 9.0, 96  # metres from the middle to the edges; squares along an edge
THREADS, TEXELS = 16, 256  # of a tile of the weave, along each side


def linen_cloth() -> bytes:
    """A binary PLY, flat near the middle, where its highest point lies on y = 0; coordinates are metres."""
    mesh = Mesh()
    x = np.linspace(-1, 1, STEPS + 1)
    side = HALF * (0.25 * x + 0.75 * x**3)  # closer together where the picture looks
    xx, zz = np.meshgrid(side, side, indexing="ij")
    grid = np.stack([xx, np.zeros_like(xx), zz], axis=-1)
    far = np.hypot(xx, zz)
    folds = 0.045 * waves(grid * [0.7, 1, 1.5], 11, 1.1, 16) * np.clip((far - 0.5) / 1.2, 0, 1) ** 2
    grid[..., 1] = folds - np.maximum(folds.max(), 0) * np.clip((far - 0.5) / 1.2, 0, 1) ** 2
    mesh.add(grid, bent_normals(grid, np.broadcast_to([0.0, 1, 0], grid.shape)), grid[..., [0, 2]])
    return mesh.file()


def linen_weave() -> bytes:
    """A tile that repeats: threads over and under one another, uneven as flax is, lighter where they are higher."""
    draw = np.random.default_rng(3)
    t = (np.arange(TEXELS) + 0.5) / TEXELS * THREADS
    thick = 1 + 0.22 * draw.normal(size=(2, THREADS))
    tone = 1 + 0.05 * draw.normal(size=(2, THREADS))
    warp, weft = np.meshgrid(t, t, indexing="ij")
    i, j = warp.astype(int), weft.astype(int)
    over = (i + j) % 2 == 0

    def thread(across: np.ndarray, along: np.ndarray, fat: np.ndarray) -> np.ndarray:
        round_ = np.clip(1 - ((across % 1 - 0.5) * 2 / fat) ** 2, 0, 1) ** 0.5
        return np.asarray(round_ * (0.55 + 0.45 * np.sin(math.pi * (along % 1))))

    one, two = thread(warp, weft, thick[0][i]), thread(weft, warp, thick[1][j])
    height = np.where(over, np.maximum(one, 0.5 * two), np.maximum(two, 0.5 * one))
    color = (0.62 + 0.38 * height) * np.where(over, tone[0][i], tone[1][j])
    return exr.encode(np.clip(color, 0, 1)[..., None] * np.array([1.0, 0.985, 0.955]))
