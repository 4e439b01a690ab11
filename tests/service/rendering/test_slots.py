"""Which renders have the slots: nothing holds a slot that waits, and who has more than its share gives way."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.document.quality import ResolvedSettings
from service.ipc.messages import Done, Progress, SavedPicture, View
from service.pack import RENDERED_PIXEL_BYTES, SAVED_PIXEL_BYTES, Packed
from service.renderers.local.supervisor import Supervisor
from service.server.renders import slots
from service.server.renders.queue import RenderQueue
from service.server.renders.render import Render
from service.server.renders.slots import RECENT_S, giving_way
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.store import RenderStore
from service.server.storage.asset_access import NO_USES
from service.system.memory import MemoryBudget
from tests.queues import LIMITS
from tests.service.rendering.fakes import PACKED, SETTINGS, Quick, Renderers, until
from tests.service.rendering.in_line import Clock, Fake, add, later, scenario, settled
from tests.supervisors import renderer_options


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slots, "LOOK_S", 0.005)
    monkeypatch.setattr(slots, "AGAIN_S", 0.01)


PIXELS = SETTINGS.width * SETTINGS.height
PICTURE = PIXELS * (RENDERED_PIXEL_BYTES + SAVED_PIXEL_BYTES)
SCENE = 2 * PACKED.bytes


def test_renders_that_need_more_memory_to_be_read_all_end_after_a_restart(tmp_path: Path, impatient: None) -> None:
    """All pictures fit together, but then no document can be read any more; a stranger's render is not kept back."""
    budget = MemoryBudget(8 * PICTURE + SCENE)
    read = list[int]()

    async def load(document: bytes, count: Callable[[int], None]) -> Packed:
        await asyncio.sleep(0)  # all that run come to this place before the first one goes on
        count(budget.limit - PICTURE)
        read.append(budget.used()["pictures"])
        await asyncio.sleep(0.001)
        return PACKED

    async def scenario() -> None:
        store, renderers = RenderStore(tmp_path), Quick()
        for id in range(8):
            await store.insert(Order(f"{id}", "", SETTINGS, bytes=8), Outcome("running"), b"document", NO_USES)
        queue = RenderQueue(replace(LIMITS, running=8), store)
        budget.cache("pictures", lambda: 0, queue.loaded_pictures.shrink)
        made = lambda stored: Render(renderers, stored.order, load, outcome=stored.outcome, budget=budget)  # type: ignore[arg-type]  # noqa: E731
        queue.resume(store.load(), made)
        stranger = Render(renderers, Order("stranger", "", SETTINGS), load, b"small", PACKED, budget=MemoryBudget())  # type: ignore[arg-type]
        await queue.submit(stranger, listed=False)
        await until(stranger.finished.is_set)
        jobs = (await queue.page()).renders
        await until(lambda: all(job.finished.is_set() for job in jobs))
        assert {job.state for job in jobs} == {"done"} and len(read) <= 16  # once to learn how large it is
        await queue.close()

    asyncio.run(scenario())


def test_what_waits_for_memory_has_neither_memory_nor_a_slot(tmp_path: Path) -> None:
    budget = MemoryBudget(3 * PICTURE)

    async def load(document: bytes, count: Callable[[int], None]) -> Packed:
        raise AssertionError("it was to wait")

    async def scenario() -> None:
        store = RenderStore(tmp_path)
        await store.insert(Order("a", "", SETTINGS, bytes=8), Outcome("running"), b"document", NO_USES)
        queue = RenderQueue(replace(LIMITS, running=1), store)
        budget.hold("scenes", queue, 3 * PICTURE - 1)
        queue.resume(store.load(), lambda stored: Render(Renderers(), stored.order, load, budget=budget))  # type: ignore[arg-type]
        assert (queue.running, queue.queued, budget.used()["pictures"]) == (0, 1, 0)
        await queue.close()

    asyncio.run(scenario())


def test_an_owner_with_all_slots_gives_back_its_newest_ones() -> None:
    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        add(owned, *(Fake(f"a{i}", "a") for i in range(10)))
        await later(owned, clock, 30)
        assert running() == [f"a{i}" for i in range(8)]  # nobody else waits
        bs = [Fake(f"b{i}", "b") for i in range(6)]
        add(owned, *bs)
        assert running() == [f"a{i}" for i in range(8)]
        await later(owned, clock, 1)  # as b has nothing
        assert running() == [*(f"a{i}" for i in range(7)), "b0"]
        await later(owned, clock, 8)
        assert running() == [*(f"a{i}" for i in range(7)), "b0"]
        await later(owned, clock, 1)
        assert running() == [*(f"a{i}" for i in range(6)), "b0", "b1"]
        await later(owned, clock, 20)
        assert running() == ["a0", "a1", "a2", "a3", "b0", "b1", "b2", "b3"]
        await later(owned, clock, 60)
        assert running() == ["a0", "a1", "a2", "a3", "b0", "b1", "b2", "b3"]  # an equal share stays
        for each in bs:
            owned.remove(each)
            each.finished.set()
        await settled()
        # Its places are kept: those that gave way go on before the ones that have not begun.
        assert running() == [f"a{i}" for i in range(7)]
        await later(owned, clock, RECENT_S)  # for which the last place waits for b
        assert running() == [f"a{i}" for i in range(8)]

    scenario(8, test)


def test_without_keys_a_new_render_has_its_turn_beside_endless_ones() -> None:
    """And an endless one gives way the less often, the longer it has been rendered."""

    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        nightly = [Fake(f"n{i}", elapsed_s=4000.0 + i) for i in range(3)]
        add(owned, *nightly)
        new = Fake("new")
        add(owned, new)
        await later(owned, clock, 11)
        assert running() == ["n0", "n1", "new"]  # the one that had most time
        new.elapsed_s = 1000.0
        await later(owned, clock, 60)
        assert running() == ["n0", "n1", "new"]  # as the one that waits had more than half of theirs
        nightly[0].elapsed_s = 2 * nightly[2].elapsed_s
        await later(owned, clock, 11)
        assert running() == ["n1", "n2", "new"]

    scenario(3, test)


def test_a_lower_priority_interrupts_none_of_its_owners() -> None:
    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        add(owned, Fake("first", priority=1, elapsed_s=100.0), Fake("second"))
        await later(owned, clock, 30)
        assert running() == ["first"]

    scenario(1, test)


def test_renders_that_cannot_be_stored_leave_slots_to_others() -> None:
    """One that waits on an open connection is not interrupted, so that one key has half of the slots for them."""

    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        fixed = {"lasting": False, "can_give_way": False}
        add(owned, *(Fake(f"a{i}", "a", **fixed) for i in range(8)))
        add(owned, Fake("b0", "b", **fixed), Fake("b1", "b"))
        assert running() == ["a0", "a1", "a2", "a3", "b0", "b1"]
        add(owned, *(Fake(f"c{i}", **fixed) for i in range(2)))  # without a key each is its own client
        assert running()[-2:] == ["c0", "c1"]

    scenario(8, test)


def test_others_pass_what_waits_for_memory_and_do_not_starve_it() -> None:
    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        large = Fake("large", fits=False, memory_share=0.9, lacks=1)
        add(owned, large, Fake("a", can_give_way=False, memory_share=0.2))
        assert running() == ["a"]
        await later(owned, clock, slots.PATIENCE_S)
        add(owned, Fake("b", can_give_way=False, memory_share=0.2), Fake("c", can_give_way=False, memory_share=0.01))
        assert running() == ["a", "c"]  # small ones go on passing it
        large.fits = True
        await later(owned, clock, slots.AGAIN_S)
        assert "large" in running()
        large.finished.set()
        await settled()
        assert running() == ["a", "b", "c"]

    scenario(4, test)


def test_one_that_never_fits_keeps_others_back_for_half_of_the_time() -> None:
    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        add(owned, Fake("large", fits=False, memory_share=0.9, lacks=1))
        await later(owned, clock, slots.PATIENCE_S)
        add(owned, Fake("other", can_give_way=False, memory_share=0.2))
        await later(owned, clock, slots.PATIENCE_S - 1)
        assert running() == []
        await later(owned, clock, 1)
        assert running() == ["other"]

    scenario(4, test)


def test_memory_is_given_back_as_slots_are() -> None:
    async def test(owned: Any, clock: Clock, running: Callable[[], list[str]]) -> None:
        add(owned, *(Fake(f"a{i}", "a", resident_bytes=100) for i in range(3)))
        b = Fake("b", "b", fits=False, lacks=150)
        give_way = Fake.give_way

        async def gives(job: Any) -> bool:
            b.lacks -= 100
            b.fits = b.lacks <= 0
            return await give_way(job)

        for job in owned.running:
            job.give_way = lambda job=job: gives(job)
        add(owned, b)
        assert running() == ["a0", "a1", "a2"]
        await later(owned, clock, 2)
        assert "b" in running() and "a0" in running()

    scenario(8, test)


def test_nobody_gives_way_for_nothing() -> None:
    """Where the memory would not do, or where it would not be fair."""
    other: Any = [SimpleNamespace(**vars(Fake(f"a{i}", "a", resident_bytes=10))) for i in range(3)]
    waiting: Any = SimpleNamespace(**vars(Fake("b", "b")))
    assert [each.id for each in giving_way(waiting, other, 0, 0)] == ["a0"]
    for number, each in enumerate(other):
        each.place = number
    assert [each.id for each in giving_way(waiting, other, 0, 0)] == ["a2"]
    assert giving_way(waiting, other, 0, 1000) == []
    assert giving_way(waiting, other[:1], 0, 0) == []  # each would have one, in turns that are shorter than WAIT_S
    other[0].elapsed_s = slots.WAIT_S
    assert giving_way(waiting, other[:1], 0, 0) == other[:1]
    waiting.elapsed_s = slots.WAIT_S / 2 + 1
    assert giving_way(waiting, other[:1], 0, 0) == []


LONG = ResolvedSettings(**(vars(SETTINGS) | {"width": 96, "height": 96, "max_samples": 400}))


@pytest.mark.slow
def test_what_gave_way_ends_with_the_same_bits(
    gpu: Renderer, tmp_path: Path, impatient: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slots, "WAIT_S", 0.05)

    async def load(document: bytes, count: Callable[[int], None]) -> Packed:
        return PACKED

    async def scenario() -> None:
        supervisor = Supervisor(renderer_options(checkpoint_s=2.0))
        supervisor.start()
        await supervisor.ready(30)
        queue = RenderQueue(replace(LIMITS, running=1), RenderStore(tmp_path))
        job = {
            id: Render(supervisor, Order(id, owner, LONG, bytes=8), load, b"document", PACKED)
            for id, owner in (("undisturbed", "a"), ("a0", "a"), ("b0", "b"))
        }
        try:
            await queue.submit(job["undisturbed"])
            await job["undisturbed"].finished.wait()
            monkeypatch.setattr(slots, "WAIT_S", 0.0)
            await queue.submit(job["a0"])
            await until(lambda: job["a0"].outcome.progress.samples >= 20)
            await queue.submit(job["b0"])
            await until(lambda: job["b0"].state == "running")
            status = job["a0"].status()
            assert status["state"] == "queued" and 20 <= status["samples"] < 400 and status["elapsed_s"] > 0
            assert job["a0"].began
            seen = [status["samples"]]
            while not job["a0"].finished.is_set():
                seen.append(job["a0"].status()["samples"])
                await asyncio.sleep(0.01)
            assert seen == sorted(seen) and job["a0"].state == "done"
            first, again = [(await job[id].image(View()))[0] for id in ("undisturbed", "a0")]
            assert np.array_equal(first, again)
        finally:
            await queue.close()
            await supervisor.close()

    asyncio.run(asyncio.wait_for(scenario(), 100))


def test_a_render_that_ends_while_it_is_to_give_way_has_ended(tmp_path: Path) -> None:
    async def load(document: bytes, count: Callable[[int], None]) -> Packed:
        return PACKED

    async def scenario() -> None:
        renderers: Any = Renderers()
        queue = RenderQueue(replace(LIMITS, running=1), RenderStore(tmp_path))
        job = Render(renderers, Order("id", "a", SETTINGS, bytes=8), load, b"document", PACKED)
        await queue.submit(job)
        await until(lambda: renderers.sent)
        job.outcome = Outcome("running", progress=Progress(4, None, 2.0))
        assert job.can_give_way
        giving = asyncio.create_task(job.give_way())
        await asyncio.sleep(0.01)
        saved = SavedPicture(8, (0, 0, 0), [np.arange(64, dtype=np.uint8)])
        job.heard(Done(1, 1, "max_samples", Progress(8, None, 3.0), [], saved))
        assert not await giving
        await until(job.finished.is_set)
        assert job.state == "done"
        await until(lambda: queue.running == 0)
        await queue.close()

    asyncio.run(scenario())
