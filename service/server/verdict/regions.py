"""Where two pictures differ: the smallest regions that the tests found, and rectangles around those that are near."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from service.server.verdict.decision import Level
from service.server.verdict.evidence import Array, blocks

MOST = 64  # rectangles, those of the least p-values
CELLS = 256  # of a side, at most, of the grid on which near regions become one
STEPS = (-2, -1, 0, 1, 2)  # to cells that are near

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Region:
    """Pixels from the top left."""

    x: int
    y: int
    width: int
    height: int
    p_value: float


def p_map(levels: list[Level], shape: tuple[int, int], alpha: float) -> Array:
    """(height, width): p-values of the pixels in regions below `alpha`, and 1 elsewhere. A region that holds a
    smaller one below `alpha` says nothing of its other pixels."""
    out = np.ones(shape)
    for level in sorted(levels, key=lambda level: level.side):
        known = blocks((out < alpha).astype(np.float64), level.side)
        told = np.where((level.p < alpha) & (known == 0), level.p, 1.0)
        out = np.minimum(out, spread(told, level.side, shape))
    return out


def regions(p: Array, alpha: float) -> list[Region]:
    """Rectangles of the pixels of a `p_map` that are below `alpha`, the most certain first."""
    height, width = p.shape
    side = -(-max(height, width) // CELLS)
    below = blocks((p < alpha).astype(np.float64), side) > 0
    found = []
    for top, left, bottom, right in _connected(below):
        part = p[top * side : bottom * side, left * side : right * side]
        rows, columns = np.nonzero(part < alpha)
        y, x = top * side + int(rows.min()), left * side + int(columns.min())
        high, wide = int(np.ptp(rows)) + 1, int(np.ptp(columns)) + 1
        found.append(Region(x, y, wide, high, float(part.min())))
    return sorted(found, key=lambda region: region.p_value)[:MOST]


def spread(values: Array, side: int, shape: tuple[int, int]) -> Array:
    """The value of each pixel's block."""
    return np.repeat(np.repeat(values, side, axis=0), side, axis=1)[: shape[0], : shape[1]]


def _connected(cells: Mask) -> Iterator[tuple[int, int, int, int]]:
    """First and last (exclusive) rows and columns of each group of cells between which there are gaps of one cell at
    most: within an object that changed some pixels are not certain."""
    left = {(int(y), int(x)) for y, x in np.argwhere(cells)}
    while left:
        group = [left.pop()]
        for y, x in group:
            near = {(y + dy, x + dx) for dy in STEPS for dx in STEPS} & left
            left -= near
            group += near
        rows, columns = [y for y, _ in group], [x for _, x in group]
        yield min(rows), min(columns), max(rows) + 1, max(columns) + 1
