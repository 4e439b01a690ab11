"""No task, thread or callback dies unseen: what kills it is logged and counted, and whoever it worked for is told."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest

from service.config import Config
from service.formats import Assets
from service.ipc.messages import Checkpoint, Done, Progress, Progressed
from service.problems import MISTAKE, Unavailable
from service.renderers.local import keeper
from service.renderers.local.supervisor import Supervisor
from service.server.batches import queue as batch_queue
from service.server.callbacks import queue as callback_queue
from service.server.readiness import Loading
from service.server.renders.recorder import Recorder
from service.server.renders.render import Render
from service.server.renders.slots import Slots
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.store import RenderStore
from service.server.requests.request_reader import RequestReader
from service.server.storage.asset_access import NO_USES
from service.server.storage.callback_rows import CallbackRows, insert
from service.server.storage.database import Database
from service.server.streams.sessions import Sessions
from service.server.streams.stream import Stream
from service.system import background
from service.system.background import Background
from tests.counting import in_simulated_time
from tests.service.rendering.fakes import (
    PACKED,
    SETTINGS,
    FakeProcesses,
    Quick,
    Renderers,
    load,
    until,
    with_fake_processes,
)
from tests.service.rendering.farm import saved
from tests.supervisors import Ears


class Bug(Exception):
    pass


async def broken(*_: object, **__: object) -> Any:
    raise Bug


def breaks(*_: object, **__: object) -> Any:
    raise Bug


def once(work: Callable[..., Any]) -> Callable[..., Any]:
    """Raises at its first call, and does `work` at all others."""
    calls = list[object]()

    def either(*given: Any, **named: Any) -> Any:
        calls.append(given)
        return work(*given, **named) if len(calls) > 1 else breaks()

    return either


async def stored(renderers: Any, folder: Path) -> tuple[Render, RenderStore]:
    store, order = RenderStore(folder), Order("id", "", SETTINGS, bytes=8)
    job = Render(renderers, order, load)
    job.recorder = Recorder(
        store, await store.insert(order, Outcome(), b"document", NO_USES), "id", renderers=renderers
    )
    return job, store


@pytest.fixture
def dies(caplog: pytest.LogCaptureFixture) -> Any:
    """Asks whether a work of that name has died, and only that; all that a test has die is asked for."""
    before = background.deaths()

    def died(what: str, times: int = 1, others: dict[str, int] | None = None) -> bool:
        said = [record.args for record in caplog.records if record.exc_info and "died" in record.message]
        all_of_it = {what: times, **(others or {})}
        return dict(background.deaths() - before) == all_of_it and said.count({"what": what}) == times  # type: ignore[arg-type]

    return died


def test_a_start_that_cannot_load_is_told(dies: Any) -> None:
    async def test() -> None:
        loading = Loading()
        loading.start(broken())
        await loading.tasks.ended()
        assert loading.failed and dies("loading of what is stored")
        with pytest.raises(Unavailable, match="loading"):
            await loading.wait(0.001)

    asyncio.run(test())


def test_what_dies_is_reported_and_told(dies: Any) -> None:
    async def test() -> None:
        owned, told = Background(), list[Exception]()
        await owned.start("work", broken(), told.append)
        assert isinstance(told[0], Bug) and dies("work")
        await owned.start("work", broken(), breaks)  # and what tells of it may die as well
        assert dies("work", 2)
        task = owned.start("work", asyncio.sleep(60))
        await owned.close()
        assert task.cancelled() and dies("work", 2), "the end is no death"

    asyncio.run(test())


def test_a_stream_ends_with_words(dies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Stream, "_handle_all", broken)
    sent, closed = list[Any](), list[Any]()

    class Socket:
        async def send_text(self, text: str) -> None:
            sent.append(json.loads(text))

        async def close(self, code: int, reason: str) -> None:
            closed.append((code, reason))

    async def test() -> None:
        supervisor: Any = Supervisor()
        supervisor.open = lambda listener, client="": 1
        reader = RequestReader(Config(_env_file=None), cast(Assets, None))  # type: ignore[call-arg]
        kept = Sessions(supervisor, reader, most=2)
        session = kept.enter(None)
        await session.stream.attend(session.stream.attach(cast(Any, Socket())))
        kept.leave(session)
        assert not kept.waiting, "nobody comes back to it"

    asyncio.run(test())
    assert dies("stream")
    assert sent[-1]["type"] == "error" and sent[-1]["problem"]["detail"] == MISTAKE
    assert closed == [(4500, MISTAKE)]


@pytest.mark.parametrize(("failures", "state"), [(1, "done"), (2, "failed")])
def test_a_render_is_begun_once_more(failures: int, state: str, dies: Any) -> None:
    class Failing(Quick):
        async def send_scene(self, *given: Any) -> None:
            if self.opened <= failures:
                raise Bug
            await super().send_scene(*given)

    async def test() -> None:
        job = Render(Failing(), Order("id", "", SETTINGS), load, b"document", PACKED)  # type: ignore[arg-type]
        async with asyncio.timeout(10):
            await job.run()
        assert job.state == state and (state == "done" or str(job.outcome.error) == MISTAKE)

    asyncio.run(test())
    assert dies("beginning of a render", failures)


def test_a_render_ends_whose_own_task_dies(dies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Render, "run", broken)

    async def test() -> None:
        ended = list[Render]()
        slots = Slots(1, ended.append)
        jobs = [Render(Quick(), Order(id, "", SETTINGS), load, b"document", PACKED) for id in "ab"]  # type: ignore[arg-type]
        for job in jobs:
            slots.add(job)
        slots.dispatch()
        await until(lambda: len(ended) == 2)
        assert ended == jobs and {job.state for job in jobs} == {"failed"} and not slots.running

    asyncio.run(test())
    assert dies("render", 2)


def test_the_disk_s_work_for_a_render_may_die(tmp_path: Path, dies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends all the same, and its checkpoints go on."""

    async def test() -> None:
        renderers: Any = Renderers()
        job, store = await stored(renderers, tmp_path)
        job.reserve()
        running = asyncio.create_task(job.run())
        await until(lambda: renderers.sent)
        with monkeypatch.context() as patched:
            patched.setattr(store, "free", broken)
            job.heard(Checkpoint(1, 1, Progress(4, None, 2.0), saved(4)))
            await until(lambda: dies("checkpoints of a render"))
        job.heard(Checkpoint(1, 1, Progress(6, None, 3.0), saved(6)))
        await until(lambda: job.recorder is not None and job.recorder.reached.samples == 6)
        monkeypatch.setattr(Recorder, "end", broken)
        job.heard(Done(1, 1, "max_samples", Progress(8, None, 5.0), [], saved(8)))
        await running
        assert job.state == "done"

    asyncio.run(test())
    assert dies("record of a render's end", others={"checkpoints of a render": 1})


def test_a_cancelled_render_is_cancelled_all_the_same(
    tmp_path: Path, dies: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Recorder, "note", broken)

    async def test() -> None:
        job, _ = await stored(Renderers(), tmp_path)
        job.cancel()
        await job.recorded()
        assert job.state == "cancelled"

    asyncio.run(test())
    assert dies("note of a render's end")


class Waiting:
    """A render that others give way to, and that gives way."""

    place = priority = lacks = resident_bytes = 0
    elapsed_s = memory_share = 0.0
    began = False
    lasting = can_give_way = True

    def __init__(self, name: str, owner: str) -> None:
        self.id, self.owner, self.client = name, owner, owner
        self.finished = asyncio.Event()
        self.run, self.give_way = self.finished.wait, broken

    def reserve(self) -> bool:
        return True

    def died(self, error: Exception) -> None: ...


def test_slots_go_on_after_a_hand_over_that_dies(dies: Any) -> None:
    async def test() -> None:
        now, one, two, other = [0.0], Waiting("one", "a"), Waiting("two", "a"), Waiting("other", "b")
        slots: Any = Slots(2, lambda job: None, lambda: now[0])
        for job in (one, two, other):
            slots.add(job)
            slots.dispatch()
        now[0] = 60.0
        slots._look()
        assert slots._claimant is other
        await until(lambda: slots._claimant is None)
        assert dies("hand-over of slots")
        one.finished.set()
        await until(lambda: slots.running == [two, other])
        slots._make_way = breaks
        slots.add(one)
        slots._look()
        assert slots._timer is not None, "it looks again"
        slots.close()
        for job in (two, other):
            job.finished.set()
        await until(lambda: not slots.running)

    asyncio.run(test())
    assert dies("look at who waits", others={"hand-over of slots": 1})


def test_a_listener_s_error_is_its_own_task_s_end(dies: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        bad, good = Ears(), Ears()
        bad.heard = breaks  # type: ignore[method-assign]
        tasks = [supervisor.open(ears) for ears in (bad, good)]
        await supervisor.ready(10)
        for task in tasks:
            processes.now.say(Progressed(task, 1, Progress(1, None, 0.1)))
        assert (await good.next(Progressed)).task == tasks[1]
        assert await bad.next(str) == MISTAKE and tasks[0] not in supervisor.tasks and tasks[1] in supervisor.tasks

    processes = FakeProcesses()
    with_fake_processes(test, processes)
    assert dies("message of a renderer")


def test_a_renderer_is_watched_and_replaced_all_the_same(dies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keeper, "AGAIN_S", 0.01)
    monkeypatch.setattr(keeper, "WATCH_S", 0.001)
    looks = list[bool]()

    async def test(supervisor: Supervisor) -> None:
        await supervisor.ready(10)
        processes.now.watch = once(lambda excused: looks.append(excused))  # type: ignore[method-assign]
        await until(lambda: looks)
        assert dies("watchdog")
        refusing[0] = once(processes)
        processes.now.lose()
        await until(lambda: processes.began == 2)
        await supervisor.ready(10)

    processes = FakeProcesses()
    refusing: list[Any] = [processes]
    begin: Any = lambda *given: refusing[0](*given)  # noqa: E731
    with_fake_processes(test, begin)
    assert dies("replacement of a renderer", others={"watchdog": 1})


def test_a_picture_that_cannot_be_returned_begins_again(dies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.ready(10)
        record = supervisor.tasks[task].record
        record.checkpoint = None
        monkeypatch.setattr(supervisor, "_bring_back", broken)
        supervisor.tasks[task].resident = False
        supervisor._bring_back_soon(task, supervisor.tasks[task])
        assert await ears.next(str) == "again" and supervisor.tasks[task].resident

    with_fake_processes(test, FakeProcesses())
    assert dies("return of a picture")


def test_a_batch_ends_whose_renders_cannot_be_made(dies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever waits for it is told so."""
    monkeypatch.setattr(batch_queue.BatchQueue, "_put_in_line", broken)

    async def test() -> None:
        kept = list[object]()
        renders: Any = type("Renders", (), {"keep": lambda self, batch: kept.append(batch)})()
        batch = batch_queue.Batch(batch_queue.BatchOrder("0" * 32, "", 3, "[]"))
        batch_queue.BatchQueue(renders, breaks, breaks, 1)._begin(batch, None)
        async with asyncio.timeout(10):
            await batch.finished.wait()
        assert batch.state == "cancelled" and kept == [batch]

    asyncio.run(test())
    assert dies("batch")


def test_callbacks_go_on(tmp_path: Path, dies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """One whose attempt dies leaves its place to others."""
    callbacks = callback_queue.Callbacks(Config(data_dir=tmp_path), breaks)
    with Database(tmp_path).open() as database, database:
        insert(database, "render", "a", "", "https://hooks.example.org/", 1.0)
    (due,) = CallbackRows(Database(tmp_path)).listed("", None, 10, None)

    async def test() -> None:
        callbacks._pending[due.owner] = 1
        monkeypatch.setattr(callbacks, "_attempt", broken)
        monkeypatch.setattr(callback_queue, "recording", once_found)
        monkeypatch.setattr(callback_queue, "resolving", nothing)
        callbacks._tasks.start("sender of callbacks", callbacks._run())
        await asyncio.sleep(1.5 * callback_queue.AGAIN_S)
        assert list(callbacks._sending) == [due.id]
        await asyncio.sleep(2 * callback_queue.AGAIN_S)
        assert not callbacks._sending
        await callbacks.close()

    answers: list[Any] = [breaks, lambda: [], lambda: due, lambda: None]

    async def once_found(_: object) -> Any:
        return (answers.pop(0) if len(answers) > 1 else answers[0])()

    async def nothing(_: object) -> None: ...

    in_simulated_time(test())
    assert dies("callback", others={"sender of callbacks": 1})
