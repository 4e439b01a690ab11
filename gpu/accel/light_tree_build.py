"""The loops that grow a tree over lights and bound its nodes, parents before their children.

[Conty Estevez & Kulla 2018, "Importance sampling of many lights with adaptive tree splitting"]
"""

from __future__ import annotations

import numpy as np

from gpu.jit import jit

BINS = 12
DEPTH = 32  # most levels of pairs: the bits of one word are the path to a light
# Columns of a node's bounds: box, axis, cosine of the half angle of the normals' cone, of how far beyond it light
# leaves, intensity, radius of a ball around all of it
BOX, AXIS, NORMALS, BEYOND, INTENSITY, RADIUS, WIDTH = 0, 6, 9, 10, 11, 12, 13


@jit
def _include(row: np.ndarray, light: np.ndarray) -> None:
    """Add a light to a bin's box, axes, intensity and count (its last column)."""
    for k in range(3):
        row[k] = min(row[k], light[k])
        row[k + 3] = max(row[k + 3], light[k + 3])
        # A light that shines in all directions has no axis; it shortens the mean of its neighbours' axes.
        row[AXIS + k] += light[AXIS + k] * (0.5 + 0.5 * light[NORMALS])
    row[INTENSITY] += light[INTENSITY]
    row[RADIUS] += 1.0


@jit
def _clear(row: np.ndarray) -> None:
    for k in range(3):
        row[k] = np.inf
        row[k + 3] = -np.inf
    for k in range(6, WIDTH):
        row[k] = 0.0


@jit
def _merge(row: np.ndarray, other: np.ndarray) -> None:
    for k in range(3):
        row[k] = min(row[k], other[k])
        row[k + 3] = max(row[k + 3], other[k + 3])
        row[AXIS + k] += other[AXIS + k]
    row[INTENSITY] += other[INTENSITY]
    row[RADIUS] += other[RADIUS]


@jit
def _cost(row: np.ndarray) -> float:
    """The cost of a node in variance: its intensity times the square of its size, as in the importance, times a
    measure of the directions into which it shines. That is computed from the length of the mean of its lights' axes,
    a sum, and within 10 % of the measure of the paper's cone.
    """
    size, mean = 0.0, 0.0
    for k in range(3):
        size += (row[k + 3] - row[k]) ** 2
        mean += row[AXIS + k] ** 2
    mean = np.sqrt(mean) / row[RADIUS]
    cost: float = row[INTENSITY] * size * (1.0 + 3.0 * np.sqrt(max(0.0, 1.0 - mean)))
    return cost


@jit
def _split(
    lights: np.ndarray, order: np.ndarray, first: int, last: int, bins: np.ndarray, side: np.ndarray
) -> tuple[int, float, float, int]:
    """(axis, twice the place where bin 0 begins, bins per unit of that, first bin of the right side). The axis is -1
    where all lights are in one place."""
    low, high = np.empty(3, np.float64), np.empty(3, np.float64)
    for k in range(3):
        low[k], high[k] = np.inf, -np.inf
        for i in range(first, last):
            twice = lights[order[i], k] + lights[order[i], k + 3]
            low[k] = min(low[k], twice)
            high[k] = max(high[k], twice)
    used = BINS if last - first >= 2 * BINS else BINS // 2
    longest = max(high[0] - low[0], high[1] - low[1], high[2] - low[2])
    best, best_axis, best_bin, best_rate = np.inf, -1, 0, 0.0
    costs = np.empty(BINS, np.float64)
    for axis in range(3):
        extent = high[axis] - low[axis]
        if not extent > 0.0 or extent < 1e-6 * longest:
            continue
        rate = used * 0.999999 / extent
        for b in range(used):
            _clear(bins[b])
        for i in range(first, last):
            light = lights[order[i]]
            _include(bins[int((light[axis] + light[axis + 3] - low[axis]) * rate)], light)
        _clear(side)
        for b in range(used - 1):
            _merge(side, bins[b])
            costs[b] = _cost(side)
        _clear(side)
        for b in range(used - 1, 0, -1):
            if bins[b, RADIUS] == 0.0:
                continue
            _merge(side, bins[b])
            cost = (costs[b - 1] + _cost(side)) * longest / extent  # no thin slices, as in the paper
            if cost < best:
                best, best_axis, best_bin, best_rate = cost, axis, b, rate
    if best_axis < 0:
        return -1, 0.0, 0.0, 0
    return best_axis, low[best_axis], best_rate, best_bin


@jit
def _push(row: np.ndarray, first: int, last: int, depth: int, trail: int, place: int) -> None:
    row[0], row[1], row[2], row[3], row[4] = first, last, depth, trail, place


@jit
def grow(lights: np.ndarray, order: np.ndarray, children: np.ndarray, trails: np.ndarray) -> None:
    """Fill `children` (n - 1, 2) int64 with the pair of each child, or ~light where it is a light, and `trails` (n,)
    uint32, of which bit k says which child leads to the light at depth k. `lights` (n, WIDTH), n >= 2. Reorders
    `order`.
    """
    bins, side = np.empty((BINS, WIDTH), np.float64), np.empty(WIDTH, np.float64)
    stack = np.empty((DEPTH + 2, 5), np.int64)  # first, last, depth, trail, place among all children
    _push(stack[0], 0, len(order), 0, 0, -1)
    top, free = 1, 0
    while top > 0:
        top -= 1
        a, b, depth, trail, place = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3], stack[top, 4]
        if b - a == 1:
            children[place // 2, place % 2] = ~order[a]
            trails[order[a]] = trail
            continue
        if place >= 0:
            children[place // 2, place % 2] = free
        axis, low, rate, bin_ = _split(lights, order, a, b, bins, side)
        cut = a
        if axis >= 0:
            j = b - 1
            while cut <= j:
                light = lights[order[cut]]
                if int((light[axis] + light[axis + 3] - low) * rate) < bin_:
                    cut += 1
                else:
                    order[cut], order[j] = order[j], order[cut]
                    j -= 1
        room = np.int64(1) << np.int64(max(DEPTH - 1 - depth, 0))
        if axis < 0 or cut in (a, b) or max(cut - a, b - cut) > room:
            cut = (a + b) // 2
        _push(stack[top], cut, b, depth + 1, trail | np.int64(1) << depth, 2 * free + 1)
        _push(stack[top + 1], a, cut, depth + 1, trail, 2 * free)
        top += 2
        free += 1


@jit
def _cone(node: np.ndarray, a: np.ndarray, b: np.ndarray) -> None:
    """Write the cone of normals around two others into `node` [Conty Estevez & Kulla 2018, algorithm 1]."""
    if b[NORMALS] < a[NORMALS]:
        a, b = b, a  # the wider one first
    node[NORMALS] = a[NORMALS]
    for k in range(3):
        node[AXIS + k] = a[AXIS + k]
    dot = 0.0
    for k in range(3):
        dot += a[AXIS + k] * b[AXIS + k]
    between = np.arccos(min(max(dot, -1.0), 1.0))
    wide, narrow = np.arccos(max(a[NORMALS], -1.0)), np.arccos(min(max(b[NORMALS], -1.0), 1.0))
    if min(between + narrow, np.pi) <= wide:
        return
    half = 0.5 * (wide + between + narrow)
    if half >= np.pi or not between < np.pi * 0.9999999:
        node[NORMALS] = -1.0
        return
    node[NORMALS] = np.cos(half)
    turn = half - wide
    sine = np.sin(between)
    length = 0.0
    for k in range(3):
        node[AXIS + k] = (np.sin(between - turn) * a[AXIS + k] + np.sin(turn) * b[AXIS + k]) / sine
        length += node[AXIS + k] ** 2
    length = np.sqrt(length)
    for k in range(3):
        node[AXIS + k] /= length


@jit
def _around(node: np.ndarray, child: np.ndarray) -> float:
    """The radius of a ball around the node's middle that contains the child's ball."""
    d2 = 0.0
    for k in range(3):
        d2 += (0.5 * (node[k] + node[k + 3]) - 0.5 * (child[k] + child[k + 3])) ** 2
    far: float = np.sqrt(d2) + child[RADIUS]
    return far


@jit
def bound(lights: np.ndarray, children: np.ndarray, bounds: np.ndarray) -> None:
    """Fill `bounds` (n - 1, 2, WIDTH) with the bounds of each pair's children."""
    node = np.empty(WIDTH, np.float64)
    for i in range(len(children) - 1, -1, -1):
        for side in range(2):
            child = children[i, side]
            if child < 0:
                for k in range(WIDTH):
                    bounds[i, side, k] = lights[~child, k]
                continue
            a, b = bounds[child, 0], bounds[child, 1]
            diagonal = 0.0
            for k in range(3):
                node[k] = min(a[k], b[k])
                node[k + 3] = max(a[k + 3], b[k + 3])
                diagonal += (node[k + 3] - node[k]) ** 2
            _cone(node, a, b)
            node[BEYOND] = min(a[BEYOND], b[BEYOND])
            node[INTENSITY] = a[INTENSITY] + b[INTENSITY]
            node[RADIUS] = min(0.5 * np.sqrt(diagonal), max(_around(node, a), _around(node, b)))
            for k in range(WIDTH):
                bounds[i, side, k] = node[k]
