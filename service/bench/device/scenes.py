"""Paths per second, compile times and memory of the built-in scenes."""

from __future__ import annotations

import resource
import time

from gpu import Renderer, picture_bytes, scene_bytes
from gpu.analysis.device_limits import free_memory
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
