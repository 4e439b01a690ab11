"""Turns at the server's threads go round the clients."""

from __future__ import annotations

import asyncio
import threading

import pytest

from service.system.executors import ClientExecutor, Pool
from service.system.shares import CALLER


def test_a_flood_delays_its_sender_alone() -> None:
    """While the only thread is at work, its client leaves ten more pieces and two others leave one each."""
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
    assert done == ["second", "third", *["flood"] * 10]


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


def test_one_client_never_has_all_threads() -> None:
    """Work of minutes, as four large uploads of one client are: another one's work does not wait for it."""

    async def run() -> None:
        pool, go_on = Pool("test", 3, each=2), threading.Event()
        works = [asyncio.ensure_future(pool(lambda: go_on.wait(60), "large")) for _ in range(4)]
        try:
            async with asyncio.timeout(30):
                assert await pool(lambda: 1, "small") == 1
            assert not any(work.done() for work in works)
        finally:
            go_on.set()
        await asyncio.gather(*works)  # those that had to wait as well
        assert await pool(lambda: 2, "large") == 2

    asyncio.run(run())


def test_work_is_done_for_who_asks() -> None:
    async def run() -> None:
        pool = Pool("test", 1)
        CALLER.set("anna")
        assert await pool(CALLER.get) == "anna"
        assert await pool(CALLER.get, "bert") == "bert" and CALLER.get() == "anna"
        stream = ClientExecutor("test")
        assert await stream.run(CALLER.get) == "anna"
        stream.close()

    asyncio.run(run())


def test_no_work_is_forgotten() -> None:
    """Many clients and threads, while some give up."""

    async def run() -> None:
        pool, done = Pool("test", 3, each=2), list[int]()
        works = [asyncio.ensure_future(pool(lambda i=i: done.append(i), f"{i % 7}")) for i in range(500)]  # type: ignore[misc]
        await asyncio.sleep(0)
        for work in works[::5]:
            work.cancel()
        await asyncio.gather(*works, return_exceptions=True)
        assert set(done) >= {i for i in range(500) if i % 5} and len(set(done)) == len(done)

    asyncio.run(run())
