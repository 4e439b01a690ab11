"""Environments blurred over the sphere, before anything is drawn from them."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from gpu.tables.alias_table import cube_solid_angles, solid_angles

MOST_WIDTH = 2048  # texels of a blurred picture, twice as wide as high: the most costly blur takes some seconds
LEAST_WIDTH = 64  # texels; the rows of a coarser picture would blur more than requested
# The least number of texels of a standard deviation: bilinear filtering then errs by less than 1 % of a peak.
PER_BLUR = 4
REACH = 6  # standard deviations: there the kernel is 2e-8 of its peak, which hides the light of any sun
LEAST = 1e-14  # of a frequency, which is as much as rounding leaves of it
# Face -> directions at its middle, along s to the right and along t down, where s and t go from -1 to 1.
CUBE_FACES = {
    "px": ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    "nx": ((-1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "py": ((0, 1, 0), (1, 0, 0), (0, 0, 1)),
    "ny": ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    "pz": ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
    "nz": ((0, 0, -1), (-1, 0, 0), (0, -1, 0)),
}


def blur_image(texels: np.ndarray, degrees: float) -> np.ndarray:
    """A latitude-longitude map (h, w, 3) blurred over the sphere: (H, W, 3) float32, H <= h, W <= w.

    The kernel is the von Mises-Fisher density of concentration 1 / blur^2, the counterpart on a sphere of a Gaussian
    of that standard deviation. The result has as few texels as its detail needs, at most MOST_WIDTH across: a
    power of two unless that is more than w, as kernels are compiled anew where it becomes or ceases to be one.
    """
    height, width = texels.shape[:2]
    wanted = _width(degrees)
    shape = min(height, wanted // 2), min(width, wanted)
    solid = solid_angles(height, width)[:, None]
    if shape == (height, width):
        whole = np.empty((height, width, 4))
        whole[..., :3], whole[..., 3] = texels * solid[..., None], solid
        return _convolved(whole, math.radians(degrees))
    rows = (_weighted(texels[i : i + 1], solid[i : i + 1]) for i in range(height))
    return _convolved(_reduced(rows, height, shape), math.radians(degrees))


def blur_cube(faces: list[np.ndarray], degrees: float) -> np.ndarray:
    """Six faces (n, n, 3) in the order of CUBE_FACES, blurred: a latitude-longitude map (H, 2 H, 3) float32."""
    n = faces[0].shape[0]
    width = min(4 * max(n, 2), _width(degrees))
    height = width // 2
    # Each texel counts as a whole for the place of its middle: texels half as large as those of the map are small
    # enough.
    side = min(n, height)
    each = -(-width // (2 * side))
    sums = np.zeros((height * width, 4))
    solid = cube_solid_angles(n)
    for (ahead, right, down), face in zip(CUBE_FACES.values(), faces, strict=True):
        rows = (_weighted(face[i : i + 1], solid[i : i + 1]) for i in range(n))
        parts = np.repeat(np.repeat(_reduced(rows, n, (side, side)), each, axis=0), each, axis=1) / each**2
        s = (2 * np.arange(side * each) + 1) / (side * each) - 1
        d = np.array(ahead) + np.multiply.outer(s, down)[:, None] + np.multiply.outer(s, right)
        d /= np.linalg.norm(d, axis=2, keepdims=True)
        u = 0.5 + np.arctan2(d[..., 0], -d[..., 2]) / (2 * math.pi)
        v = np.arccos(np.clip(d[..., 1], -1, 1)) / math.pi
        place = np.minimum(v * height, height - 1).astype(np.intp) * width
        place += np.minimum(u * width, width - 1).astype(np.intp)
        for k in range(4):
            sums[:, k] += np.bincount(place.ravel(), parts[..., k].ravel(), height * width)
    # Some texels of the map contain no middle of a texel of the cube: the kernel must reach them from their
    # neighbours.
    return _convolved(sums.reshape(height, width, 4), max(math.radians(degrees), math.pi / height))


def _width(degrees: float) -> int:
    texels = 2 * math.ceil(PER_BLUR * 180 / degrees)
    return min(MOST_WIDTH, max(LEAST_WIDTH, 1 << (texels - 1).bit_length()))


def _weighted(row: np.ndarray, solid: np.ndarray) -> np.ndarray:
    """(1, w, 3) radiance and (1, w or 1) solid angles -> (w, 4): light, and the solid angle that it comes through."""
    out = np.ones((row.shape[1], 4))
    out[:, :3] = row[0]
    out *= solid[0][:, None]
    return out


def _reduced(rows: Iterable[np.ndarray], count: int, shape: tuple[int, int]) -> np.ndarray:
    """`count` rows (w, 4) summed into a grid of `shape`; a texel across an edge of the grid is divided by length."""
    height, width = shape
    out = np.zeros((height, width, 4))
    for i, row in enumerate(rows):
        if len(row) % width == 0:
            row = row.reshape(width, -1, 4).sum(axis=1)
        else:
            total = np.concatenate([np.zeros((1, 4)), np.cumsum(row, axis=0)])
            edge = np.linspace(0, len(row), width + 1)
            left = np.minimum(edge.astype(np.intp), len(row) - 1)
            row = np.diff(total[left] + (edge - left)[:, None] * row[left], axis=0)
        top, bottom = i * height / count, (i + 1) * height / count
        first, last = int(top), min(int(bottom), height - 1)
        share = 1.0 if first == last else (last - top) / (bottom - top)
        out[first] += share * row
        if share < 1.0:
            out[last] += (1.0 - share) * row
    return out


def _convolved(sums: np.ndarray, blur: float) -> np.ndarray:
    """Light and solid angles (h, w, 4), `blur` in radians -> radiance (h, w, 3) float32.

    Rotations about the axis leave the kernel as it is, so that in longitude the convolution is a product of spectra;
    in latitude it is a sum over the rows within reach.
    """
    height, width = sums.shape[:2]
    count = _frequencies(width, blur)
    points = min(width, -(-2 * count // 16) * 16)  # of a kernel, to tell its frequencies apart
    spectrum = np.fft.rfft(sums, axis=1)[:, :count].view(np.float64)  # (h, count, 4 real and imaginary parts)
    # For rows below the equator the same kernels serve, upside down: (count, 16, h), with those beside the others.
    both = np.concatenate([spectrum, spectrum[::-1]], axis=2).transpose(1, 2, 0).copy()
    polar = (np.arange(height) + 0.5) * (math.pi / height)
    around = 2 * np.sin(np.arange(points // 2 + 1) * (math.pi / points)) ** 2  # symmetric, as the kernel is: one half
    reach = math.ceil(REACH * blur / (math.pi / height))
    out = np.empty((height, width, 3), np.float32)
    for i in range((height + 1) // 2):
        first, last = max(0, i - reach), min(height, i + reach + 1)
        near = polar[first:last]
        # 1 - cos of the angle between two directions, in a form that does not cancel.
        apart = 2 * np.sin((polar[i] - near) / 2) ** 2
        apart = apart[:, None] + math.sin(polar[i]) * np.sin(near)[:, None] * around
        kernel = np.fft.hfft(np.exp(apart / -(blur**2)), points, axis=1)[:, :count]
        product = np.matmul(both[:, :, first:last], kernel.T[:, :, None].copy())[..., 0]
        light = np.fft.irfft(product.view(np.complex128), width, axis=0)  # (width, 8)
        out[i] = light[:, :3] / light[:, 3:4]
        out[height - 1 - i] = light[:, 4:7] / light[:, 7:]
    return np.maximum(out, 0)  # light that a transform leaves below 0 is its rounding, 1e-14 of the brightest


def _frequencies(width: int, blur: float) -> int:
    """How many frequencies about the axis the kernel leaves: those that it takes to LEAST are not computed. They are
    most at the equator."""
    around = 2 * np.sin(np.arange(width) * (math.pi / width)) ** 2
    left = np.fft.rfft(np.exp(-around / blur**2)).real
    faint = np.flatnonzero(left < LEAST * left[0])
    return int(faint[0]) if len(faint) else len(left)
