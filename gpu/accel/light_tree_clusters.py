"""Clusters of the lights' tree: nodes whose lights are drawn by intensity alone from far away, where walks end.

Each has an alias table over its lights. Some nest in others, so that there is one for most distances.
"""

from __future__ import annotations

import numpy as np

from gpu.accel.light_tree_build import BEYOND, INTENSITY, NORMALS
from gpu.jit import jit
from gpu.layout import LightCluster, LightClusterEntry

# The most lights of a cluster, and of those that nest in it. Seven sizes down to 4 gain 2 % more of a sample's time.
SIZES = (256, 64, 16)
# Cosine of the half angle of the normals of flat lights in one cluster. With 0.9 a shining ball errs by 7 % more.
CONE = 0.97
_ALL_AROUND, _ONE_WAY, _UNLIKE = 0, 1, 2  # how the lights of a node shine


@jit
def _choose(
    lights: np.ndarray, children: np.ndarray, bounds: np.ndarray, first: np.ndarray, count: np.ndarray,
    chosen: np.ndarray,
) -> None:  # fmt: skip
    """Fill in for each pair the place of its first light in the tree's order, its number of lights, and whether its
    parent is a cluster.
    """
    pairs = len(children)
    kind = np.empty(pairs, np.int64)
    for i in range(pairs - 1, -1, -1):
        kind[i], count[i] = -1, 0
        for side in range(2):
            child = children[i, side]
            if child >= 0:
                mine, size = kind[child], count[child]
            else:
                size = 1
                if lights[~child, NORMALS] <= -1.0:
                    mine = _ALL_AROUND
                else:
                    mine = _ONE_WAY if lights[~child, BEYOND] == 0.0 else _UNLIKE
            kind[i] = mine if kind[i] in (-1, mine) else _UNLIKE
            count[i] += size
    around = np.full(pairs, len(lights) + 1, np.int64)  # lights of the nearest cluster that holds the pair
    for i in range(pairs):
        left = children[i, 0]
        for side in range(2):
            child = children[i, side]
            if child < 0:
                continue
            first[child] = first[i] if side == 0 else first[i] + (1 if left < 0 else count[left])
            most = 0
            for size in SIZES:
                if size < around[i]:
                    most = max(most, size)
            alike = kind[child] == _ALL_AROUND or (kind[child] == _ONE_WAY and bounds[i, side, NORMALS] >= CONE)
            chosen[child] = alike and count[child] <= most and bounds[i, side, INTENSITY] > 0.0
            around[child] = count[child] if chosen[child] else around[i]


@jit
def _next(share: np.ndarray, i: int, heavy: bool) -> int:
    while i < len(share) and (share[i] > 1.0) != heavy:
        i += 1
    return i


@jit
def _tabulate(share: np.ndarray, threshold: np.ndarray, alias: np.ndarray) -> None:
    """Make the alias table of shares whose mean is 1, as `gpu.tables.alias_table` does, but fast for few of them."""
    n = len(share)
    for i in range(n):
        threshold[i], alias[i] = 1.0, i
    light, heavy = _next(share, 0, False), _next(share, 0, True)
    if heavy == n:
        return
    left = share[heavy]  # the rest of the heavy one
    while True:
        after = _next(share, heavy + 1, True)
        if light < n and (left > 1.0 or after == n):
            threshold[light], alias[light] = share[light], heavy
            left += share[light] - 1.0
            light = _next(share, light + 1, False)
        elif after < n and left <= 1.0:
            threshold[heavy], alias[heavy] = left, after
            left += share[after] - 1.0
            heavy = after
        else:
            return


@jit
def _fill(
    order: np.ndarray, intensity: np.ndarray, first: np.ndarray, count: np.ndarray, starts: np.ndarray,
    totals: np.ndarray, light: np.ndarray, other: np.ndarray, threshold: np.ndarray,
) -> None:  # fmt: skip
    """Fill the tables and `totals`, the intensity of each pair. Entries of the pair i begin at starts[i]; -1: it has
    no table."""
    for i in range(len(starts)):
        if starts[i] < 0:
            continue
        n = count[i]
        mine, table = order[first[i] : first[i] + n], slice(starts[i], starts[i] + n)
        for k in mine:
            totals[i] += intensity[k]
        share = np.empty(n, np.float64)
        for j in range(n):
            share[j] = intensity[mine[j]] * (n / totals[i])
        alias = np.empty(n, np.int64)
        _tabulate(share, threshold[table], alias)
        for j in range(n):
            light[starts[i] + j], other[starts[i] + j] = mine[j], mine[alias[j]]


def gather(
    lights: np.ndarray, children: np.ndarray, bounds: np.ndarray, order: np.ndarray, place: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(`layout.LightCluster` records (n - 1,), one for each pair; `layout.LightClusterEntry` records; whether each
    child is a cluster (n - 1, 2) bool). `order` (n,): the lights from the tree's left to its right. `place`: of
    the first entry among the tree's words.
    """
    pairs = len(children)
    first, count, chosen = np.zeros(pairs, np.int64), np.empty(pairs, np.int64), np.zeros(pairs, np.bool_)
    _choose(lights, children, bounds, first, count, chosen)
    sizes = np.where(chosen, count, 0)
    starts = np.where(chosen, np.cumsum(sizes) - sizes, -1)
    entries = np.zeros(int(sizes.sum()), LightClusterEntry.dtype)
    light, other = np.empty(len(entries), np.int64), np.empty(len(entries), np.int64)
    threshold, totals = np.empty(len(entries), np.float64), np.zeros(pairs, np.float64)
    intensity = lights[:, INTENSITY].astype(np.float32).astype(np.float64)  # as in the shader
    _fill(order, intensity, first, count, starts, totals, light, other, threshold)
    entries["light"], entries["alias"], entries["threshold"] = light, other, threshold
    clusters = np.zeros(pairs, LightCluster.dtype)
    clusters["first"][chosen], clusters["count"] = place + starts[chosen], sizes
    clusters["inverse_intensity"][chosen] = 1 / totals[chosen]
    inner = children >= 0
    return clusters, entries, inner & chosen[np.where(inner, children, 0)]
