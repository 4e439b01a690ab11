"""Work on long arrays piece by piece, so that intermediate values stay in the cache and all cores are busy."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
U = TypeVar("U")

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


def in_order(make: Callable[[T], U], take: Callable[[T, U], None], jobs: Sequence[T]) -> None:
    """Call `make` for every job in threads, and `take` here with each job and its result, in order."""
    if len(jobs) < 3:
        for job in jobs:
            take(job, make(job))
        return
    ahead = 2 * (os.cpu_count() or 1)  # most results that are made and not yet taken
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        made = deque(pool.submit(make, job) for job in jobs[:ahead])
        for job, following in zip(jobs, [*jobs[ahead:], *[None] * ahead], strict=False):
            take(job, made.popleft().result())
            if following is not None:
                made.append(pool.submit(make, following))
