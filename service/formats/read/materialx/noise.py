"""The standard library's noises, lattice points hashed as Jenkins' `lookup3` does [Gritz et al., oslnoise.h; Perlin
2002; Worley 1996], for arrays of points. `tests/service/formats/test_materialx_glsl.py` compares them with the
library's own GLSL.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

Words = npt.NDArray[np.uint32]
Points = npt.NDArray[np.float32]  # (n, 2) or (n, 3)

SEED = 0xDEADBEEF
SCALES = {2: 0.6616, 3: 0.9820}  # bring Perlin's gradients to -1..1
OFFSETS = {2: (19.0, 193.0), 3: (19.0, 193.0, 17.0)}  # from the first number of a vector to the next, of fractals
PLAIN_OFFSETS = {2: (19.0, 73.0), 3: (19.0, 73.0, 29.0)}  # the same of one octave
MOST_OCTAVES = 16


def _rotated(x: Words, k: int) -> Words:
    return (x << np.uint32(k)) | (x >> np.uint32(32 - k))


def _final(a: Words, b: Words, c: Words) -> Words:
    c = (c ^ b) - _rotated(b, 14)
    a = (a ^ c) - _rotated(c, 11)
    b = (b ^ a) - _rotated(a, 25)
    c = (c ^ b) - _rotated(b, 16)
    a = (a ^ c) - _rotated(c, 4)
    b = (b ^ a) - _rotated(a, 14)
    return (c ^ b) - _rotated(b, 24)


def _mixed(a: Words, b: Words, c: Words) -> tuple[Words, Words, Words]:
    for first, second, third in ((4, 6, 8), (16, 19, 4)):
        a = (a - c) ^ _rotated(c, first)
        c = c + b
        b = (b - a) ^ _rotated(a, second)
        a = a + c
        c = (c - b) ^ _rotated(b, third)
        b = b + a
    return a, b, c


def hashed(*cells: npt.NDArray[Any]) -> Words:
    """The hash of two to four whole numbers for each lattice point."""
    seed = np.uint32((SEED + (len(cells) << 2) + 13) & 0xFFFFFFFF)
    words = [np.asarray(cell, np.int64).astype(np.uint32) for cell in cells]
    a, b, c = (words[k] + seed if k < len(words) else np.full_like(words[0], seed) for k in range(3))
    if len(words) > 3:
        a, b, c = _mixed(a, b, c)
        a = a + words[3]
    return _final(a, b, c)


def _floored(p: Points) -> tuple[npt.NDArray[np.int64], Points]:
    low = np.floor(p)
    # Beyond the range of an int the shader's result is undefined; there is no pattern so far out.
    return np.clip(low, -(2.0**30), 2.0**30).astype(np.int64), p - low


def _gradient(hash: Words, at: list[Points]) -> Points:
    x, y = at[0], at[1]
    if len(at) == 2:
        h = hash & 7
        u, v = np.where(h < 4, x, y), 2 * np.where(h < 4, y, x)
    else:
        h = hash & 15
        u = np.where(h < 8, x, y)
        v = np.where(h < 4, y, np.where((h == 12) | (h == 14), x, at[2]))
    return np.where(h & 1, -u, u) + np.where(h & 2, -v, v)


def perlin(p: Points, shift: int = 0, is_vector: bool = False) -> Points:
    """(n,) gradient noise; of a vector the number whose hash is shifted by so many bits."""
    cell, f = _floored(p)
    fade = f * f * f * (f * (f * 6 - 15) + 10)
    size = p.shape[1]
    total = np.zeros(len(p), np.float32)
    for corner in product((0, 1), repeat=size):
        hash = hashed(*(cell[:, k] + corner[k] for k in range(size)))
        if is_vector:
            hash = (hash >> np.uint32(shift)) & np.uint32(0xFF)
        weight = np.ones(len(p), np.float32)
        for k in range(size):
            weight = weight * (fade[:, k] if corner[k] else 1 - fade[:, k])
        total += weight * _gradient(hash, [f[:, k] - corner[k] for k in range(size)])
    return np.asarray(total * np.float32(SCALES[size]), np.float32)


def vectors(p: Points, size: int, offsets: dict[int, tuple[float, ...]], one: Callable[..., Points]) -> Points:
    """(n, size) by `one`, which gives a number for each point."""
    far = p + np.array(offsets[p.shape[1]], np.float32)
    if size == 1:
        parts = [one(p)]
    elif size == 2:
        parts = [one(p), one(far)]
    else:
        parts = [one(p, shift, True) for shift in (0, 8, 16)] + ([one(far)] if size == 4 else [])
    return np.stack(parts, axis=-1)


def noise(p: Points, size: int) -> Points:
    """(n, size) one octave; two numbers are the first of three, other than of a fractal."""
    return vectors(p, 3, PLAIN_OFFSETS, perlin)[:, :2] if size == 2 else vectors(p, size, PLAIN_OFFSETS, perlin)


def fractal(p: Points, size: int, octaves: int, lacunarity: Points, diminish: Points) -> Points:
    """A sum of octaves; `lacunarity` and `diminish` are (n, 1) or (1, 1)."""

    def one(p: Points, shift: int = 0, is_vector: bool = False) -> Points:
        total, amplitude = np.zeros(len(p), np.float32), np.ones((1,), np.float32)
        for _ in range(min(octaves, MOST_OCTAVES)):
            total = total + amplitude * perlin(p, shift, is_vector)
            amplitude = amplitude * diminish[:, 0]
            p = p * lacunarity
        return total

    return vectors(p, size, OFFSETS, one)


def cells(p: Points, size: int = 1) -> Points:
    """(n, size) numbers in 0..1 for each cell."""
    low = _floored(p)[0].T
    if size == 1:
        return _unit(hashed(*low))[:, None]
    return np.stack([_unit(hashed(*low, np.full_like(low[0], k))) for k in range(size)], axis=-1)


def _unit(hash: Words) -> Points:
    return np.asarray(hash / np.float32(0xFFFFFFFF), np.float32)


def worley(p: Points, size: int, jitter: Points, is_cell: bool) -> Points:
    """(n, size) the distances to the nearest points, of which each cell has one; or the numbers of the nearest's."""
    cell, f = _floored(p)
    dimensions = p.shape[1]
    far, nearest = np.full((len(p), size), 1e6, np.float32), np.zeros_like(p)
    for around in product((-1, 0, 1), repeat=dimensions):
        neighbour = [cell[:, k] + around[k] for k in range(dimensions)]
        off = np.stack([_unit(hashed(*neighbour, np.full_like(neighbour[0], k))) for k in range(dimensions)], axis=-1)
        away = np.array(around, np.float32) + (off - 0.5) * jitter + 0.5 - f
        square = np.einsum("nk,nk->n", away, away)
        nearest = np.where((square < far[:, 0])[:, None], away, nearest)
        far = np.sort(np.column_stack([far, square]), axis=1)[:, :size].astype(np.float32)
    return cells(nearest + p, size) if is_cell else np.sqrt(far)
