"""Batches whose renders cannot all be made: the others go on, and the batch ends."""

from __future__ import annotations

import asyncio
import gc
import json
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from service.config import MIB, Config
from service.problems import MISTAKE, NotFound, TooLarge, TooManyRequests
from service.server.batches.batch import Batch, member_id
from service.server.batches.batch import Members as RealMembers
from service.server.batches.queue import BatchQueue
from service.server.renders.queue import RenderQueue
from service.server.renders.render import Render
from service.server.renders.store.batch_rows import BatchOrder
from service.server.renders.store.record import Order, Outcome, StoredRender
from service.server.renders.store.store import RenderStore
from service.server.requests.request_parser import folded
from service.server.requests.request_reader import RequestReader
from service.server.storage.asset_access import NO_USES
from service.system.shares import CALLER
from tests.documents import Shelf
from tests.queues import LIMITS
from tests.service.rendering.fakes import PACKED, Quick, Renderers, load, until
from tests.serving import SCENE

RENDERS = 5


class Members:
    """Makes renders."""

    def __init__(self, batch: Batch, renderers: Quick) -> None:
        self._batch, self._renderers = batch, renderers

    async def check(self) -> None: ...

    async def job(self, step: int, stored: bool) -> Render:
        return Render(self._renderers, self._batch.member(step), load, b"document", PACKED)  # type: ignore[arg-type]


class Faulty(Members):
    """But for one that is too large and one that meets a mistake of the server's."""

    async def job(self, step: int, stored: bool) -> Render:
        if step == 1:
            raise TooLarge("It never fits.", "/settings/width")
        if step == RENDERS - 1:
            raise ZeroDivisionError
        return await super().job(step, stored)


async def why(batches: BatchQueue, batch: Batch, step: int) -> Any:
    return ((await batches.render_of(batch, step)).outcome.problem or {})["detail"]


@pytest.mark.parametrize("stored", [False, True])
def test_a_render_that_cannot_be_made_fails_alone(tmp_path: Path, stored: bool) -> None:
    renderers = Quick()
    store = RenderStore(tmp_path) if stored else None

    def ended(order: Order, outcome: Outcome) -> Render:
        return Render(renderers, order, load, outcome=outcome)  # type: ignore[arg-type]

    def queue(renders: RenderQueue) -> BatchQueue:
        members: Any = lambda batch, body: Faulty(batch, renderers)  # noqa: E731
        return BatchQueue(renders, members, ended, 2)

    async def scenario() -> None:
        renders = RenderQueue(LIMITS, store)
        if store is not None:
            renders.resume([], lambda stored: ended(stored.order, stored.outcome))
        batches = queue(renders)
        order = BatchOrder("b" * 32, "anna", RENDERS, '[{"turntable": 5}]', created_at=time.time())
        batch = await batches.submit(order, b"", NO_USES, None)
        async with asyncio.timeout(30):
            await batch.finished.wait()
        assert [each["state"] for each in batch.status()["renders"]] == ["done", "failed", "done", "done", "failed"]
        assert [await why(batches, batch, step) for step in (1, RENDERS - 1)] == ["It never fits.", MISTAKE]
        await batches.close()

    asyncio.run(scenario())
    if store is not None:
        assert not store.load()
        assert sorted(each.state for each in store.ended_members()) == ["done", "done", "done", "failed", "failed"]
        assert all(each.ended_at for each in store.ended_members())


def test_a_batch_that_cannot_be_read_ends(tmp_path: Path) -> None:
    """Of an earlier server, whose document is not there any more."""
    renderers, store = Quick(), RenderStore(tmp_path)
    ended = partial(Render, renderers, load=load)

    async def scenario() -> None:
        order = BatchOrder("b" * 32, "anna", 2, "[]", created_at=time.time())
        number = await store.insert_batch(order, b"", NO_USES, None)
        renders = RenderQueue(LIMITS, store)
        members: Any = None
        batches = BatchQueue(renders, members, lambda order, outcome: ended(order, outcome=outcome), 2)
        (batch,) = batches.resume(store.batches.all())
        store.batches.body = lambda number: None  # type: ignore[method-assign]
        batches.go_on()
        async with asyncio.timeout(30):
            await batch.finished.wait()
        assert batch.number == number and batch.state == "failed"
        await batches.close()

    asyncio.run(scenario())


def test_documents_of_batches_count_until_the_last_render_is_in_line(tmp_path: Path) -> None:
    reader = RequestReader(Config(memory=64 * MIB), Shelf())
    renderers, store = Renderers(), RenderStore(tmp_path)
    note = {"note": "x" * MIB}  # which nobody reads
    body = folded({"scene": SCENE | note, "settings": {}})

    def new_job(order: Order, document: bytes | None, packed: Any) -> Render:
        return Render(renderers, order, load, document, PACKED)  # type: ignore[arg-type]

    def members(batch: Batch, body: bytes) -> RealMembers:
        made = RealMembers(batch, body, reader, new_job)
        made.check = no_check  # type: ignore[method-assign]
        return made

    async def no_check() -> None: ...

    def used() -> int:
        return reader.memory.used()["documents"]

    async def scenario() -> None:
        renders = RenderQueue(LIMITS, store)
        batches = BatchQueue(renders, members, lambda order, outcome: new_job(order, None, None), 2)

        async def submit(id: str, owner: str, count: int) -> Batch:
            CALLER.set(owner)
            order = BatchOrder(f"{id:0<32}", owner, count, json.dumps([{"turntable": count}]))
            return await batches.submit(order, body, NO_USES, None)

        long = await submit("f", "anna", 3)
        await until(lambda: len(long.jobs) == 2)
        assert MIB < used() < 1.1 * MIB
        renders.cancel(long.jobs[0])
        await until(lambda: len(long.jobs) == 3 and not used())
        assert not long.finished.is_set()
        with pytest.raises(TooManyRequests, match="documents of batches"):
            for i in range(9):
                await submit(f"{i}", "anna", 9)
        assert 7 * MIB < used() <= 8 * MIB, "half of a quarter"
        await submit("b", "bert", 9)
        await batches.close()
        await renders.close()

    asyncio.run(scenario())


def test_batches_under_way_have_no_more_renders_than_are_kept(tmp_path: Path) -> None:
    renderers = Renderers()

    async def scenario() -> None:
        limits = replace(LIMITS, retention=replace(LIMITS.retention, most_renders=3))
        renders = RenderQueue(limits, RenderStore(tmp_path))
        members: Any = lambda batch, body: Members(batch, renderers)  # noqa: E731
        batches = BatchQueue(renders, members, lambda order, outcome: Render(renderers, order, load), 2)  # type: ignore[arg-type]

        async def submit(id: str, owner: str, count: int) -> None:
            order = BatchOrder(f"{id:0<32}", owner, count, json.dumps([{"turntable": count}]))
            await batches.submit(order, b"", NO_USES, None)

        await submit("a", "anna", 20)
        with pytest.raises(TooManyRequests, match=r"more than 30 .*SUNBOX_KEEP_RENDERS"):
            await submit("b", "anna", 11)
        await submit("c", "anna", 10)
        await submit("d", "bert", 100)
        await batches.close()
        await renders.close()

    asyncio.run(scenario())


def test_a_label_has_no_more_characters_than_a_request_s(tmp_path: Path) -> None:
    axes = [{"path": "/shapes", "values": ["x" * 60]}] * 8
    order = BatchOrder("a" * 32, "anna", 1, json.dumps(axes))
    reader = RequestReader(Config(), Shelf())
    made = RealMembers(Batch(order), folded({"scene": SCENE, "settings": {}}), reader, lambda order, *_: order)  # type: ignore[arg-type,return-value]
    assert len(asyncio.run(made.job(0, True)).label) == 200  # type: ignore[attr-defined]


def test_an_ended_render_is_a_row_until_somebody_looks_at_it(tmp_path: Path) -> None:
    """In the server that rendered it, and in the next one."""
    renderers, store = Quick(), RenderStore(tmp_path)

    def made(stored: StoredRender) -> Render:
        return Render(renderers, stored.order, load, outcome=stored.outcome)  # type: ignore[arg-type]

    def ended(order: Order, outcome: Outcome) -> Render:
        return Render(renderers, order, load, outcome=outcome)  # type: ignore[arg-type]

    async def looked_at(renders: RenderQueue, batches: BatchQueue, batch: Batch) -> None:
        id = member_id(batch.id, 2)
        job = await batches.render(id, "anna")
        assert job is await batches.render(id, "anna")
        assert job.state == "done" and job.batch is batch and job.number
        renders.loaded_pictures.remove(job)
        renderers.listeners.clear()
        del job
        gc.collect()
        assert not batch.shown and not batch.jobs and not renders._jobs

    async def first() -> None:
        renders = RenderQueue(LIMITS, store)
        renders.resume([], made)
        batches = BatchQueue(renders, lambda batch, body: Members(batch, renderers), ended, 2)  # type: ignore[arg-type,return-value]
        batch = await batches.submit(order, b"", NO_USES, None)
        await until(lambda: batch.finished.is_set() and not batch.jobs)
        for job in list(renders.loaded_pictures._renders.values()):
            renders.loaded_pictures.remove(job)
        del job
        await looked_at(renders, batches, batch)
        told.append(batch.status())
        await batches.close()
        await renders.close()

    async def second() -> None:
        renders = RenderQueue(LIMITS, store)
        batches = BatchQueue(renders, lambda batch, body: Members(batch, renderers), ended, 2)  # type: ignore[arg-type,return-value]
        stored = store.load(), made, batches.resume(store.batches.all()), store.members(), store.ended_members()
        renders.resume(*stored)
        batches.go_on()
        batch = batches.get(order.id, "anna")
        await looked_at(renders, batches, batch)
        told.append(batch.status())
        assert renders.retained == 1 and batch.size > 0
        await batches.delete(batch)
        with pytest.raises(NotFound):
            await batches.render(member_id(batch.id, 2), "anna")
        assert not store.ended_members() and not store.batches.all()
        await renders.close()

    order, told = BatchOrder("b" * 32, "anna", RENDERS, "[]", created_at=time.time(), bytes=1), list[Any]()
    asyncio.run(first())
    asyncio.run(second())
    assert told[0] == told[1]
