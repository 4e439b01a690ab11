"""A map of weights -> cells of equal probability, from which directions of an environment are drawn.

An alias table draws texels exactly by weight but scatters neighbouring numbers over the whole map, which loses the
gain of a stratified sampler. Here the cells follow Morton's curve, so that near numbers draw near places: 16 samples
of a softly lit matte sphere have a third of the variance, and more samples gain more. Runs without GL.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gpu.layout import EnvironmentCell

CELLS_A_TEXEL = 4  # a block's probability is a whole number of cells: with 4 its error is some percent
FEWEST_CELLS, MOST_CELLS = 1 << 14, 1 << 20  # bounds; large maps have more texels than a pixel gets samples
FINEST = 1 << 22  # most blocks; a larger map is not halved down to its texels
CONTRAST = 4.0  # a block with a texel this many times its mean is halved ...
FAINT = 1 / 64  # ... unless its whole weight is less than this share of a cell's


def draw_cells(
    maps: list[np.ndarray], corners: list[tuple[int, int]], rows: list[np.ndarray]
) -> tuple[np.ndarray, list[np.ndarray]]:
    """(`layout.EnvironmentCell` (k,), density at each texel of each map, (h, w) float64) for weights (h, w), h and w
    <= 16384: finite, >= 0, not all 0. Densities are per unit of what a texel measures, for each row in `rows` (h,).
    Cells name texels of one picture, in which the maps have their `corners`, (x, y).

    Each map is halved until a block is a texel (or there are FINEST) or its share of the weight is that of a cell or
    less; a block gets as many cells as its share is worth, at least one, and is drawn uniformly over its area. Cells
    lie in the order of the maps, those of a map along Morton's curve. Texels of weight above 0 can all be drawn.
    """
    total = sum(float(m.max()) for m in maps)
    # Scaled first, or the sum of tiny weights would be denormal
    scaled = [np.asarray(m, np.float64) / total for m in maps]
    wanted = min(max(CELLS_A_TEXEL * sum(m.size for m in maps), FEWEST_CELLS), MOST_CELLS)
    cell = sum(float(m.sum()) for m in scaled) / wanted  # the weight of a cell
    blocks = [_blocks(m, cell) for m in scaled]
    counts = [np.maximum(1, np.rint(b.weight / cell)).astype(np.int64) for b in blocks]
    number = sum(int(c.sum()) for c in counts)
    records, densities, first = [], [], 0
    for m, (x, y), row, b, n in zip(maps, corners, rows, blocks, counts, strict=True):
        ends = first + np.cumsum(n)
        record = np.zeros(len(n), EnvironmentCell.dtype)
        record["corner"], record["size"] = (b.x + x) | (b.y + y) << 16, b.width | b.height << 16
        record["first"], record["count"] = ends - n, n
        records.append(np.repeat(record, n))
        first += int(n.sum())
        upto = np.concatenate([[0.0], np.cumsum(row)])
        measure = b.width * (upto[b.y + b.height] - upto[b.y])
        densities.append(_painted(m.shape, b, n / number / measure))
    return np.concatenate(records), densities


class _Blocks(NamedTuple):
    """Arrays over k blocks of one map, in texels. Records would take ten times as long to put in order."""

    x: np.ndarray
    y: np.ndarray
    width: np.ndarray
    height: np.ndarray
    weight: np.ndarray


def _blocks(weights: np.ndarray, cell: float) -> _Blocks:
    """The blocks of one map that have any weight, in Morton's order."""
    height, width = weights.shape
    levels = _levels(weights)
    base = next(depth for depth, (sums, _, _) in enumerate(levels) if sums.size <= FINEST)
    # The blocks of a level that are part of no larger block of the result
    wanted = np.ones(levels[-1][0].shape, bool)
    out = []
    for depth in range(len(levels) - 1, base - 1, -1):
        sums, peaks, (step_y, step_x) = levels[depth]
        leaf = wanted
        if depth > base:
            even = peaks * (step_y * step_x) <= CONTRAST * sums
            leaf = wanted & (sums <= cell) & (even | (sums <= FAINT * cell))
            finer, (finer_y, _) = levels[depth - 1][0], levels[depth - 1][2]
            rows, columns = finer.shape
            wanted = np.repeat(wanted & ~leaf, 2, axis=int(finer_y == step_y))[:rows, :columns]
        y, x = np.nonzero(leaf & (sums > 0))
        weight = sums[y, x]
        x, y = x * step_x, y * step_y
        out.append(_Blocks(x, y, np.minimum(step_x, width - x), np.minimum(step_y, height - y), weight))
    blocks = _Blocks(*map(np.concatenate, zip(*out, strict=True)))
    order = np.argsort(_morton(blocks.x, blocks.y))
    return _Blocks(*(member[order] for member in blocks))


def _levels(weights: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, tuple[int, int]]]:
    """From texels to the whole: sums and maxima over blocks, and a block's (rows, columns)."""
    levels = [(weights, weights, (1, 1))]
    rows, columns = 1, 1
    while levels[-1][0].size > 1:
        sums, peaks, _ = levels[-1]
        # Columns and rows take turns, columns first, as the bits of Morton's curve do; a side of one texel is left
        # out.
        axis = 1 if (columns <= rows and sums.shape[1] > 1) or sums.shape[0] == 1 else 0
        rows, columns = (rows * 2, columns) if axis == 0 else (rows, columns * 2)
        at = np.arange(0, sums.shape[axis], 2)
        levels.append((np.add.reduceat(sums, at, axis), np.maximum.reduceat(peaks, at, axis), (rows, columns)))
    return levels


def _morton(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The bits of x and y (16 each) interleaved."""
    code = []
    for bits in (x, y):
        for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
            bits = (bits | bits << shift) & mask
        code.append(bits)
    return np.asarray(code[0] | code[1] << 1)


def _painted(shape: tuple[int, ...], blocks: _Blocks, values: np.ndarray) -> np.ndarray:
    """A map with each block's value in its texels, 0 elsewhere."""
    out = np.zeros(shape)
    out[blocks.y, blocks.x] = values  # enough for blocks of one texel, which most are
    size = blocks.width << 16 | blocks.height
    larger = np.flatnonzero(size != (1 << 16 | 1))
    sizes = np.sort(size[larger])
    # Not numpy.unique, which loads numpy.ma at its first call, 7 ms
    for both in sizes[np.diff(sizes, prepend=0) > 0].tolist():
        alike, width, height = larger[size[larger] == both], both >> 16, both & 0xFFFF
        y = blocks.y[alike][:, None, None] + np.arange(height)[:, None]
        x = blocks.x[alike][:, None, None] + np.arange(width)
        out[y, x] = values[alike][:, None, None]
    return out
