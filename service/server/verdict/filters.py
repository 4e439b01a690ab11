"""Convolution with a product of a row and a column, the picture's edge being repeated beyond it."""

from __future__ import annotations

import numpy as np

from service.server.verdict.evidence import Array


def convolved(values: Array, across: Array, down: Array) -> Array:
    """(height, width) values, each neighbour weighed by the product; both have an odd number of weights."""
    return _along(_along(values, across, 1), down, 0)


def gaussian(sigma: float, radius: int) -> Array:
    """Weights from -radius to radius, the middle one being 1."""
    x = np.arange(-radius, radius + 1)
    return np.asarray(np.exp(-0.5 * (x / sigma) ** 2))


def _along(values: Array, weights: Array, axis: int) -> Array:
    radius, count = len(weights) // 2, values.shape[axis]
    widths = [(radius, radius) if each == axis else (0, 0) for each in range(values.ndim)]
    padded = np.pad(values, widths, mode="edge")
    out = np.zeros_like(values)
    for k, weight in enumerate(weights):
        shifted = padded[k : k + count] if axis == 0 else padded[:, k : k + count]
        out += weight * shifted
    return out
