"""A tree in the order in which rays of one octant meet it, with skip links instead of a stack."""

from __future__ import annotations

import numpy as np

from gpu.bvh_grow import AXIS, LINK, SIZE
from gpu.jit import jit
from gpu.layout import LEAF_BIT, LEAF_FIRST_MASK


@jit
def thread_octant(
    rows: np.ndarray, regions: np.ndarray, ranks: np.ndarray, octant: int, base: int, nodes: np.ndarray
) -> None:
    """Fills `nodes` (count, 4) uint32. `base` is the place of nodes[0] in the array that links count in."""
    place = np.empty(len(rows), np.uint32)  # of each slot in this order; only the rows in use are touched
    place[0] = 0
    for r in range(len(regions)):
        for slot in range(regions[r, 0], regions[r, 1]):
            at = place[slot]
            link = rows[slot, LINK]
            for k in range(3):
                nodes[at, k] = rows[slot, k]
            if link & np.uint32(LEAF_BIT):
                first = ranks[link & np.uint32(LEAF_FIRST_MASK)]
                nodes[at, 3] = (link & np.uint32(~LEAF_FIRST_MASK & 0xFFFFFFFF)) | first
            else:
                nodes[at, 3] = base + at + rows[slot, SIZE]
                near = link + ((octant >> rows[slot, AXIS]) & 1)
                far = 2 * link + 1 - near
                place[near] = at + 1
                place[far] = at + 1 + rows[near, SIZE]
