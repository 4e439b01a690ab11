"""Fields of 100 to 10 000 spheres: tested one by one, through trees of several kinds, and in the order of
building."""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from typing import Any

import numpy as np

from gpu import SceneArrays
from gpu.accel import bvh
from gpu.accel.sah import Split
from gpu.layout import LEAF_BIT, LEAF_COUNT_SHIFT, LEAF_KIND_SHIFT, LEAF_MAX_COUNT, ShapeKind
from service.bench.device.scenes import in_one_order
from service.document import presets
from tests.bench.seeds.stage import Document, Stage, sheet, shown

COUNTS = (100, 200, 500, 1000, 2000, 5000, 8000, 10_000)
WIDTH, HEIGHT, BOUNCES = 480, 272, 4
SPLITS = {
    "spatial median": Split.SPATIAL_MEDIAN,
    "object median": Split.OBJECT_MEDIAN,
    "SAH, 5 bins": Split.SAH_5,
    "SAH, 11 bins": Split.SAH_11,
    "SAH, 16 bins": Split.SAH_16,
    "Sunbox": Split.SAH,
}
FAR = 1e6  # metres, far beyond any hit
OURS, UNORDERED, NONE = "Sunbox", "one order", "no tree"
COLORS = ("#e76f51", "#f4a261", "#e9c46a", "#2a9d8f", "#264653", "#f1ede4")


def measure(stage: Stage) -> list[dict[str, Any]]:
    """A row for each number of spheres: milliseconds for a path of every pixel, by kind of tree, and to build it."""
    rows, seen = [], []
    width, height = stage.either((WIDTH, HEIGHT), (32, 16))
    for count in stage.either(COUNTS, (100, 200)):
        stage.told(f"{count} spheres")
        packed = stage.packed(field(count))
        ways, build_ms = {NONE: without_tree(packed)}, {}
        for name, split in SPLITS.items():
            ways[name], build_ms[name] = with_tree(packed, split)
        ways[UNORDERED] = in_one_order(ways[OURS])
        pictures = {name: stage.picture(arrays, width, height, max_bounces=BOUNCES) for name, arrays in ways.items()}
        taken = stage.rates(pictures, rounds=3, turn_s=0.15)
        rows.append({
            "spheres": count,
            "ms": {name: 1e3 * s for name, s in taken.items()},
            "build_ms": build_ms,
            "size": [width, height],
        })  # fmt: skip
        if count in (100, 1000, 10_000):
            seen.append(shown(stage.image(ways[OURS], width * 2 // 3, height * 2 // 3, 32, max_bounces=BOUNCES)))
    stage.pictures["spheres"] = sheet([seen])
    return rows


def field(count: int) -> Document:
    """`count` spheres that share one volume whatever their number, above a floor, in a studio's light."""
    rng = np.random.default_rng(count)
    centers = rng.uniform((-4.0, 0.4, -4.0), (4.0, 4.4, 4.0), (count, 3)).round(4).tolist()
    radius = 1.15 * count ** (-1 / 3)
    materials: Document = {
        f"color-{i}": {"type": "disney", "base_color": color, "metallic": i % 2, "roughness": 0.3 + 0.1 * i}
        for i, color in enumerate(COLORS)
    }
    materials["floor"] = {"type": "diffuse", "albedo": 0.4}
    shapes: list[Document] = [
        {"type": "sphere", "center": center, "radius": radius, "material": f"color-{i % len(COLORS)}"}
        for i, center in enumerate(centers)
    ]
    shapes.append({"type": "quad", "origin": [-40, 0, 40], "u": [80, 0, 0], "v": [0, 0, -80], "material": "floor"})
    return {
        "version": 1,
        "camera": {"position": [0, 3.4, 13], "target": [0, 2.1, 0], "vfov": 32},
        "environment": presets.get("environments", "studio"),
        "materials": materials,
        "shapes": shapes,
    }


def without_tree(arrays: SceneArrays) -> SceneArrays:
    """The scene without a tree, so that every ray tests every sphere: the nodes are a list of leaves whose boxes
    contain everything. A leaf has as many spheres as it can, so that its box hardly costs time."""
    n = len(arrays.spheres)
    firsts = np.arange(0, n, LEAF_MAX_COUNT, dtype=np.uint32)
    counts = np.minimum(LEAF_MAX_COUNT, n - firsts).astype(np.uint32)
    leaves = np.zeros(len(firsts), arrays.nodes.dtype)
    for axis in "xyz":
        leaves[axis] = np.uint32(0xFFFF0000)  # from the grid's first plane to its last
    kind = np.uint32(LEAF_BIT | int(ShapeKind.SPHERE) << LEAF_KIND_SHIFT)
    leaves["link"] = kind | (counts - 1) << np.uint32(LEAF_COUNT_SHIFT) | firsts
    return replace(
        arrays, nodes=np.tile(leaves, 8), node_count=len(leaves), node_origin=(-FAR, -FAR, -FAR),
        node_scale=(2 * FAR / 65535, 2 * FAR / 65535, 2 * FAR / 65535),
    )  # fmt: skip


def with_tree(arrays: SceneArrays, split: Split) -> tuple[SceneArrays, float]:
    """(the scene with a tree that is split in this way; milliseconds of building it, the median of nine)."""
    spheres = arrays.spheres
    low, high = (spheres["center"] + sign * spheres["radius"][:, None] for sign in (-1, 1))
    kinds = np.full(len(spheres), ShapeKind.SPHERE, np.uint8)
    seconds = []
    for _ in range(9):
        began = time.process_time()  # so few boxes are split by one thread
        tree = bvh.build(low, high, kinds, split=split)
        nodes, count = bvh.thread(tree)
        seconds.append(time.process_time() - began)
    changed = replace(
        arrays, spheres=spheres[tree.order], nodes=nodes, node_count=count, node_origin=tree.origin,
        node_scale=tree.scale, bvh_kinds=frozenset({ShapeKind.SPHERE}), large={},
    )  # fmt: skip
    return changed, 1e3 * statistics.median(seconds)
