"""What is kept of renders that have ended, for whom, and how many may be under way."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from service.problems import Gone, InvalidDocument, NotFound, TooManyRequests, Unavailable
from service.server.renders.followers import Changes
from service.server.renders.queue import RenderQueue
from service.server.renders.retention import QueueLimits
from tests.queues import LIMITS


class Job:
    """As much of a job as its keeper looks at; it runs until told to end."""

    batch = None

    def __init__(self, id: str, owner: str = "", size: int = 1, priority: int = 0, label: str | None = None) -> None:
        self.id, self.owner, self.size, self.ended_at, self.counts_as = id, owner, size, 0.0, 1
        self.order = SimpleNamespace(label=label, bytes=0)
        self.client = owner or id
        self.priority, self.began, self.number, self.resident_bytes = priority, False, 0, 0
        self.state, self.recorder, self.lasting, self.shown = "queued", None, True, False
        self.place, self.memory_share, self.lacks, self.elapsed_s, self.can_give_way = 0, 0.0, 0, 0.0, False
        self.finished, self.released, self.packed = asyncio.Event(), False, True
        self.changes, self.scene, self.died = Changes[Any](), self, None

    async def run(self) -> None:
        self.state = "running"
        await self.finished.wait()
        self.ended_at, self.state = time.monotonic(), "done"

    def reserve(self) -> bool:
        return True

    def set_aside(self) -> None:
        self.packed = False

    def cancel(self) -> None:
        self.finished.set()

    def release(self) -> None:
        self.released = True


async def ended(renders: Any, *jobs: Job) -> None:
    for job in jobs:
        await renders.submit(job)
        job.finished.set()
        await asyncio.sleep(0.01)


def keeping(bounds: QueueLimits, scenario: Callable[[Any], Awaitable[None]]) -> None:
    async def run() -> None:
        await scenario(RenderQueue(bounds))

    asyncio.run(run())


def test_the_oldest_of_an_owner_make_room() -> None:
    async def scenario(renders: Any) -> None:
        await ended(renders, *(Job(f"a{i}", "a") for i in range(4)), Job("b0", "b"))
        assert [job.id for job in (await renders.page("a")).renders] == ["a3", "a2"]
        assert [job.id for job in (await renders.page("b")).renders] == ["b0"]
        with pytest.raises(Gone):
            renders.get("a0", "a")
        with pytest.raises(NotFound):
            renders.get("a0", "b")

    keeping(replace(LIMITS, retention=replace(LIMITS.retention, most_renders=2)), scenario)


def test_who_holds_most_makes_room() -> None:
    async def scenario(renders: Any) -> None:
        small = Job("small", "b", 10)
        big = [Job(f"a{i}", "a", 60) for i in range(2)]
        await ended(renders, small, *big)
        assert renders.get("small", "b") is small and renders.get("a1", "a") is big[1]
        assert big[0].released and not small.released

    keeping(replace(LIMITS, retention=replace(LIMITS.retention, most_bytes=100)), scenario)


def test_the_newest_stays_however_large() -> None:
    async def scenario(renders: Any) -> None:
        await ended(renders, Job("a", size=1000))
        assert renders.get("a").id == "a"

    keeping(replace(LIMITS, retention=replace(LIMITS.retention, most_bytes=10)), scenario)


def test_time_makes_an_end() -> None:
    async def scenario(renders: Any) -> None:
        first = Job("first")
        await ended(renders, first)
        assert renders.get("first") is first
        await asyncio.sleep(1.2)
        with pytest.raises(Gone):
            renders.get("first")
        assert first.released and renders.retained == 0

    keeping(replace(LIMITS, retention=replace(LIMITS.retention, longest_s=0.05)), scenario)


def test_others_do_not_hear_of_it() -> None:
    async def scenario(renders: Any) -> None:
        await renders.submit(Job("mine", "a"))
        for owner in ("b", ""):
            with pytest.raises(NotFound):
                renders.get("mine", owner)
            assert (await renders.page(owner)).renders == []
        await renders.close()

    keeping(LIMITS, scenario)


def test_there_is_an_end_to_the_queue() -> None:
    async def scenario(renders: Any) -> None:
        jobs = [Job(f"j{i}", owner) for i, owner in enumerate("aab")]
        for job in jobs:
            await renders.submit(job)
        assert (renders.running, renders.queued) == (1, 2)
        with pytest.raises(TooManyRequests, match="SUNBOX_MAX_JOBS"):
            await renders.submit(Job("more", "a"))
        with pytest.raises(Unavailable, match="SUNBOX_MAX_QUEUE"):
            await renders.submit(Job("more", "c"))
        assert [job.packed for job in jobs] == [True, False, False]
        jobs[0].cancel()
        await asyncio.sleep(0.01)
        await renders.submit(Job("more", "a"))
        await renders.close()

    keeping(replace(LIMITS, running=1, waiting=2, each=2), scenario)


def test_a_full_queue_takes_renders_of_keys_with_less_than_their_share() -> None:
    async def scenario(renders: Any) -> None:
        for i in range(7):
            await renders.submit(Job(f"a{i}", "a"))
        with pytest.raises(Unavailable, match="SUNBOX_MAX_QUEUE"):
            await renders.submit(Job("a7", "a"))
        for i in range(3):
            await renders.submit(Job(f"b{i}", "b"))
        with pytest.raises(Unavailable, match="SUNBOX_MAX_QUEUE"):
            await renders.submit(Job("b3", "b"))
        await renders.submit(Job("c0", "c"))
        await renders.close()

    keeping(replace(LIMITS, running=1, waiting=6), scenario)


async def order(renders: Any, jobs: list[Job]) -> list[str]:
    """The ids in the order in which the jobs run, of which each ends as soon as it began."""
    ran = []
    while len(ran) < len(jobs):
        await asyncio.sleep(0)
        for job in jobs:
            if job.state == "running":
                job.finished.set()
                ran.append(job.id)
                job.state = "seen"
    return ran


def test_slots_go_round_the_keys_and_among_ones_own_by_priority() -> None:
    async def scenario(renders: Any) -> None:
        first = Job("first", "a")
        await renders.submit(first)
        await asyncio.sleep(0.01)
        jobs = [Job("a0", "a"), Job("a1", "a", priority=-1), Job("a2", "a", priority=5), Job("a3", "a")]
        jobs += [Job("b0", "b"), Job("b1", "b"), Job("c0", "c", priority=-10)]
        for job in jobs:
            await renders.submit(job)
        first.finished.set()
        assert await order(renders, jobs) == ["b0", "c0", "a2", "b1", "a0", "a3", "a1"]

    keeping(replace(LIMITS, running=1), scenario)


def test_a_key_with_many_renders_has_its_share_of_the_slots() -> None:
    async def scenario(renders: Any) -> None:
        jobs = [Job(f"a{i}", "a") for i in range(6)]
        for job in jobs:
            await renders.submit(job)
        other = Job("b0", "b")
        await renders.submit(other)
        await asyncio.sleep(0.01)
        assert [job.id for job in jobs if job.state == "running"] == ["a0", "a1", "a2"]
        jobs[0].finished.set()
        await asyncio.sleep(0.01)
        assert other.state == "running" and jobs[3].state == "queued"
        await renders.close()

    keeping(replace(LIMITS, running=3), scenario)


def test_what_is_cancelled_while_it_waits_leaves_the_queue() -> None:
    async def scenario(renders: Any) -> None:
        jobs = [Job(f"a{i}", "a") for i in range(3)]
        for job in jobs:
            await renders.submit(job)
        renders.cancel(jobs[1])
        assert renders.queued == 1
        jobs[0].finished.set()
        await asyncio.sleep(0.01)
        assert jobs[2].state == "running" and renders.queued == 0
        await renders.close()

    keeping(replace(LIMITS, running=1), scenario)


def test_pages() -> None:
    async def scenario(renders: Any) -> None:
        for i in range(5):
            await renders.submit(Job(f"a{i}", "a", label="odd" if i % 2 else None))
        await renders.submit(Job("b", "b"))

        async def page(**query: Any) -> tuple[list[str], bool]:
            found = await renders.page("a", **query)
            return [job.id for job in found.renders], found.more

        assert await page(limit=2) == (["a4", "a3"], True)
        assert await page(limit=2, after="a3") == (["a2", "a1"], True)
        assert await page(limit=2, after="a1") == (["a0"], False)
        assert await page(limit=2, label="odd") == (["a3", "a1"], False)
        await asyncio.sleep(0.01)
        assert await page(state="queued") == (["a4", "a3", "a2", "a1"], False)
        for other in ("b", "unknown"):
            with pytest.raises(InvalidDocument):
                await page(after=other)
        await renders.close()

    keeping(replace(LIMITS, running=1), scenario)
