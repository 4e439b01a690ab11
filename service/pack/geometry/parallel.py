"""Work on long arrays piece by piece, so that intermediate values stay in the cache and all cores are busy."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")

CHUNK = 1 << 14  # rows of a piece; with a few float64 in each they take a megabyte


def chunks(count: int) -> list[slice]:
    return [slice(at, min(at + CHUNK, count)) for at in range(0, count, CHUNK)]


def in_threads(call: Callable[[T], None], jobs: Sequence[T]) -> None:
    """Call `call` with every job, in threads and in any order; numpy releases the interpreter's lock."""
    if len(jobs) < 3:
        for job in jobs:
            call(job)
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(call, jobs))
