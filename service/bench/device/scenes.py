"""Costs of the built-in scenes on a device: paths per second, compile times and memory; then one kernel for many
scenes beside a scene's own, caustics by both ways of finding them, and the orders in which a tree may be walked.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from gpu import LIGHT_PERIOD, Renderer, SceneArrays, picture_bytes, scene_bytes
from gpu.accel import bvh
from gpu.analysis.device_limits import free_memory
from gpu.analysis.kernel_cost import kernel_cost
from gpu.layout import LEAF_BIT, TREELET_BIT
from service.bench.device import stage
from service.bench.device.stage import Options, Row


def compile_ms(name: str, options: Options) -> float:
    """Milliseconds that the scene's kernel takes to compile."""
    with Renderer(options.device) as renderer:
        scene = renderer.load(stage.arrays(name))
        return renderer.picture(scene, stage.settings(options.sizes[0])).compile_ms


def measure(name: str, options: Options) -> Row:
    """A `report.Scene` without `compile_cold_ms`."""
    began = time.perf_counter()
    arrays = stage.arrays(name)
    with Renderer(options.device) as renderer:
        scene = renderer.load(arrays)
        row: Row = {
            "scene": name,
            "triangles": len(arrays.triangles),
            "scene_bytes": scene_bytes(arrays),
            "load_ms": 1e3 * (time.perf_counter() - began),
            "sizes": [],
        }
        for size in options.sizes:
            settings = stage.settings(size)
            small = renderer.picture(scene, stage.settings((8, 8)))  # compiles, and has a context to ask
            row.setdefault("compile_warm_ms", small.compile_ms)
            before = free_memory(small.context)
            picture = renderer.picture(scene, settings)
            rate = stage.rate(picture, options.turn_s)
            after = free_memory(picture.context)
            taken = None if before is None or after is None else max(0, before - after)
            width, height = size
            row["sizes"].append({"width": width, "height": height, **rate, "picture_bytes": picture_bytes(settings),
                                 "device_bytes": taken})  # fmt: skip
            picture.release()
            small.release()
    row["host_bytes"] = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return row


KERNEL_SCENES = ("sphere-on-floor", "generated-mesh")


def full_kernel(name: str, options: Options) -> Row:
    """A `report.Kernel`: the kernel for many scenes beside the scene's own."""
    with Renderer(options.device) as renderer:
        cost = kernel_cost(renderer, stage.arrays(name))
    ratio = cost.full_sample_s / cost.sample_s
    return {"scene": name, "full_compile_ms": cost.full_compile_ms, "time_ratio": ratio}


CAUSTIC_SCENES = ("pool", "whisky", "prism")
CAUSTIC_WAYS = ("light", "paths")


def caustics(name: str, options: Options) -> Row:
    """A `report.Caustics` in the smallest size. Paths from the lights are traced in two of every LIGHT_PERIOD
    samples, so that whole periods are timed."""
    with Renderer(options.device) as renderer:
        scene = renderer.load(stage.arrays(name))
        pictures = {
            way: renderer.picture(scene, stage.settings(options.sizes[0], caustics=way)) for way in CAUSTIC_WAYS
        }
        rates = stage.rates(pictures, options.turn_s, LIGHT_PERIOD)
        for picture in pictures.values():
            picture.release()
    return {"scene": name, **rates}


TREE_SCENES = ("sphere-field", "generated-mesh", stage.MESH)
WITH_TREELETS, WITHOUT_TREELETS = "treelets", "no treelets"
ORDERS = {True: "eight orders", False: "one order"}


@contextmanager
def whole_up_to(nodes: int) -> Iterator[None]:
    """Within this block a tree of at most that many nodes has no treelets."""
    before = bvh.WHOLE
    bvh.WHOLE = nodes
    try:
        yield
    finally:
        bvh.WHOLE = before


def tree_ways(name: str) -> dict[str, SceneArrays]:
    """The scene with its tree in every way. One order is stored eight times too, as kernels know no other layout."""
    out = {}
    for treelets, most in ((WITH_TREELETS, 0), (WITHOUT_TREELETS, 1 << 31)):
        with whole_up_to(most):
            arrays = stage.arrays(name)
        out[f"{ORDERS[True]}, {treelets}"] = arrays
        out[f"{ORDERS[False]}, {treelets}"] = in_one_order(arrays)
    return out


def trees(name: str, options: Options) -> list[Row]:
    """A `report.Tree` for each way: eight orders, by octant of the ray's direction, or one; with the small subtrees,
    the treelets, stored once or in each order."""
    with Renderer(options.device) as renderer:
        settings = stage.settings(options.sizes[0])
        loaded = {way: renderer.load(arrays) for way, arrays in tree_ways(name).items()}
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
