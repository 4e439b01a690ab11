"""A stored render through random events: its states keep to the diagram, and nothing that was stored is lost."""

from __future__ import annotations

import asyncio
import re
import shutil
import sqlite3
import tempfile
from collections.abc import Awaitable, Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test
from hypothesis.strategies import booleans

from service.ipc.messages import (
    Failed,
    Loaded,
    Progress,
    Progressed,
    View,
)
from service.problems import Conflict, ServiceError, Unavailable
from service.server.renders import queue as queues
from service.server.renders import render, slots, viewer
from service.server.renders.queue import RenderQueue
from service.server.renders.recorder import Recorder
from service.server.renders.render import Render
from service.server.renders.status import Ended, PictureAt, Tracing
from service.server.renders.store import rows
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.store import RenderStore
from service.server.storage.asset_access import NO_USES
from service.server.storage.database import FILE
from service.system.memory import MemoryBudget
from tests.queues import LIMITS
from tests.service.rendering.fakes import SETTINGS, load, until
from tests.service.rendering.farm import Disk, Farm

ROOT = Path(__file__).parents[3]
ARROW = re.compile(r"^ *(\w+|\[\*\]) --> (\w+): (\w+)", re.MULTILINE)
STEP = 4  # samples between two reports
LATE = 8  # steps, after which it may end: nearly nothing happens to a render that has ended


def diagram() -> set[tuple[str, str, str]]:
    """The arrows of the diagram: from, to, and the method of Render."""
    return set(ARROW.findall((ROOT / "docs" / "house.md").read_text()))


class RenderMachine(RuleBasedStateMachine):
    """One render, one server after another on its data folder."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.loop = asyncio.new_event_loop()
        self.saved_samples = 0  # of the newest picture on the disk
        self.ended: str | None = None  # as that was stored
        self.steps = 0
        self.does(self._first())

    @initialize(hopeless=booleans())
    def begins(self, hopeless: bool) -> None:
        if hopeless:
            self.renderers_are_lost()

    def does(self, work: Awaitable[Any]) -> Any:
        async def run() -> Any:
            found = await work
            await self._settled()
            return found

        found = self.loop.run_until_complete(run())
        self.steps += 1
        self.check()
        return found

    async def _first(self) -> None:
        await RenderStore(self.folder).insert(Order("id", "", SETTINGS, bytes=8), Outcome(), b"document", NO_USES)
        await self._serve()

    async def _serve(self) -> None:
        """A server takes up what is stored."""
        self.store, self.farm, self.budget = Disk(self.folder), Farm(), MemoryBudget()
        self.queue = RenderQueue(LIMITS, self.store)
        farm: Any = self.farm
        self.queue.resume(
            self.store.load(),
            lambda stored: Render(farm, stored.order, load, outcome=stored.outcome, budget=self.budget),
        )
        self.job = self.queue.get("id")

    async def _settled(self) -> None:
        quiet = 0
        while quiet < 2:
            await asyncio.sleep(0.001)
            quiet = 0 if self.store.busy else quiet + 1

    def check(self) -> None:
        job, recorder, open_ = self.job, self.job.recorder, list(self.farm.listeners)
        assert recorder is not None and len(open_) <= 1, "one task renders it or shows it"
        latest = self.store.latest("id")
        assert (PictureAt.RENDERER in job.picture_at) is bool(open_)
        if not open_:
            assert (job.picture_at is PictureAt.DISK) is (latest is not None)
            assert sum(self.budget.used().values()) == 0, "memory is counted while a renderer has it"
        on_disk = 0 if latest is None else self.store.read_now("id", latest, 1).progress.samples
        assert on_disk >= self.saved_samples, "what was stored is lost"
        self.saved_samples = on_disk
        if not self.store.failures and not self.store.full:
            with closing(sqlite3.connect(self.folder / FILE)) as file:
                (row,) = rows.stored_renders(file)
            if isinstance(job.at, Ended):
                assert row.outcome.state == job.at.how
                self.ended = row.outcome.state
            else:
                assert row.outcome.state in ("queued", "running")

    @property
    def tracing(self) -> bool:
        return isinstance(self.job.at, Tracing) and self.job.task in self.farm.samples

    @precondition(lambda self: self.job.task is not None and self.job.state == "queued")
    @rule()
    def loads(self) -> None:
        self._says(lambda task: self.farm.say(Loaded(task, 1, 0.1, 0.0, (), (), [])))

    @precondition(lambda self: self.tracing)
    @rule()
    def progresses(self) -> None:
        def traced(task: int) -> None:
            self.farm.samples[task] += STEP
            self.farm.say(Progressed(task, 1, Progress(self.farm.samples[task], None, 1.0)))

        self._says(traced)

    @precondition(lambda self: self.tracing)
    @rule()
    def saves_a_checkpoint(self) -> None:
        self._says(self.farm.checkpoint)

    @precondition(lambda self: self.tracing)
    @rule()
    def process_is_replaced(self) -> None:
        """As a supervisor does it: from what it keeps, or from nothing."""

        def replaced(task: int) -> None:
            self.farm.samples[task] = self.farm.kept[task]
            if not self.farm.kept[task]:
                self.farm.listeners[task].again()

        self._says(replaced)

    @precondition(lambda self: self.steps > LATE and self.tracing and self.farm.samples[self.job.task])
    @rule()
    def ends(self) -> None:
        self._says(lambda task: self.farm.done(task, "max_samples"))
        assert self.job.state == "done"

    @precondition(lambda self: self.steps > LATE and self.tracing)
    @rule()
    def fails(self) -> None:
        self._says(lambda task: self.farm.say(Failed(task, 1, "It is too large.", refused=True)))
        assert self.job.state == "failed"

    @precondition(lambda self: self.farm.stopped & set(self.farm.listeners))
    @rule()
    def answers_the_stop(self) -> None:
        for task in self.farm.stopped & set(self.farm.listeners):
            self._says(lambda _, task=task: self.farm.done(task, "stopped"))
        self.farm.stopped.clear()

    @rule()
    def renderers_are_lost(self) -> None:
        self._says(lambda task: self.farm.lose())

    @rule()
    def renderers_are_back(self) -> None:
        self._says(lambda task: setattr(self.farm, "hopeless", False))

    @rule(there=booleans())
    def other_renders(self, there: bool) -> None:
        """They have all slots, so that this one waits where it is in line."""
        self._says(lambda task: setattr(self.queue._slots, "_most", 0 if there else LIMITS.running))

    @rule(full=booleans())
    def disk(self, full: bool) -> None:
        self._says(lambda task: setattr(self.store, "full", full))

    @precondition(lambda self: self.steps > LATE and not self.job.ends)
    @rule()
    def is_cancelled(self) -> None:
        self._says(lambda task: self.queue.cancel(self.job))
        assert self.job.state == "cancelled"

    @precondition(lambda self: self.job.can_give_way)
    @rule()
    def gives_way(self) -> None:
        samples = self.job.outcome.progress.samples
        gave = self.does(self.job.give_way())
        assert gave is (not self.store.full)
        if gave:
            assert self.saved_samples >= samples

    @rule()
    def is_looked_at(self) -> None:
        async def look() -> int | ServiceError:
            try:
                return (await asyncio.wait_for(self.job.image(View()), 5.0))[1].samples
            except ServiceError as error:
                return error

        found = self.does(look())
        if self.job.state == "failed":
            assert isinstance(found, ServiceError)
        elif self.saved_samples and not self.farm.hopeless and self.job.task is None:
            assert found == self.saved_samples
        elif not isinstance(found, int):
            assert isinstance(found, Conflict | Unavailable) or not self.saved_samples

    @rule()
    def memory_is_needed(self) -> None:
        at = self.job.picture_at
        rested = self.job.unload()
        assert rested is (at is PictureAt.BOTH)
        self.check()

    @rule(killed=booleans())
    def server_ends(self, killed: bool) -> None:
        samples, whole = self.job.outcome.progress.samples, not self.store.full and not self.store.failures
        traces = self.tracing and whole and bool(self.farm.samples[self.job.task])
        if not killed:
            self.loop.run_until_complete(self.queue.close())
        self.loop.run_until_complete(self._die())
        self.does(self._serve())
        if self.ended is not None:
            assert self.job.state == self.ended
        if traces and not killed:
            assert self.saved_samples >= samples, "the last samples are stored"

    async def _die(self) -> None:
        self.queue.closing = True
        self.queue._slots.close()
        mine = asyncio.all_tasks() - {asyncio.current_task()}
        for task in mine:
            task.cancel()
        await asyncio.gather(*mine, return_exceptions=True)

    def _says(self, event: Callable[[int], None]) -> None:
        async def run() -> None:
            event(self.job.task or 0)

        self.does(run())

    def teardown(self) -> None:
        """With a disk and renderers, it ends."""
        self.server_ends(killed=True)
        for _ in range(20):
            if self.job.finished.is_set():
                break
            for task in list(self.farm.listeners):
                if self.tracing:
                    self.progresses()
                    self.ends()
                elif task == self.job.task:
                    self.loads()
            self.does(asyncio.sleep(0.01))
        assert self.job.finished.is_set()
        self.loop.run_until_complete(self._die())
        self.loop.close()
        shutil.rmtree(self.folder)


@pytest.fixture
def arrows(monkeypatch: pytest.MonkeyPatch) -> Iterator[set[tuple[str, str, str]]]:
    """The arrows that renders go along; one that the diagram does not have is an error."""
    seen, known = set[tuple[str, str, str]](), diagram()

    def watched(name: str) -> Callable[..., None]:
        method = getattr(Render, name)

        def run(job: Render, *args: Any) -> None:
            before = type(job.at).__name__ if hasattr(job, "outcome") else "[*]"
            method(job, *args)
            after = type(job.at).__name__
            if before != after:
                seen.add((before, after, name))
                assert (before, after, name) in known, "the diagram in docs/house.md has no such arrow"

        return run

    for name in ("load", "trace", "requeue", "end"):
        monkeypatch.setattr(Render, name, watched(name))
    for module, name, value in (
        (slots, "LOOK_S", 0.002), (slots, "AGAIN_S", 0.002), (viewer, "PATIENCE_S", 0.01),
        (render, "GIVING_WAY_S", 0.1), (queues, "CLOSING_S", 0.1),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, value)
    yield seen


def test_a_render_keeps_to_the_diagram(arrows: set[tuple[str, str, str]]) -> None:
    run_state_machine_as_test(
        RenderMachine,
        settings=settings(
            max_examples=15, stateful_step_count=30, deadline=None, derandomize=True, database=None,
            phases=[Phase.generate],
        ),
    )  # fmt: skip


def test_each_arrow_of_the_diagram_is_taken(arrows: set[tuple[str, str, str]]) -> None:
    for states in range(3):  # before it is cancelled
        render = RenderMachine()
        render.renderers_are_lost()
        if states > 0:
            render.renderers_are_back()
        if states > 1:
            render.loads()
            render.progresses()
            render.other_renders(there=True)
            render.gives_way()
            render.is_looked_at()
            assert render.job.state == "queued" and render.job.picture_at is PictureAt.BOTH
            render.other_renders(there=False)
            render.loads()
            render.progresses()
            render.server_ends(killed=False)
            render.loads()
            assert render.job.outcome.progress.samples == 2 * STEP
        render.is_cancelled()
        render.teardown()
    assert arrows == {arrow for arrow in diagram() if arrow[2] != "ask"}


def test_a_renderer_that_is_lost_after_the_end_takes_nothing_with_it(tmp_path: Path) -> None:
    """Its picture is being written just then."""

    async def scenario() -> None:
        store, farm = Disk(tmp_path), Farm()
        order = Order("id", "", SETTINGS, bytes=8)
        job: Any = Render(farm, order, load)  # type: ignore[arg-type]
        job.recorder = Recorder(store, await store.insert(order, Outcome(), b"document", NO_USES), "id")
        running = asyncio.create_task(job.run())
        await until(lambda: 1 in farm.samples)
        farm.samples[1] = 8
        farm.done(1, "max_samples")
        farm.listeners.pop(1).lost("It brought the renderer down.")
        await running
        await job.recorded()
        assert job.state == "done" and job.picture_at is PictureAt.DISK
        (left,) = RenderStore(tmp_path).load()
        assert left.outcome.state == "done" and left.outcome.progress.samples == 8

    asyncio.run(scenario())
