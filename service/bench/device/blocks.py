"""Merging a block of samples, and bands of it that other renderers trace."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

from gpu import Band, Picture, Renderer, border_after
from gpu.analysis.metering import noise_meter_off
from service.bench.device import stage
from service.bench.device.stage import RUNS, Options, Row

SCENE = "cornell-boxes"


def measure(options: Options) -> list[Row]:
    """A `report.Blocks` for each size."""
    with Renderer(options.device) as renderer, noise_meter_off():  # its samples come before a merge
        return [_row(renderer, size) for size in options.sizes]


def _row(renderer: Renderer, size: tuple[int, int]) -> Row:
    scene = renderer.load(stage.arrays(SCENE))
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
