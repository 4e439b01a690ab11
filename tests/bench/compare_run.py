"""One side of `compare`: `python -P compare_run.py CASES.json`, with the source that is to be measured on the path.

It uses only functions that every revision has. It answers each line {"case", "size", "samples", "seed", "out"?} with
the seconds that this took, of the clock and of the processors, and writes the picture to `out`.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np

from gpu import Picture, Renderer, RenderSettings
from service.bench.scenes import BenchAssets
from service.document import parse_scene
from service.pack import pack


def main() -> None:
    with open(sys.argv[1]) as file:
        cases = json.load(file)
    pictures: dict[tuple[int, int, int], Picture] = {}
    with Renderer() as renderer:
        for line in sys.stdin:
            order = json.loads(line)
            key = order["case"], order["size"], order["seed"]
            if key not in pictures:
                for old in pictures.values():
                    old.release()
                    old.scene.release()
                pictures = {key: _picture(renderer, cases[order["case"]], order["size"], order["seed"])}
            print(json.dumps(_trace(pictures[key], order)), flush=True)


def _picture(renderer: Renderer, case: dict[str, Any], size: int, seed: int) -> Picture:
    scene = renderer.load(pack(parse_scene(case["scene"]), BenchAssets()).arrays)
    picture = renderer.picture(scene, RenderSettings(size, size, case["max_bounces"], filter="box", seed=seed))
    picture.trace(60.0, 2)  # compiles, and finds the size of its slices
    return picture


def _trace(picture: Picture, order: dict[str, Any]) -> dict[str, float]:
    picture.reset()
    wall, cpu = time.perf_counter(), time.process_time()
    while picture.samples < order["samples"]:
        picture.trace(60.0, order["samples"])
    spent = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    if "out" in order:
        np.save(order["out"], picture.read()[..., :3])
    return spent


main()
