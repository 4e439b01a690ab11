"""Turns at the server's threads go round the clients."""

from __future__ import annotations

import asyncio
import threading

import pytest

from service.rendering.executors import Pool


def test_a_flood_delays_its_sender_alone() -> None:
    """While the only thread is at work, one client leaves ten pieces of work and two others leave one each."""
    done: list[str] = []
    began, go_on = threading.Event(), threading.Event()

    def first() -> None:
        began.set()
        go_on.wait(10)

    async def run() -> None:
        pool = Pool("test", 1)
        works = [asyncio.ensure_future(pool(first, "flood"))]
        await asyncio.to_thread(began.wait, 10)
        for client in (*["flood"] * 10, "second", "third"):
            works.append(asyncio.ensure_future(pool(lambda client=client: done.append(client), client)))  # type: ignore[misc]
            await asyncio.sleep(0)
        go_on.set()
        await asyncio.gather(*works)

    asyncio.run(run())
    assert done[:3] == ["flood", "second", "third"] and done[3:] == ["flood"] * 9


def test_results_errors_and_cancelled_work() -> None:
    def fail() -> None:
        raise ValueError("mine")

    async def run() -> None:
        pool, ran = Pool("test", 1), list[int]()
        go_on = threading.Event()
        busy = asyncio.ensure_future(pool(lambda: go_on.wait(10)))
        given_up = asyncio.ensure_future(pool(lambda: ran.append(1)))
        await asyncio.sleep(0)
        given_up.cancel()
        await asyncio.sleep(0)
        go_on.set()
        assert await busy and await pool(lambda: 42) == 42 and ran == []
        with pytest.raises(ValueError, match="mine"):
            await pool(fail)

    asyncio.run(run())
