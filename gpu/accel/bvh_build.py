"""The loop that grows a tree over boxes.

A tree is an array of rows of six words, parents before their children: passes over it need no stack, however
deep it is.
"""

from __future__ import annotations

import numpy as np

from gpu.accel.sah import (
    BINS,
    OBJECT_MEDIAN,
    best_split,
    bounds,
    half_area,
    halve,
    is_mixed,
    longest_axis,
    partition,
    partition_kind,
)
from gpu.jit import jit
from gpu.layout import LEAF_BIT, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, LEAF_KIND_SHIFT

# A row of the tree: the box as in layout.Node, then
LINK = 3  # inner: slot of the left child, the right one follows. Leaf: as in layout, `first` in leaf order
SIZE = 4  # nodes in the subtree, itself included
AXIS = 5  # inner: the left child's centroids are lower along it
WORDS = 6

NODE_COST = 1.0  # of one step through the tree, in units of one primitive's test


@jit
def _write_box(row: np.ndarray, box: np.ndarray, grid: np.ndarray) -> None:
    """The box on the grid, one step larger on each side, which covers the shader's rounding."""
    for k in range(3):
        lower = max(np.floor((box[k] - grid[0, k]) / grid[1, k]) - 1.0, 0.0)
        upper = min(np.ceil((box[k + 3] - grid[0, k]) / grid[1, k]) + 1.0, 65535.0)
        row[k] = np.uint32(lower) | (np.uint32(upper) << np.uint32(16))


@jit
def grow(
    rows: np.ndarray, slot: int, free: int, boxes: np.ndarray, index: np.ndarray, kinds: np.ndarray,
    mixed: bool, grid: np.ndarray, first: int, last: int, leaf_min: int, leaf_max: int, whole: int,
    tasks: np.ndarray, split: int,
) -> tuple[int, int]:  # fmt: skip
    """Grow the subtree over boxes [first, last), its root into `slot`, the others from slot `free` on.

    Reorders `boxes` and `index`. By `split`, a `Split`, it always splits ranges of more than `leaf_max` boxes, of
    several `kinds` or of instances, and never other ranges of `leaf_min` boxes or fewer. A range of at most `whole`
    boxes, unless it is the root's, is left to another call: its slot, first and last go into `tasks`. Returns (first
    free slot, number of tasks).
    """
    # This stays one function: with a function of its own for the choice of the cut, building takes 1.2 times as long.
    # The smaller child is always done first, so the stack holds at most log2(boxes) ranges.
    stack = np.empty((64, 3), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2] = slot, first, last
    depth, task_count = 1, 0
    box, middle = np.empty(6, np.float32), np.empty(6, np.float64)
    count, bins = np.empty((3, BINS), np.int64), np.empty((3, BINS, 6), np.float32)
    sums = np.empty(BINS, np.float64)
    while depth > 0:
        depth -= 1
        at, a, b = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        n = b - a
        if n <= whole and at != slot:
            tasks[task_count, 0], tasks[task_count, 1], tasks[task_count, 2] = at, a, b
            task_count += 1
            continue
        bounds(boxes, a, b, box, middle)
        _write_box(rows[at], box, grid)
        of_several_kinds = mixed and n <= leaf_max and is_mixed(index, kinds, a, b)
        axis, cut = -1, a
        if n > 1 and (n > leaf_min or of_several_kinds):
            worth = n > leaf_max or of_several_kinds
            if 0 < split <= OBJECT_MEDIAN:
                axis, bin_, used = longest_axis(middle), 1, 2
            else:
                cost, axis, bin_, used = best_split(boxes, a, b, middle, count, bins, sums, split)
                area = half_area(box)
                worth = worth or area * NODE_COST + cost < area * n
            if axis >= 0 and worth and split == OBJECT_MEDIAN:
                cut = halve(boxes, index, a, b, axis)
            elif axis >= 0 and worth:
                rate = used * 0.999999 / (middle[axis + 3] - middle[axis])
                cut = partition(boxes, index, a, b, axis, middle[axis], rate, bin_)
            elif of_several_kinds:
                cut = partition_kind(boxes, index, kinds, a, b)
                if cut == b:
                    cut = a + n // 2
            elif n > leaf_max:  # all centroids are one point
                cut = a + n // 2
        if cut == a:
            kind = np.uint32(kinds[index[a]])
            rows[at, LINK] = np.uint32(
                LEAF_BIT | (kind << LEAF_KIND_SHIFT) | ((n - 1) << LEAF_COUNT_SHIFT) | (a & LEAF_FIRST_MASK)
            )
            rows[at, SIZE] = 1
            rows[at, AXIS] = 0
            continue
        rows[at, LINK] = free
        rows[at, AXIS] = max(axis, 0)
        left_first = cut - a > b - cut  # pushed first, so that the smaller one is popped next
        for turn in range(2):
            if (turn == 0) == left_first:
                stack[depth, 0], stack[depth, 1], stack[depth, 2] = free, a, cut
            else:
                stack[depth, 0], stack[depth, 1], stack[depth, 2] = free + 1, cut, b
            depth += 1
        free += 2
    return free, task_count


@jit
def measure(rows: np.ndarray, first: int, last: int, root: int) -> None:
    """Fill in the sizes of the inner nodes in slots [first, last), then of `root`; sizes below them are filled in."""
    for k in range(last - first + 1):
        at = last - 1 - k if k < last - first else root
        if not rows[at, LINK] & np.uint32(LEAF_BIT):
            left = rows[at, LINK]
            rows[at, SIZE] = 1 + rows[left, SIZE] + rows[left + 1, SIZE]
