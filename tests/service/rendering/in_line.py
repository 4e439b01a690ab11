"""Renders that do nothing but wait, run and give way, and the slots that they have: for tests of who has one."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from service.server.renders.slots import Slots


class Fake:
    """A render that runs until it is told to end or gives way."""

    def __init__(self, id: str, owner: str = "", **more: Any) -> None:
        self.id, self.owner, self.client = id, owner, owner or id
        self.place = self.priority = self.lacks = self.resident_bytes = 0
        self.elapsed_s, self.memory_share, self.began, self.fits = 0.0, 0.0, False, True
        self.lasting = self.can_give_way = True
        self.finished, self.leaves = asyncio.Event(), asyncio.Event()
        vars(self).update(more)

    def reserve(self) -> bool:
        return self.fits

    async def run(self) -> None:
        self.leaves.clear()
        waits = [asyncio.ensure_future(event.wait()) for event in (self.finished, self.leaves)]
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        for wait in waits:
            wait.cancel()

    def died(self, error: Exception) -> None:
        self.finished.set()

    async def give_way(self) -> bool:
        self.began = True
        self.leaves.set()
        return True


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


async def settled() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


def scenario(most: int, test: Callable[[Any, Clock, Callable[[], list[str]]], Awaitable[None]]) -> None:
    async def run() -> None:
        clock = Clock()
        owned: Any = Slots(most, lambda job: None, clock)
        await test(owned, clock, lambda: sorted(job.id for job in owned.running))
        owned.close()
        for job in owned.running:
            job.finished.set()
        await settled()

    asyncio.run(run())


async def later(owned: Any, clock: Clock, seconds: float) -> None:
    """What happens within that time, looked at every second."""
    for _ in range(int(seconds)):
        clock.now += 1.0
        owned._look()
        await settled()


def add(owned: Any, *jobs: Fake) -> None:
    for job in jobs:
        owned.add(job)
        owned.dispatch()
