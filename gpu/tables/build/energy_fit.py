"""Values on a grid whose linear interpolation follows a function closely, and stays above it nearly everywhere.

They are fitted by asymmetric least squares [Newey & Powell 1987, "Asymmetric least squares estimation and testing"]:
an error below the function by more than a margin counts a hundredfold. Values of the function itself interpolate to
one side of it wherever it is curved; the fit lets them err to both. Runs without GL.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# Places in each cell, as fractions of each axis' step, and the function there. A fraction of 0 stands for all nodes
# of its axis.
Samples = Sequence[tuple[np.ndarray, np.ndarray]]

_WEIGHT = 100.0  # weight of errors below the margin
_STEPS = 40  # twice as many change the error's root mean square by 0.1 %


def _sides(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    before = (slice(None),) * axis
    return (*before, slice(0, -1)), (*before, slice(1, None))


def between(nodes: np.ndarray, f: np.ndarray) -> np.ndarray:
    """`nodes` interpolated at the fractions `f` of every cell."""
    for axis, x in enumerate(f):
        if x > 0:
            low, high = _sides(axis)
            nodes = nodes[low] * nodes.dtype.type(1 - x) + nodes[high] * nodes.dtype.type(x)
    return nodes


def _spread(values: np.ndarray, f: np.ndarray, largest: bool = False) -> np.ndarray:
    """For each node the sum of `values` with the weights that `between` gives it, or the largest value around it."""
    for axis, x in enumerate(f):
        if x > 0:
            low, high = _sides(axis)
            shape = [n + (k == axis) for k, n in enumerate(values.shape)]
            out = np.zeros(shape, values.dtype)
            if largest:
                out[low] = values
                out[high] = np.maximum(out[high], values)
            else:
                out[low] += values * values.dtype.type(1 - x)
                out[high] += values * values.dtype.type(x)
            values = out
    return values


def fitted(nodes: np.ndarray, samples: Samples, margin: float) -> np.ndarray:
    """Values in 0..1, starting from `nodes`, that interpolate to `samples` and are seldom more than `margin` below.

    Each step goes to the minimum of a separable bound from above, so none makes the sum of squares larger.
    """
    weight = nodes.dtype.type(_WEIGHT)
    for _ in range(_STEPS):
        pull, share = np.zeros_like(nodes), np.zeros_like(nodes)
        for f, wanted in samples:
            error = between(nodes, f) - wanted
            lack = np.minimum(error + nodes.dtype.type(margin), 0)
            pull += _spread(error + weight * lack, f)
            share += _spread(1 + weight * (lack < 0), f)
        nodes = np.clip(nodes - pull / share, 0, 1)
    return nodes


def raised(nodes: np.ndarray, samples: Samples, slack: float) -> np.ndarray:
    """Values that interpolate nowhere below `samples` less `slack`."""
    for f, wanted in samples:
        lack = np.clip(wanted - nodes.dtype.type(slack) - between(nodes, f), 0, None)
        nodes = np.minimum(nodes + _spread(lack, f, largest=True), 1)
    return nodes
