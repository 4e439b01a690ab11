"""Dispatches of several lengths and sizes."""

from __future__ import annotations

import statistics
import time

from gpu import Picture, Renderer
from gpu.analysis.slices import slices_of
from service.bench.device import stage
from service.bench.device.stage import Options, Row

SCENES = ("cornell-boxes", "generated-mesh")
SLICES_S = (0.001, 0.002, 0.004, 0.008, 0.016, 0.033, 0.066, 0.133)
SIDES = (64, 128, 256, 512, 1024, 2048)
WHOLE_S = 0.25  # of a dispatch that takes all of a picture: far below the seconds after which drivers reset a GPU


def slices(name: str, options: Options) -> list[Row]:
    """A `report.Slice` for each length, in the largest size."""
    out = []
    with Renderer(options.device) as renderer:
        scene = renderer.load(stage.arrays(name))
        for slice_s in SLICES_S:
            with slices_of(slice_s):
                picture = renderer.picture(scene, stage.settings(options.sizes[-1]))
                rate = stage.rate(picture, options.turn_s)
                seconds = _each(picture, options.turn_s / 4)
                paths = picture.samples * picture.settings.width * picture.settings.height / len(seconds)
                picture.release()
            out.append({"scene": name, "slice_ms": 1e3 * slice_s, "median_ms": 1e3 * statistics.median(seconds),
                        "dispatches": len(seconds), "paths": paths, "rate": rate})  # fmt: skip
    return out


def _each(picture: Picture, turn_s: float) -> list[float]:
    """Seconds of each slice of a picture, for about `turn_s` and to the end of a pass."""
    picture.reset()
    seconds: list[float] = []
    while picture.samples == 0 or picture.under_way[0] or sum(seconds) < turn_s:
        began = time.perf_counter()
        picture.trace(0.0, 1 << 24)  # without a budget: one slice
        seconds.append(time.perf_counter() - began)
    return seconds


def sides(name: str, options: Options) -> list[Row]:
    """A `report.Side` for each size up to twice that of the largest picture."""
    out = []
    with Renderer(options.device) as renderer, slices_of(WHOLE_S):
        scene = renderer.load(stage.arrays(name))
        most = 2 * max(map(max, options.sizes))
        for side in (side for side in SIDES if side <= most):
            picture = renderer.picture(scene, stage.settings((side, side)))
            out.append({"scene": name, "side": side, "rate": stage.rate(picture, options.turn_s)})
            picture.release()
    return out
