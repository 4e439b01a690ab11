"""A Ray cluster on this machine, and its processes."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from pathlib import Path

from service.rendering.cluster.cluster import Cluster
from service.rendering.renderers import Place
from service.rendering.supervisor.pool import Pool, Seat
from service.rendering.supervisor.process import Options

OPTIONS = {"patience_s": 10.0, "checkpoint_s": 0.05}


def seats(cluster: Cluster) -> list[Seat]:
    return [
        Seat(Place(str(number), "ray"), Options(), cluster.starter(number))
        for number in range(cluster.joined.renderers)
    ]


async def with_pool(cluster: Cluster, test: Callable[[Pool], Awaitable[None]]) -> None:
    pool = Pool(seats(cluster))
    pool.start()
    try:
        await pool.ready(30)
        await test(pool)
    finally:
        await pool.close()


async def until(condition: Callable[[], object], patience_s: float = 40.0) -> None:
    by = asyncio.get_running_loop().time() + patience_s
    while not condition():
        assert asyncio.get_running_loop().time() < by
        await asyncio.sleep(0.02)


def descendants(pid: int, word: str) -> list[int]:
    """The processes below `pid` that have that word in their command line."""
    found, parents = [], dict[int, int]()
    for process in (each for each in Path("/proc").iterdir() if each.name.isdigit()):
        with suppress(OSError):
            parents[int(process.name)] = int((process / "stat").read_text().rsplit(")", 1)[1].split()[1])
    for child in parents:
        if pid in ancestors(child, parents):
            with suppress(OSError):
                if word in Path(f"/proc/{child}/cmdline").read_text():
                    found.append(child)
    return found


def ancestors(pid: int, parents: dict[int, int]) -> Iterator[int]:
    while (pid := parents.get(pid, 0)) > 1:
        yield pid


def kill(pid: int) -> None:
    os.kill(pid, 9)
