"""The split of a range of boxes, by the surface area heuristic over bins of centroids.

[Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies"]
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from gpu.jit import jit
from gpu.layout import ShapeKind


class Split(IntEnum):
    """How a range of boxes is divided. All but the first exist for comparison, in `sunbox bench seeds`."""

    SAH = 0  # the surface area heuristic, over BINS bins or, where the boxes are few, half as many
    SPATIAL_MEDIAN = 1  # in the middle of the centroids' bounds, across their longest axis
    OBJECT_MEDIAN = 2  # as many boxes on the one side as on the other
    SAH_5 = 5  # the heuristic over as many bins everywhere
    SAH_11 = 11
    SAH_16 = 16


INSTANCE = int(ShapeKind.INSTANCE)
OBJECT_MEDIAN = int(Split.OBJECT_MEDIAN)
BINS = 16
FEW = 24  # with fewer boxes half the bins suffice: most nodes are small, and would spend their time on empty bins


@jit
def half_area(box: np.ndarray) -> float:
    x = np.float64(box[3]) - box[0]
    y = np.float64(box[4]) - box[1]
    z = np.float64(box[5]) - box[2]
    area: float = x * y + y * z + z * x
    return area


@jit
def _empty_box(box: np.ndarray) -> None:
    for k in range(3):
        box[k] = np.inf
        box[k + 3] = -np.inf


@jit
def _include(box: np.ndarray, other: np.ndarray) -> None:
    for k in range(3):
        box[k] = min(box[k], other[k])
        box[k + 3] = max(box[k + 3], other[k + 3])


@jit
def _swap(boxes: np.ndarray, index: np.ndarray, i: int, j: int) -> None:
    for k in range(6):
        boxes[i, k], boxes[j, k] = boxes[j, k], boxes[i, k]
    index[i], index[j] = index[j], index[i]


@jit
def bounds(boxes: np.ndarray, first: int, last: int, box: np.ndarray, middle: np.ndarray) -> None:
    """Fills `box` with the union of the boxes, `middle` with the bounds of their (doubled) centroids."""
    _empty_box(box)
    for k in range(6):
        middle[k] = np.inf if k < 3 else -np.inf
    for i in range(first, last):
        for k in range(3):
            low, high = boxes[i, k], boxes[i, k + 3]
            box[k] = min(box[k], low)
            box[k + 3] = max(box[k + 3], high)
            twice = np.float64(low) + np.float64(high)
            middle[k] = min(middle[k], twice)
            middle[k + 3] = max(middle[k + 3], twice)


@jit
def best_split(
    boxes: np.ndarray, first: int, last: int, middle: np.ndarray,
    count: np.ndarray, bins: np.ndarray, sums: np.ndarray, split: int,
) -> tuple[float, int, int, int]:  # fmt: skip
    """(area times count, summed over the two sides; axis; the right side's first bin; number of bins).

    Axis -1: all centroids are one point. `count`, `bins` and `sums` are scratch arrays. `split`: one of the
    heuristics among `Split`.
    """
    used = split
    if split == 0:
        used = BINS if last - first >= FEW else BINS // 2
    rate = np.empty(3, np.float64)
    for k in range(3):
        extent = middle[k + 3] - middle[k]
        # Just below the number of bins, so that the greatest centroid falls into the last one.
        rate[k] = used * 0.999999 / extent if extent > 0.0 else 0.0
    for k in range(3):
        for b in range(used):
            count[k, b] = 0
            _empty_box(bins[k, b])
    for i in range(first, last):
        for k in range(3):
            if rate[k] > 0.0:
                b = int((np.float64(boxes[i, k]) + np.float64(boxes[i, k + 3]) - middle[k]) * rate[k])
                count[k, b] += 1
                _include(bins[k, b], boxes[i])
    best, best_axis, best_bin, best_skew = np.inf, -1, 0, last - first
    side = np.empty(6, np.float32)
    for k in range(3):
        if rate[k] == 0.0:
            continue
        _empty_box(side)
        below = 0
        for b in range(used - 1):
            if count[k, b] > 0:
                below += count[k, b]
                _include(side, bins[k, b])
            sums[b] = half_area(side) * below if below > 0 else np.inf
        _empty_box(side)
        above = 0
        for b in range(used - 1, 0, -1):
            if count[k, b] == 0:
                continue
            above += count[k, b]
            _include(side, bins[k, b])
            cost = sums[b - 1] + half_area(side) * above
            skew = abs(last - first - 2 * above)
            # Boxes without area cost nothing wherever they are split, so they are split in the middle.
            if cost < best or (cost == best and skew < best_skew):
                best, best_axis, best_bin, best_skew = cost, k, b, skew
    return best, best_axis, best_bin, used


@jit
def longest_axis(middle: np.ndarray) -> int:
    """The longest axis of the centroids' bounds; -1 where they are one point."""
    axis, longest = -1, 0.0
    for k in range(3):
        if middle[k + 3] - middle[k] > longest:
            axis, longest = k, middle[k + 3] - middle[k]
    return axis


@jit
def halve(boxes: np.ndarray, index: np.ndarray, first: int, last: int, axis: int) -> int:
    """Bring the boxes of the lower half along `axis` to the front [Hoare 1961]; returns the first place behind them.

    It is written out because numba takes five seconds to compile a sort.
    """
    middle = first + (last - first) // 2
    low, high = first, last - 1
    while low < high:
        i, j, at = low, high, (low + high) // 2
        pivot = np.float64(boxes[at, axis]) + np.float64(boxes[at, axis + 3])
        while i <= j:
            while np.float64(boxes[i, axis]) + np.float64(boxes[i, axis + 3]) < pivot:
                i += 1
            while np.float64(boxes[j, axis]) + np.float64(boxes[j, axis + 3]) > pivot:
                j -= 1
            if i <= j:
                _swap(boxes, index, i, j)
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break
    return middle


@jit
def partition(
    boxes: np.ndarray, index: np.ndarray, first: int, last: int,
    axis: int, low: float, rate: float, bin_: int,
) -> int:  # fmt: skip
    """Move the boxes of bins below `bin_` to the front; returns the first place behind them."""
    i, j = first, last - 1
    while i <= j:
        if int((np.float64(boxes[i, axis]) + np.float64(boxes[i, axis + 3]) - low) * rate) < bin_:
            i += 1
        else:
            _swap(boxes, index, i, j)
            j -= 1
    return i


@jit
def partition_kind(boxes: np.ndarray, index: np.ndarray, kinds: np.ndarray, first: int, last: int) -> int:
    """Move the boxes of the first one's kind to the front; returns the first place behind them."""
    kind = kinds[index[first]]
    i = first
    for j in range(first, last):
        if kinds[index[j]] == kind:
            _swap(boxes, index, i, j)
            i += 1
    return i


@jit
def is_mixed(index: np.ndarray, kinds: np.ndarray, first: int, last: int) -> bool:
    """True if these boxes cannot be one leaf: they are of several kinds, or instances, each of which is a leaf."""
    kind = kinds[index[first]]
    found = last > first + 1 and kind == INSTANCE
    for i in range(first + 1, last):
        found |= kinds[index[i]] != kind
    return found
