"""Times of the work on a picture's samples: resolving, reading back and encoding them; merging blocks of them that
other renderers trace; dispatching them in slices of several lengths and sizes.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from gpu import Band, Picture, Renderer, border_after
from gpu.analysis.metering import noise_meter_off
from gpu.analysis.slices import slices_of
from service.bench.device import stage
from service.bench.device.stage import RUNS, Options, Row
from service.formats import images
from service.views import StreamFormat

SCENE, SAMPLES = "cornell-boxes", 4
FORMATS: tuple[StreamFormat, ...] = ("jpeg", "webp", "png")


def measure(options: Options) -> list[Row]:
    """A `report.Readout` for each size."""
    out = []
    with Renderer(options.device) as renderer:
        scene = renderer.load(stage.arrays(SCENE))
        for width, height in options.sizes:
            picture = renderer.picture(scene, stage.settings((width, height)))
            while picture.samples < SAMPLES:
                picture.trace(1.0, SAMPLES)
            pixels, turn_s = picture.display(), options.turn_s / 4
            row: Row = {
                "width": width,
                "height": height,
                "display_ms": stage.median_ms(picture.display, turn_s),
                "linear_ms": stage.median_ms(picture.read, turn_s),
            }
            row["encoded"] = [
                {
                    "format": name,
                    "ms": stage.median_ms(partial(images.encode, pixels, name), turn_s),
                    "bytes": len(images.encode(pixels, name)),
                }
                for name in FORMATS
            ]
            out.append(row)
            picture.release()
    return out


BLOCK_SCENE = "cornell-boxes"


def blocks(options: Options) -> list[Row]:
    """A `report.Blocks` for each size."""
    with Renderer(options.device) as renderer, noise_meter_off():  # its samples come before a merge
        return [_block_row(renderer, size) for size in options.sizes]


def _block_row(renderer: Renderer, size: tuple[int, int]) -> Row:
    scene = renderer.load(stage.arrays(BLOCK_SCENE))
    picture, lender = (renderer.picture(scene, stage.settings(size)) for _ in range(2))
    width, height = size
    lent = Band(0, 1, 0, height)
    while not lender.block.trace_band(lent, 1.0):
        pass
    reads = [_seconds(lambda: lender.block.read_band(lent)) for _ in range(1 + RUNS)]
    values = lender.block.read_band(lent)
    first = border_after(0)
    band = Band(first, border_after(first) - first, 0, height)
    runs = [_written_and_merged(picture, band, values) for _ in range(1 + RUNS)]  # the first one compiles
    writes, merges = zip(*runs[1:], strict=True)
    for one in (picture, lender):
        one.release()
    scene.release()
    return {
        "width": width,
        "height": height,
        "band_bytes": values.nbytes,
        "merge_ms": 1e3 * statistics.median(merges),
        "read_band_ms": 1e3 * statistics.median(reads[1:]),
        "write_band_ms": 1e3 * statistics.median(writes),
    }


def _written_and_merged(picture: Picture, band: Band, values: np.ndarray) -> tuple[float, float]:
    """Seconds to write all of the picture's second block, and to merge it; `values` may be of other samples."""
    picture.reset()
    while picture.samples < band.first:
        picture.trace(1.0, band.first)
    picture.block.share(0, band.first + band.count)
    written = _seconds(lambda: picture.block.write_band(band, values))
    picture.block.complete()
    began = time.perf_counter()
    while picture.samples < band.first + band.count:
        picture.trace(1.0, band.first + band.count)
    return written, time.perf_counter() - began


def _seconds(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


DISPATCH_SCENES = ("cornell-boxes", "generated-mesh")
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
