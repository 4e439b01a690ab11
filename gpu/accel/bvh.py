"""Boxes -> a bounding volume hierarchy as `layout.Node` records. Runs without GL, off the render loop.

Importing this loads numba (half a second), so import it where a tree is needed.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from gpu.accel.bvh_build import WORDS, grow, measure
from gpu.accel.bvh_thread import lay_treelets, thread_octant, top_sizes
from gpu.accel.sah import Split
from gpu.errors import SceneTooLarge
from gpu.layout import LEAF_FIRST_MASK, LEAF_MAX_COUNT, TREELET_MAX_NODES, Node, ShapeKind

LEAF_SIZE = 4  # the most primitives in a leaf; the surface area heuristic splits most of them further
LEAF_SIZE_LARGE = 8  # the size of leaves, wherever counts allow, in scenes whose eight orders would pass 2 GiB
LARGE = 6_000_000
MAX_PRIMITIVES = LEAF_FIRST_MASK + 1
OCTANTS = 8
WHOLE = 4096  # nodes; a smaller tree has no treelets, and takes at most half a megabyte in eight orders
WORTH_THREADS = 32_768  # boxes; with fewer, starting threads costs more than they save

Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Tree:
    """A hierarchy whose boxes are on a grid: coordinate q of an axis stands for origin + q * scale."""

    order: np.ndarray  # (n,) uint32: the primitives in leaf order
    ranks: np.ndarray  # (n,) uint32: in the same order, each one's place in the array of its kind
    rows: np.ndarray  # (slots, WORDS) uint32, see bvh_build
    regions: np.ndarray  # (k, 2): the slots [from, to) in use, parents before their children
    origin: Vec3
    scale: Vec3

    @property
    def count(self) -> int:
        return int(np.diff(self.regions).sum())


def _grid(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """(2, 3) float64, exact in float32: origin and step of the grid of 65536 planes per axis.

    Steps are never finer than a few roundings of the coordinates, nor than 1/64 of the longest axis' step:
    growing a box by one of them must cover the rounding in the shader, in flat scenes as well.
    """
    low, high = lower.min(axis=0).astype(np.float64), upper.max(axis=0).astype(np.float64)
    extent = high - low
    extent = np.maximum(extent, extent.max() / 64)
    step = np.maximum(extent / 65530, np.maximum(abs(low), abs(high)).max() * 2.0**-21)
    step = np.maximum(step, 1e-30).astype(np.float32).astype(np.float64)  # above 0 for a point at 0, and not denormal
    return np.stack([(low - 2 * step).astype(np.float32).astype(np.float64), step])


def build(
    lower: np.ndarray, upper: np.ndarray, kinds: np.ndarray, leaf_size: int | None = None,
    firsts: Mapping[int, int] | None = None, staying: Mapping[int, int] | None = None,
    split: Split = Split.SAH,
) -> Tree:  # fmt: skip
    """The tree over n boxes: `lower`, `upper` (n, 3) float32, finite; `kinds` (n,) `layout.ShapeKind`.

    A leaf holds one kind only. `firsts` says where the boxes of a kind begin in its array, if not at 0; `staying`
    where those of a kind begin among the boxes, if its array is not brought into the leaves' order. The tree does not
    depend on the number of threads. Raises SceneTooLarge.
    """
    n = len(kinds)
    if not 0 < n <= MAX_PRIMITIVES:
        raise SceneTooLarge(f"{n} primitives; a tree holds 1 to {MAX_PRIMITIVES}")
    leaf_max = min(leaf_size or (LEAF_SIZE if n <= LARGE else LEAF_SIZE_LARGE), LEAF_MAX_COUNT)
    leaf_min = leaf_max if n > LARGE else 1
    boxes = np.concatenate([lower, upper], axis=1, dtype=np.float32)
    kinds = np.ascontiguousarray(kinds, np.uint8)
    order = np.arange(n, dtype=np.uint32)
    mixed = bool((kinds != kinds[0]).any() or kinds[0] == ShapeKind.INSTANCE)
    grid = _grid(lower, upper)

    workers = os.cpu_count() or 1
    whole = max(8192, n // (8 * workers)) if n > WORTH_THREADS and workers > 1 else 0
    tasks = np.empty((n if whole else 1, 3), np.int64)
    # A subtree over [a, b) has its own 2 (b - a) rows; those never written cost address space, not memory.
    reserved = 2 * n if whole else 0
    rows = np.empty((reserved + 2 * n, WORDS), np.uint32)

    def subtree(slot: int, free: int, first: int, last: int, whole: int) -> tuple[int, int]:
        used, task_count = grow(
            rows, slot, free, boxes, order, kinds, mixed, grid, first, last, leaf_min, leaf_max, whole, tasks,
            int(split),
        )  # fmt: skip
        if task_count == 0:
            measure(rows, free, used, slot)
        return used, task_count

    top, task_count = subtree(0, 1, 0, n, whole)
    regions = [(0, top)]
    if task_count:
        ranges = sorted((int(a), int(b), int(slot)) for slot, a, b in tasks[:task_count])
        with ThreadPoolExecutor(workers) as pool:
            ends = pool.map(lambda r: subtree(r[2], reserved + 2 * r[0], r[0], r[1], 0)[0], ranges)
            regions += [(reserved + 2 * a, end) for (a, _, _), end in zip(ranges, ends, strict=True)]
        measure(rows, 1, top, 0)
    ranks = _ranks(kinds[order], mixed)
    for kind, first in (firsts or {}).items():
        ranks[kinds[order] == kind] += np.uint32(first)
    for kind, first in (staying or {}).items():
        mine = kinds[order] == kind
        ranks[mine] = order[mine] - np.uint32(first)
    return Tree(order, ranks, rows, np.array(regions, np.int64), *_as_tuples(grid))


def _as_tuples(grid: np.ndarray) -> tuple[Vec3, Vec3]:
    (ox, oy, oz), (sx, sy, sz) = grid.tolist()
    return (ox, oy, oz), (sx, sy, sz)


def _ranks(kinds: np.ndarray, mixed: bool) -> np.ndarray:
    ranks = np.arange(len(kinds), dtype=np.uint32)
    if mixed:
        for kind in np.unique(kinds):
            places = np.flatnonzero(kinds == kind)
            ranks[places] = np.arange(len(places), dtype=np.uint32)
    return ranks


def thread(tree: Tree, treelet: int | None = None) -> tuple[np.ndarray, int]:
    """(`layout.Node` records, count): octant o's order of the top at [o * count, (o + 1) * count), treelets after.

    Bit i of the octant is set where the ray's direction is negative on axis i. An order is depth first, the
    child nearer along the split axis first. An inner node's link is the place in the whole array to go on at
    when its box is missed, the octant's end being (o + 1) * count. After a hit or a leaf, it is i + 1. A treelet
    whose box is hit is walked from its first node to its last, then on at i + 1. `treelet`: the most nodes in one.
    """
    most = 0 if tree.count <= WHOLE else TREELET_MAX_NODES
    most = 1 + (most if treelet is None else treelet)
    sizes, place = np.empty(len(tree.rows), np.uint32), np.empty(len(tree.rows), np.uint32)
    top_sizes(tree.rows, tree.regions, most, sizes)
    count = int(sizes[0])
    top = np.empty(count, np.uint32)
    nodes = np.empty((OCTANTS * count + tree.count, 4), np.uint32)
    used = lay_treelets(
        tree.rows, tree.regions, tree.ranks, most, OCTANTS * count, place, top, nodes[OCTANTS * count :]
    )
    for o in range(OCTANTS):
        order = nodes[o * count : (o + 1) * count]
        thread_octant(tree.rows, top, tree.ranks, sizes, place, o, o * count, order)
    return nodes[: OCTANTS * count + used].reshape(-1).view(Node.dtype), count
