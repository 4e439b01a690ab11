"""A render's events, in simulated time: how many are sent, and what is sent when nothing changes."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any, cast

from service.server.renders.render import Render
from service.server.routes import events
from tests.counting import in_simulated_time


class Changing:
    """Stands for a job whose status changes every hundredth of a second for `busy_s`; it ends at `ends_s`."""

    def __init__(self, busy_s: float, ends_s: float) -> None:
        self._busy_s, self._ends_s = busy_s, ends_s
        self.finished = asyncio.Event()

    async def changed(self) -> bool:
        now_s = asyncio.get_running_loop().time()
        if now_s < self._busy_s:
            await asyncio.sleep(0.01)
        else:
            await asyncio.sleep(self._ends_s - now_s)
            self.finished.set()
        return True

    def status(self) -> dict[str, Any]:
        return {"at": asyncio.get_running_loop().time()}


def sent(busy_s: float, ends_s: float) -> list[str]:
    found: list[str] = []

    async def test() -> None:
        with suppress(StopAsyncIteration):
            pieces = events._events(cast(Render, Changing(busy_s, ends_s)))
            while True:
                found.append((await anext(pieces)).decode().partition("\n")[0])

    in_simulated_time(test())
    return found


def test_ten_events_a_second_are_sent_at_most() -> None:
    told = sent(busy_s=5.0, ends_s=6.0)
    assert told == ["event: progress"] * (len(told) - 1) + ["event: done"]
    assert 48 <= len(told) - 1 <= 52


def test_a_comment_keeps_the_connection_where_nothing_changes() -> None:
    assert sent(busy_s=0.0, ends_s=40.0) == ["event: progress", ": still there", ": still there", "event: done"]
