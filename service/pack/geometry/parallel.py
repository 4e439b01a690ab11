"""Long arrays piece by piece: what is needed on the way stays in the cache, and all cores have work."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
U = TypeVar("U")

CHUNK = 1 << 14  # rows; a few float64 of each take a megabyte


def chunks(count: int) -> list[slice]:
    return [slice(at, min(at + CHUNK, count)) for at in range(0, count, CHUNK)]


def in_threads(call: Callable[[T], None], jobs: Sequence[T]) -> None:
    """Calls with every job, in any order: numpy lets go of the interpreter's lock."""
    if len(jobs) < 3:
        for job in jobs:
            call(job)
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(call, jobs))


def in_order(make: Callable[[T], U], take: Callable[[T, U], None], jobs: Sequence[T]) -> None:
    """Calls `take` here with every job and what `make` gave for it in some thread, one after the other."""
    if len(jobs) < 3:
        for job in jobs:
            take(job, make(job))
        return
    ahead = 2 * (os.cpu_count() or 1)  # what is made and not yet taken
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        made = deque(pool.submit(make, job) for job in jobs[:ahead])
        for job, following in zip(jobs, [*jobs[ahead:], *[None] * ahead], strict=False):
            take(job, made.popleft().result())
            if following is not None:
                made.append(pool.submit(make, following))
