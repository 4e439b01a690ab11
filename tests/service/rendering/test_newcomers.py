"""Who has no slot comes first: beside a client that would take all of them, and beside single ones of many."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from service.server.renders.slots import RECENT_S, Slots
from tests.counting import in_simulated_time
from tests.service.rendering.in_line import Clock, Fake, add, later, scenario, settled


def test_equal_shares_leave_the_last_place_to_a_third() -> None:
    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        add(owned, *(Fake(f"{owner}{i}", owner) for i in range(5) for owner in "ab"))
        assert running() == ["a0", "a1", "a2", "b0", "b1"]
        add(owned, third := Fake("c0", "c"))
        assert running()[-1] == "c0"
        third.finished.set()
        await later(owned, clock, 30)
        assert running() == ["a0", "a1", "a2", "b0", "b1"]

    scenario(6, test)


@pytest.mark.parametrize("owners", [("a", "b"), ("", "")])
def test_small_renders_do_not_wait_for_endless_ones(owners: tuple[str, str]) -> None:
    """One key, or somebody without one, has eight endless renders and a line of others; the first small render of
    another waits for a moment. Those that come after it find the place that they were given; without keys each is its
    own client, for whom others give way again."""

    async def test() -> None:
        loop = asyncio.get_running_loop()
        owned: Any = Slots(8, lambda job: None, loop.time)
        endless = [Fake(f"endless{i}", owners[0], elapsed_s=100.0 + i) for i in range(8)]
        add(owned, *endless, *(Fake(f"line{i}", owners[0]) for i in range(20 if owners[0] else 0)))
        waits = list[float]()
        for number in range(20):
            small = Fake(f"small{number}", owners[1], lasting=False, can_give_way=False)
            asked = loop.time()
            add(owned, small)
            while small not in owned.running:
                await asyncio.sleep(0.05)
            waits.append(loop.time() - asked)
            await asyncio.sleep(0.3)
            small.elapsed_s = 0.3
            small.finished.set()
            await asyncio.sleep(0.1 + number % 5)
        assert max(waits) <= 2.1
        if owners[0]:
            assert waits[0] >= 1.0 and max(waits[1:]) == 0.0
        assert len(owned.running) >= 7
        await asyncio.sleep(RECENT_S + 1.0)
        assert len(owned.running) == 8
        for job in [*owned.running, *owned.waiting]:
            job.finished.set()
        owned.close()
        await settled()

    in_simulated_time(test())


def test_who_had_more_than_a_little_interrupts_no_single_render_at_once() -> None:
    """Each has one, so that it is the time that is divided: small renders one after the other may not cost the
    endless one a checkpoint each."""

    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        add(owned, Fake("a0", "a", elapsed_s=100.0))
        for number, waits in enumerate((1, 1, 10)):
            add(owned, small := Fake(f"b{number}", "b"))
            await later(owned, clock, waits - 1)
            assert running() == ["a0"]
            await later(owned, clock, 1)
            assert running() == [small.id]
            small.elapsed_s = 0.6
            small.finished.set()
            await settled()
        clock.now += RECENT_S
        add(owned, Fake("b3", "b"))
        await later(owned, clock, 1)
        assert running() == ["b3"]

    scenario(1, test)
