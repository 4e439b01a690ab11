"""The time of a sample of every pixel."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gpu import Picture

SIZE = 512
RUN_S = 1.5  # long enough that beginning and ending a run do not count


def seconds_per_sample(picture: Picture, runs: int) -> list[float]:
    """Wall seconds for a sample of every pixel, a value for each run of about RUN_S."""
    once = trace(picture, 2)  # the tiles find their size
    samples = max(2, round(RUN_S * 2 / once))
    return [trace(picture, samples) / samples for _ in range(runs)]


def samples_in(picture: Picture, run_s: float) -> int:
    """The number of samples that a picture has after about `run_s` seconds, at least one: found by growing runs, as a
    GPU's first ones, with dispatches sized for a guess, may be a hundred times as slow as it is."""
    samples, took = 1, trace(picture, 1)
    while took < run_s / 4:
        samples *= 4
        took = trace(picture, samples)
    return max(1, round(samples * run_s / took))


def trace(picture: Picture, samples: int) -> float:
    """The seconds in which a picture gets that many samples, from none."""
    picture.reset()
    began = time.perf_counter()
    while picture.samples < samples:
        picture.trace(1.0, samples)
    return time.perf_counter() - began


def clock(software: bool) -> float:
    """Seconds. Where the processor renders, this process' own over the cores: others may be at work."""
    return time.process_time() / (os.cpu_count() or 1) if software else time.perf_counter()
