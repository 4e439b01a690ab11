"""One stored render against a renderer that does as the test says."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.ipc.messages import (
    Checkpoint,
    Done,
    Image,
    Progress,
    Progressed,
    Read,
    Restore,
    SavedPicture,
    Update,
    View,
)
from service.ipc.task_control import Stop, TakeCheckpoint
from service.pack import Packed
from service.problems import Conflict, Internal
from service.server.renders.recorder import MOST_STARTS, Recorder
from service.server.renders.render import Render
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.store import RenderStore
from service.server.storage.asset_access import NO_USES
from tests.service.rendering.fakes import SETTINGS, Renderers, load, until

SAVED = SavedPicture(4, (0, 0, 0), [np.arange(64, dtype=np.uint8)])


async def stored(renderers: Any, store: RenderStore, outcome: Outcome | None = None) -> Render:
    order = Order("id", "", SETTINGS, bytes=8)
    number = await store.insert(order, outcome or Outcome(), b"document", NO_USES)
    job = Render(renderers, order, load, outcome=outcome)
    job.recorder = Recorder(store, number, "id", renderers=renderers)
    return job


def scenario(test: Callable[[Any, RenderStore], Awaitable[None]], folder: Path) -> None:
    asyncio.run(test(Renderers(), RenderStore(folder)))  # type: ignore[arg-type]


async def in_line(job: Render) -> None:
    """Give it a slot whenever it wants one, until it has ended."""
    while not job.finished.is_set():
        if job.reserve():
            await job.run()
        await asyncio.sleep(0.001)


def test_it_goes_on_from_its_checkpoint_when_something_renders_again(tmp_path: Path) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store)
        running = asyncio.create_task(in_line(job))
        await until(lambda: renderers.sent)
        assert renderers.sent[0][1] is None
        job.heard(Checkpoint(1, 1, Progress(4, None, 2.0), SAVED))
        job.heard(Progressed(1, 1, Progress(6, None, 3.0)))
        await until(lambda: renderers.sent[-1][0] == "stored")
        assert renderers.sent[-1][1].progress.samples == 4  # it is read from the disk, and leaves the memory
        renderers.hopeless = True
        job.lost("No renderer could be started.")
        await until(lambda: job.state == "queued")
        assert not job.finished.is_set()
        renderers.hopeless = False
        await until(lambda: renderers.opened == 2)
        await until(lambda: isinstance(renderers.sent[-1], tuple) and isinstance(renderers.sent[-1][0], Update))
        restore = renderers.sent[-1][1]
        assert restore.task == 2 and restore.reason is None and restore.progress.samples == 4
        job.heard(Progressed(2, 1, Progress(1, None, 0.1)))  # of the moment before it heard of the checkpoint
        assert job.outcome.progress.samples == 4
        job.heard(Done(2, 1, "max_samples", Progress(8, None, 5.0), [], SAVED))
        await running
        assert job.state == "done" and store.latest("id") == "picture"

    scenario(test, tmp_path)


def test_that_it_waits_is_logged_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        renderers.hopeless = True
        job = await stored(renderers, store)
        running = asyncio.create_task(in_line(job))
        for waits in (1, 2):  # where nothing renders again, that is news
            await until(lambda waits=waits: "has to wait" in caplog.text and job.waits)  # type: ignore[misc]
            await asyncio.sleep(0.02)
            assert [record.levelname for record in caplog.records if "has to wait" in record.message] == (
                ["WARNING"] * waits
            )
            renderers.hopeless = False
            await until(lambda: renderers.opened)
            renderers.hopeless, renderers.opened = True, 0
            job.lost("it died")
        job.cancel()
        await running

    with caplog.at_level(logging.INFO):
        scenario(test, tmp_path)


def test_what_is_cancelled_while_it_begins_stays_cancelled(tmp_path: Path) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store)
        running = asyncio.create_task(job.run())
        await asyncio.sleep(0)  # that it begins is being written
        job.cancel()
        await running
        assert job.state == "cancelled" and job.outcome.starts == 1 and not renderers.opened
        await job.recorded()
        (left,) = RenderStore(tmp_path).load()
        assert left.outcome.state == "cancelled"

    scenario(test, tmp_path)


def test_a_render_that_servers_do_not_survive_fails(tmp_path: Path) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store, Outcome("running", starts=MOST_STARTS - 1))
        running = asyncio.create_task(job.run())
        await until(lambda: renderers.opened)
        (left,) = RenderStore(tmp_path).load()
        assert (left.outcome.state, left.outcome.starts) == ("running", MOST_STARTS)
        await job.close()
        await running
        again = Render(renderers, left.order, load, outcome=left.outcome)
        again.recorder = Recorder(store, left.number, "id")
        await again.run()
        await again.recorded()
        assert again.state == "failed" and renderers.opened == 1
        with pytest.raises(Internal, match="5 times"):
            await again.image(View())
        (failed,) = RenderStore(tmp_path).load()
        assert failed.outcome.state == "failed" and isinstance(failed.outcome.error, Internal)

    scenario(test, tmp_path)


def test_an_unexpected_error_fails_the_one_render(tmp_path: Path) -> None:
    async def broken(document: bytes, count: Callable[[int], None]) -> Packed:
        raise MemoryError

    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store)
        job.scene._load = broken
        await asyncio.wait_for(job.run(), 10)
        assert job.state == "failed"

    scenario(test, tmp_path)


def test_who_goes_away_while_a_picture_is_brought_back_leaves_it_to_others(tmp_path: Path) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store, Outcome("done", "max_samples", Progress(4), ended_at=1.0))
        assert job.recorder is not None
        with pytest.raises(Conflict):
            await job.image(View())
        await store.write("id", "picture", Restore(1, 1, SAVED, "max_samples", Progress(4)))
        waits, send_scene = asyncio.Event(), renderers.send_scene
        renderers.send_scene = lambda update, restore: waits.wait()
        impatient = asyncio.create_task(job.image(View()))
        await until(lambda: renderers.opened == 1)
        impatient.cancel()
        await asyncio.gather(impatient, return_exceptions=True)
        renderers.send_scene = send_scene
        patient = asyncio.create_task(job.image(View()))
        await until(lambda: renderers.sent and isinstance(renderers.sent[-1], Read))
        read, (_, restore) = renderers.sent[-1], renderers.sent[-2]
        assert read.task == restore.task == 2 and restore.reason == "max_samples"
        job.heard(Image(2, read.serial, np.zeros((4, 4, 4)), Progress(4)))
        assert (await patient)[1].samples == 4
        job.recorder.whole = True
        assert job.unload() and renderers.sent[-1] == ("drop", 2)

    scenario(test, tmp_path)


def test_a_look_at_a_checkpoint_outlives_the_render_going_on(tmp_path: Path) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store, Outcome("running", progress=Progress(4, None, 2.0)))
        await store.write("id", "checkpoint", Restore(1, 1, SAVED, None, Progress(4, None, 2.0)))
        sends, send_scene = asyncio.Event(), renderers.send_scene

        async def slow(update: Update, restore: Restore | None) -> None:
            await sends.wait()
            await send_scene(update, restore)

        renderers.send_scene = slow
        looking = [asyncio.create_task(job.image(View())) for _ in range(2)]
        await until(lambda: renderers.opened == 1)
        running = asyncio.create_task(job.run())
        await until(lambda: job.outcome.starts)
        await asyncio.sleep(0.05)  # it waits for its turn to load
        sends.set()
        await until(lambda: [each for each in renderers.sent if isinstance(each, Read) and each.task == 2][1:])
        told = [each[0] if isinstance(each, tuple) else each for each in renderers.sent]
        told = [type(each) for each in told if not isinstance(each, str) and each.task == 2]
        assert told[0] is Update  # a renderer answers that there is nothing where it does not know the task yet
        for read in [each for each in renderers.sent if isinstance(each, Read) and each.task == 2]:
            job.heard(Image(2, read.serial, np.zeros((4, 4, 4)), Progress(4)))
        assert [progress.samples for _, progress in await asyncio.gather(*looking)] == [4, 4]
        job.cancel()
        await running

    scenario(test, tmp_path)


def test_the_end_of_the_server_waits_for_the_last_checkpoint(tmp_path: Path) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store)
        running = asyncio.create_task(job.run())
        await until(lambda: renderers.sent)
        job.outcome = Outcome("running", progress=Progress(1, None, 1.0))
        closing = asyncio.create_task(job.close())
        await until(lambda: isinstance(renderers.sent[-1], TakeCheckpoint))
        await asyncio.sleep(0.05)
        assert not closing.done()
        job.heard(Checkpoint(1, 1, Progress(4, None, 2.0), SAVED))
        await asyncio.wait_for(asyncio.gather(closing, running), 10)
        job.lost("The server is shutting down.")
        assert not job.finished.is_set()
        (left,) = RenderStore(tmp_path).load()
        assert left.outcome.state == "running" and left.outcome.progress.samples == 4

    scenario(test, tmp_path)


def test_its_key_is_its_client(tmp_path: Path) -> None:
    """Without keys it is its own client: `open` gives a part to each task without a name."""

    async def test(renderers: Any, store: RenderStore) -> None:
        for owner in ("anna", ""):
            job = Render(renderers, Order("id", owner, SETTINGS), load, b"document")
            running = asyncio.create_task(job.run())
            await until(lambda owner=owner: renderers.clients[-1:] == [owner])
            job.cancel()
            await running

    scenario(test, tmp_path)


def test_what_is_cancelled_keeps_what_comes_after(tmp_path: Path) -> None:
    async def test(renderers: Any, store: RenderStore) -> None:
        job = await stored(renderers, store)
        running = asyncio.create_task(job.run())
        await until(lambda: renderers.sent)
        job.cancel()
        await asyncio.gather(running, job.recorded())
        assert isinstance(renderers.sent[-1], Stop)
        assert RenderStore(tmp_path).load()[0].outcome.state == "cancelled"
        job.heard(Done(1, 1, "stopped", Progress(4, None, 2.0), [], SAVED))
        await job.recorded()
        (left,) = RenderStore(tmp_path).load()
        assert left.outcome.state == "cancelled" and left.outcome.progress.samples == 4
        assert store.latest("id") == "picture" and job.recorder is not None and job.recorder.whole

    scenario(test, tmp_path)
