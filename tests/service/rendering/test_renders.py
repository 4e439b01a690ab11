"""What is kept of renders that have ended, for whom, and how many may be under way."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from service.problems import Gone, NotFound, TooManyRequests, Unavailable
from service.rendering.jobs.queue import QueueLimits, RenderQueue


class Job:
    """As much of a job as its keeper looks at; it runs until told to end."""

    def __init__(self, id: str, owner: str = "", size: int = 1) -> None:
        self.id, self.owner, self.bytes, self.ended_at = id, owner, size, 0.0
        self.finished, self.released = asyncio.Event(), False

    async def run(self) -> None:
        await self.finished.wait()
        self.ended_at = time.monotonic()

    def cancel(self) -> None:
        self.finished.set()

    def release(self) -> None:
        self.released = True


async def ended(renders: Any, *jobs: Job) -> None:
    for job in jobs:
        renders.submit(job)
        job.finished.set()
        await asyncio.sleep(0.01)


def keeping(bounds: QueueLimits, scenario: Callable[[Any], Awaitable[None]]) -> None:
    async def run() -> None:
        await scenario(RenderQueue(bounds))

    asyncio.run(run())


def test_the_oldest_of_an_owner_make_room() -> None:
    async def scenario(renders: Any) -> None:
        await ended(renders, *(Job(f"a{i}", "a") for i in range(4)), Job("b0", "b"))
        assert [job.id for job in renders.all("a")] == ["a2", "a3"] and [job.id for job in renders.all("b")] == ["b0"]
        with pytest.raises(Gone):
            renders.get("a0", "a")
        with pytest.raises(NotFound):
            renders.get("a0", "b")

    keeping(QueueLimits(kept=2), scenario)


def test_who_holds_most_makes_room() -> None:
    async def scenario(renders: Any) -> None:
        small = Job("small", "b", 10)
        big = [Job(f"a{i}", "a", 60) for i in range(2)]
        await ended(renders, small, *big)
        assert renders.get("small", "b") is small and renders.get("a1", "a") is big[1]
        assert big[0].released and not small.released

    keeping(QueueLimits(kept_bytes=100), scenario)


def test_the_newest_stays_however_large() -> None:
    async def scenario(renders: Any) -> None:
        await ended(renders, Job("a", size=1000))
        assert renders.get("a").id == "a"

    keeping(QueueLimits(kept_bytes=10), scenario)


def test_time_makes_an_end() -> None:
    async def scenario(renders: Any) -> None:
        first = Job("first")
        await ended(renders, first)
        assert renders.get("first") is first
        await asyncio.sleep(1.2)
        with pytest.raises(Gone):
            renders.get("first")
        assert first.released and renders.kept == 0

    keeping(QueueLimits(kept_s=0.05), scenario)


def test_others_do_not_hear_of_it() -> None:
    async def scenario(renders: Any) -> None:
        renders.submit(Job("mine", "a"))
        for owner in ("b", ""):
            with pytest.raises(NotFound):
                renders.get("mine", owner)
            assert renders.all(owner) == []
        renders.close()

    keeping(QueueLimits(), scenario)


def test_there_is_an_end_to_the_queue() -> None:
    async def scenario(renders: Any) -> None:
        jobs = [Job(f"j{i}", owner) for i, owner in enumerate("aab")]
        for job in jobs:
            renders.submit(job)
        assert (renders.running, renders.queued) == (1, 2)
        with pytest.raises(TooManyRequests, match="SUNBOX_MAX_JOBS"):
            renders.submit(Job("more", "a"))
        with pytest.raises(Unavailable, match="SUNBOX_MAX_QUEUE"):
            renders.submit(Job("more", "c"))
        jobs[0].cancel()
        await asyncio.sleep(0.01)
        renders.submit(Job("more", "a"))
        renders.close()

    keeping(QueueLimits(running=1, waiting=2, each=2), scenario)
