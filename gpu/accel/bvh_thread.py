"""A tree in a depth-first order for each octant of ray directions, with skip links instead of a stack.

Only the top of the tree is stored once for each octant. Its leaves are treelets: subtrees of a few dozen nodes,
stored once for all octants, left child first. The order inside them matters little: eight orders of everything took
six times the memory and no less time, as less of it fits into the caches.
"""

from __future__ import annotations

import numpy as np

from gpu.accel.bvh_build import AXIS, LINK, SIZE
from gpu.jit import jit
from gpu.layout import LEAF_BIT, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, TREELET_BIT


@jit
def top_sizes(rows: np.ndarray, regions: np.ndarray, most: int, sizes: np.ndarray) -> None:
    """Fill in the number of nodes of each row's subtree; treelets, of at most `most` nodes with their root, count as
    one."""
    for q in range(len(regions)):
        r = len(regions) - 1 - q
        for k in range(regions[r, 1] - regions[r, 0]):
            slot = regions[r, 1] - 1 - k
            if rows[slot, LINK] & np.uint32(LEAF_BIT) or rows[slot, SIZE] <= most:
                sizes[slot] = 1
            else:
                left = rows[slot, LINK]
                sizes[slot] = 1 + sizes[left] + sizes[left + 1]


@jit
def lay_treelets(
    rows: np.ndarray, regions: np.ndarray, ranks: np.ndarray, most: int, base: int,
    place: np.ndarray, top: np.ndarray, nodes: np.ndarray,
) -> int:  # fmt: skip
    """Fill `nodes` (k, 4) with the treelets without their roots, `place` of each root with its first node, and `top`
    with the slots outside treelets, parents first. `base` is the place of nodes[0] in the array that links count in.
    Returns the number of nodes.
    """
    inside = np.zeros(len(rows), np.uint8)
    used = 0
    outside = 0
    for r in range(len(regions)):
        for slot in range(regions[r, 0], regions[r, 1]):
            link = rows[slot, LINK]
            leaf = (link & np.uint32(LEAF_BIT)) != 0
            if inside[slot] == 0:
                top[outside] = slot
                outside += 1
                if leaf or rows[slot, SIZE] > most:
                    continue
                place[slot] = used
                first = used
                used += rows[slot, SIZE] - 1
            else:
                at = place[slot]
                for k in range(3):
                    nodes[at, k] = rows[slot, k]
                if leaf:
                    nodes[at, 3] = _leaf(link, ranks)
                    continue
                nodes[at, 3] = base + at + rows[slot, SIZE]
                first = at + 1
            place[link] = first
            place[link + 1] = first + rows[link, SIZE]
            inside[link] = 1
            inside[link + 1] = 1
    return used


@jit
def _leaf(link: int, ranks: np.ndarray) -> int:
    moved: int = (link & np.uint32(~LEAF_FIRST_MASK & 0xFFFFFFFF)) | ranks[link & np.uint32(LEAF_FIRST_MASK)]
    return moved


@jit
def thread_octant(
    rows: np.ndarray, top: np.ndarray, ranks: np.ndarray, sizes: np.ndarray, treelets: np.ndarray, octant: int,
    base: int, nodes: np.ndarray,
) -> None:  # fmt: skip
    """Fill `nodes` (count, 4) with the rows `top`. `base` is the place of nodes[0] in the array that links count in.

    `sizes` are those of `top_sizes`, `treelets` is the `place` of `lay_treelets`.
    """
    place = np.empty(len(rows), np.uint32)  # of each slot in this order; only rows in use are written
    place[0] = 0
    for slot in top:
        at = place[slot]
        link = rows[slot, LINK]
        for k in range(3):
            nodes[at, k] = rows[slot, k]
        if link & np.uint32(LEAF_BIT):
            nodes[at, 3] = _leaf(link, ranks)
        elif sizes[slot] == 1:
            length = np.uint32(rows[slot, SIZE] - 1) << np.uint32(LEAF_COUNT_SHIFT)
            nodes[at, 3] = np.uint32(TREELET_BIT) | length | treelets[slot]
        else:
            nodes[at, 3] = base + at + sizes[slot]
            near = link + ((octant >> rows[slot, AXIS]) & 1)
            far = 2 * link + 1 - near
            place[near] = at + 1
            place[far] = at + 1 + sizes[near]
