"""Mip levels of images: each texel of a level is the mean of the light that its share of the image gives.

Bytes are averaged as what they decode to, and each level comes from unrounded numbers. A normal map's texels are
averaged as unit vectors: the mean's direction is stored, and in alpha what was lost of the normals' spread.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gpu.jit import jit
from gpu.layout.texture_records import Texels, level_sizes

MOST_OVERLAP = 4  # texels that one of the first level overlaps along a side: its ratio is at most 2 sqrt(2)
GUESSES = 4096  # entries of the table in which the search for a byte begins; sRGB has at most 3 295 bytes per unit


def mip_levels(image: np.ndarray, kind: Texels) -> Iterator[np.ndarray]:
    """The levels from the first one below the image: (h, w, 4), uint8 or float32 as the image (height, width, 4)."""
    is_8bit, normals = image.dtype == np.uint8, kind is Texels.NORMALS
    level = image
    for k, (width, height) in enumerate(level_sizes(image.shape[1], image.shape[0])):
        if k > 0:
            level = _halved(_halved(level, 0, height), 1, width)
        elif is_8bit:
            level = np.empty((height, width, 4), np.float32)
            _reduce_bytes(image, _tables(kind), normals, level)
        else:
            level = _shrunk(_shrunk(_unit(image) if normals else image, 0, height), 1, width)
        stored = _with_spread(level) if normals else level
        yield _to_bytes(stored, kind is Texels.SRGB) if is_8bit else stored


def _halved(level: np.ndarray, axis: int, size: int) -> np.ndarray:
    """The level with `size` texels along an axis, where it has that many or twice as many."""
    if level.shape[axis] == size:
        return level
    even, odd = (level[k::2] if axis == 0 else level[:, k::2] for k in (0, 1))
    return np.asarray(np.float32(0.5) * (even + odd))


def _shrunk(level: np.ndarray, axis: int, size: int) -> np.ndarray:
    """An image of floats averaged down to `size` texels along an axis."""
    count = level.shape[axis]
    edges = np.arange(size + 1) * (count / size)
    first = np.floor(edges[:-1]).astype(np.int64)
    out = np.zeros([size if k == axis else n for k, n in enumerate(level.shape)], np.float32)
    for k in range(MOST_OVERLAP):
        low = np.maximum(first + k, edges[:-1])
        share = np.clip(np.minimum(first + k + 1, edges[1:]) - low, 0, 1) * (size / count)
        shape = [-1 if each == axis else 1 for each in range(3)]
        out += share.reshape(shape).astype(np.float32) * np.take(level, np.minimum(first + k, count - 1), axis)
    return out


def _unit(image: np.ndarray) -> np.ndarray:
    """The unit vectors of a normal map of floats; alpha stays."""
    out = np.array(image, np.float32)
    out[..., :3] = 2 * out[..., :3] - 1
    out[..., :3] /= np.sqrt(np.maximum((out[..., :3] ** 2).sum(axis=-1, keepdims=True), 1e-12))
    return out


def srgb_of_bytes() -> np.ndarray:
    """(256,) float64 linear values [IEC 61966-2-1]."""
    x = np.arange(256) / 255
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def _tables(kind: Texels) -> np.ndarray:
    """(4, 256) float32: what the bytes of each channel stand for."""
    tables = np.tile(np.arange(256) / 255, (4, 1))
    if kind is Texels.SRGB:
        tables[:3] = srgb_of_bytes()
    if kind is Texels.NORMALS:
        tables[:3] = 2 * tables[:3] - 1
    return tables.astype(np.float32)


@jit
def _with_spread(means: np.ndarray) -> np.ndarray:
    """Normals as their map has them, and the root of the variance of their slopes along one axis [Toksvig 2005]."""
    out = np.empty_like(means)
    for y in range(means.shape[0]):
        for x in range(means.shape[1]):
            u, v, w = means[y, x, 0], means[y, x, 1], means[y, x, 2]
            length = np.sqrt(u * u + v * v + w * w)
            scale = np.float32(0.5) / max(length, np.float32(1e-6))
            out[y, x, 0] = np.float32(0.5) + scale * u
            out[y, x, 1] = np.float32(0.5) + scale * v
            out[y, x, 2] = np.float32(0.5) + scale * w
            lost = 2 * scale * max(np.float32(1) - length, np.float32(0))
            out[y, x, 3] = np.sqrt(min(lost, np.float32(1)))
    return out


def _to_bytes(values: np.ndarray, srgb: bool) -> np.ndarray:
    out = np.empty(values.shape, np.uint8)
    if not srgb:
        np.rint(values * np.float32(255), out=out, casting="unsafe")
        return out
    # A byte stands for all that is nearer to it than to others, as a viewer sees nearness: in sRGB.
    x = (np.arange(255) + 0.5) / 255
    limits = np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)
    first = np.searchsorted(limits, np.arange(GUESSES) / GUESSES).astype(np.uint8)
    _encode(values, limits, first, out)
    return out


@jit
def _encode(values: np.ndarray, limits: np.ndarray, first: np.ndarray, out: np.ndarray) -> None:
    for y in range(values.shape[0]):
        for x in range(values.shape[1]):
            for c in range(3):
                v = min(max(values[y, x, c], np.float32(0)), np.float32(1))
                at = int(first[min(int(v * GUESSES), GUESSES - 1)])
                while at < 255 and v > limits[at]:
                    at += 1
                out[y, x, c] = at
            out[y, x, 3] = np.uint8(values[y, x, 3] * np.float32(255) + np.float32(0.5))


@jit
def _reduce_bytes(image: np.ndarray, tables: np.ndarray, normals: bool, out: np.ndarray) -> None:
    height, width = image.shape[:2]
    rows, columns = out.shape[:2]
    step_y, step_x = height / rows, width / columns
    for j in range(rows):
        top, bottom = j * step_y, min((j + 1) * step_y, float(height))
        for i in range(columns):
            left, right = i * step_x, min((i + 1) * step_x, float(width))
            r = g = b = a = total = np.float32(0)
            y = int(top)
            while y < bottom:
                tall = np.float32(min(bottom, y + 1.0) - max(top, float(y)))
                x = int(left)
                while x < right:
                    weight = tall * np.float32(min(right, x + 1.0) - max(left, float(x)))
                    u, v, w = tables[0, image[y, x, 0]], tables[1, image[y, x, 1]], tables[2, image[y, x, 2]]
                    scale = weight
                    if normals:
                        scale = weight / np.sqrt(max(u * u + v * v + w * w, np.float32(1e-12)))
                    r += scale * u
                    g += scale * v
                    b += scale * w
                    a += weight * tables[3, image[y, x, 3]]
                    total += weight
                    x += 1
                y += 1
            out[j, i, 0], out[j, i, 1], out[j, i, 2], out[j, i, 3] = r / total, g / total, b / total, a / total
