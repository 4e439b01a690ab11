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
    once = _trace(picture, 2)  # the tiles find their size
    samples = max(2, round(RUN_S * 2 / once))
    return [_trace(picture, samples) / samples for _ in range(runs)]


def _trace(picture: Picture, samples: int) -> float:
    picture.reset()
    began = time.perf_counter()
    while picture.samples < samples:
        picture.trace(1.0, samples)
    return time.perf_counter() - began


def clock(software: bool) -> float:
    """Seconds. Where the processor renders, this process' own over the cores: others may be at work."""
    return time.process_time() / (os.cpu_count() or 1) if software else time.perf_counter()
