"""The orders in which the nodes of a tree may be walked: eight, by octant of the ray's direction, or one; with the
small subtrees, the treelets, stored once or in each order.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from gpu import Renderer, SceneArrays
from gpu.accel import bvh
from gpu.layout import LEAF_BIT, TREELET_BIT
from service.bench.device import stage
from service.bench.device.stage import Options, Row

SCENES = ("sphere-field", "generated-mesh", stage.MESH)
TREELETS, WHOLE = "treelets", "no treelets"
OURS = {True: "eight orders", False: "one order"}


@contextmanager
def whole_up_to(nodes: int) -> Iterator[None]:
    """Within this block a tree of at most that many nodes has no treelets."""
    before = bvh.WHOLE
    bvh.WHOLE = nodes
    try:
        yield
    finally:
        bvh.WHOLE = before


def ways(name: str) -> dict[str, SceneArrays]:
    """The scene with its tree in every way. One order is stored eight times too, as kernels know no other layout."""
    out = {}
    for treelets, most in ((TREELETS, 0), (WHOLE, 1 << 31)):
        with whole_up_to(most):
            arrays = stage.arrays(name)
        out[f"{OURS[True]}, {treelets}"] = arrays
        out[f"{OURS[False]}, {treelets}"] = in_one_order(arrays)
    return out


def measure(name: str, options: Options) -> list[Row]:
    """A `report.Tree` for each way."""
    with Renderer(options.device) as renderer:
        settings = stage.settings(options.sizes[0])
        loaded = {way: renderer.load(arrays) for way, arrays in ways(name).items()}
        pictures = {way: renderer.picture(scene, settings) for way, scene in loaded.items()}
        rates = stage.rates(pictures, options.turn_s)
        return [
            {"scene": name, "tree": way, "node_bytes": loaded[way].arrays.nodes.nbytes, "rate": rate}
            for way, rate in rates.items()
        ]


def in_one_order(arrays: SceneArrays) -> SceneArrays:
    """The same tree, walked by all rays in the order in which it was built, whatever their directions."""
    count = arrays.node_count
    nodes = arrays.nodes.copy()
    inner = nodes["link"][:count] & np.uint32(LEAF_BIT | TREELET_BIT) == 0
    for octant in range(1, 8):
        order = nodes[:count].copy()
        order["link"][inner] += np.uint32(octant * count)  # where the walk goes on counts in the whole array
        nodes[octant * count : (octant + 1) * count] = order
    return replace(arrays, nodes=nodes)
