"""Renderers that are killed at the worst moments: whoever has work there gets it done all the same, only later."""

from __future__ import annotations

import asyncio
import os
import signal
from collections import Counter
from pathlib import Path

import pytest

from gpu import SceneEdit
from service.config import NICENESS
from service.ipc.messages import Done, Failed, Frame, Image, Loaded, Read, StopRule, Update, View, Want
from service.problems import Unavailable
from service.renderers.local import keeper
from service.renderers.local.supervisor import Supervisor
from service.renderers.statistics import RendererLoad
from tests.service.rendering.fakes import FakeProcesses, until, with_fake_processes
from tests.serving import PATIENCE_S
from tests.supervisors import LINEAR, Ears, Rendering, arrays_of, settings


async def replaced(supervisor: Supervisor, number: int = signal.SIGKILL) -> None:
    """Returns when another renderer has been begun in the place of this one."""
    while (pid := supervisor.process_id) is None:
        await asyncio.sleep(0.001)
    os.kill(pid, number)
    while supervisor.process_id in (pid, None):
        await asyncio.sleep(0.001)


async def opened(supervisor: Supervisor, ears: Ears, samples: int = 1 << 24) -> int:
    task = supervisor.open(ears)
    size = settings(64)
    await supervisor.send_scene(Update(task, 1, arrays_of("plain"), size, StopRule(samples), interactive=True))
    return task


def niceness(pid: int | None) -> set[int]:
    threads = Path(f"/proc/{pid}/task").iterdir()
    return {int((thread / "stat").read_text().rsplit(")", 1)[1].split()[16]) for thread in threads}


def test_who_kills_it_before_it_can_start_never_wins(monkeypatch: pytest.MonkeyPatch) -> None:
    """More than ten times the three that may fail by themselves: whoever has work there keeps it."""
    monkeypatch.setattr(keeper, "AFTER_KILLS_S", 0.0)
    processes = FakeProcesses(cause="killed")

    async def test(supervisor: Supervisor) -> None:
        await supervisor.ready(PATIENCE_S)
        task = await opened(supervisor, Ears())
        for number in range(1, 36):
            processes.now.lose()  # before it can say that it is ready
            await until(lambda number=number: processes.began == number + 1)
        assert not supervisor.hopeless and supervisor.statistics.restarts["killed"] == 35
        await supervisor.ready(PATIENCE_S)
        supervisor.send(Want(task, 1, View()))
        assert processes.now.heard(Update) == processes.now.heard(Want) == [task]

    with_fake_processes(test, processes)


def test_a_task_that_always_brings_it_down_is_lost_alone() -> None:
    """As a driver's bug would: the renderer ends whenever it works on this one."""
    processes = FakeProcesses(cause="crashed")

    async def test(supervisor: Supervisor) -> None:
        await supervisor.ready(PATIENCE_S)
        ears, others = Ears(), Ears()
        killer, task = await opened(supervisor, ears), await opened(supervisor, others)
        for number in range(1, 4):
            await supervisor.ready(PATIENCE_S)
            processes.now.task = killer
            processes.now.lose()
            await until(lambda number=number: processes.began == number + 1)
        told = [ears.messages.get_nowait() for _ in range(ears.messages.qsize())]
        assert told[:-1] == ["again"] * 2 and "3 times (crashed)" in str(told[-1])
        assert list(supervisor.tasks) == [task] and processes.now.heard(Update) == [task]

    with_fake_processes(test, processes)


def test_renderers_that_are_killed_at_once_are_not_begun_all_the_time() -> None:
    killed = keeper.Restarts()
    killed.shots = 3
    assert killed.pause_s(0.1) == pytest.approx(1.4) and killed.pause_s(2.0) == 0.0
    killed.shots = 1000
    assert killed.pause_s(0.0) == keeper.AFTER_KILLS_S and killed.pause_s(8.0) == 0.0


def test_what_was_asked_while_there_was_none_is_answered(rendering: Rendering) -> None:
    """A want, an edit and a reading fall into the gap, and the renderer after that is killed as it loads."""

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = await opened(supervisor, ears)
        supervisor.send(Want(task, 1, View()))
        first = await ears.next(Frame)
        assert supervisor.process_id is not None
        os.kill(supervisor.process_id, signal.SIGKILL)
        supervisor.send(Want(task, 2, View()))  # nobody takes it any more
        while supervisor.process_id is not None:
            await asyncio.sleep(0)
        supervisor.send(Update(task, 2, edit=SceneEdit(camera=arrays_of("plain").camera), base=1))
        supervisor.send(Want(task, 3, View(), anyway=True))
        supervisor.send(Read(task, 1, LINEAR))
        await ears.next(str)
        await replaced(supervisor)
        answers = [await ears.next(Frame | Image) for _ in range(2)]  # whichever comes first
        assert {type(each): each.serial for each in answers} == {Frame: 3, Image: 1}
        assert first.generation == 1 and all(each.generation == 2 for each in answers if isinstance(each, Frame))

    rendering(test)


def test_killed_between_a_frame_and_the_next_want(rendering: Rendering) -> None:
    """The next one starts as fast as others, and steps back then."""

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = await opened(supervisor, ears)
        supervisor.send(Want(task, 1, View()))
        assert (await ears.next(Frame)).serial == 1
        await replaced(supervisor)
        own = os.getpriority(os.PRIO_PROCESS, 0)
        assert niceness(supervisor.process_id) == {own}
        supervisor.send(Want(task, 2, View()))
        assert (await ears.next(Frame)).serial == 2
        assert min(niceness(supervisor.process_id)) >= min(own + NICENESS, 19)

    rendering(test)


def test_too_large_an_edit_that_meets_a_kill_falls_back_all_the_same(rendering: Rendering) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = await opened(supervisor, ears)
        await ears.next(Loaded)
        assert supervisor.process_id is not None
        os.kill(supervisor.process_id, signal.SIGKILL)
        supervisor.send(Update(task, 2, settings=settings(12_000), base=1))
        failed = await ears.next(Failed)
        assert (failed.generation, failed.refused, failed.fallback) == (2, True, 1)
        supervisor.send(Want(task, 1, View(), anyway=True))
        assert (await ears.next(Frame)).generation == 1

    rendering(test)


def test_a_renderer_that_makes_a_mistake_is_not_one_that_was_killed(rendering: Rendering) -> None:
    """However busy the machine: it ends at once, and with a code of its own. What it held counts no longer."""

    async def test(supervisor: Supervisor) -> None:
        pid, before = supervisor.process_id, Counter(supervisor.statistics.restarts)
        assert supervisor._keeper.process is not None
        supervisor.statistics.load = RendererLoad(resting_bytes=1 << 40)
        supervisor._keeper.process.link.send("no message")
        while supervisor.process_id in (pid, None):
            await asyncio.sleep(0.001)
        assert supervisor.statistics.restarts - before == {"crashed": 1}
        assert not supervisor.statistics.load.resting_bytes

    rendering(test)


def test_work_is_taken_while_it_is_replaced(rendering: Rendering) -> None:
    async def test(supervisor: Supervisor) -> None:
        assert supervisor.process_id is not None
        os.kill(supervisor.process_id, signal.SIGKILL)
        while supervisor.info is not None:
            await asyncio.sleep(0)
        with pytest.raises(Unavailable):
            await supervisor.ready(0)
        await supervisor.able(0)
        ears = Ears()
        await opened(supervisor, ears, samples=4)
        assert (await ears.next(Done)).progress.samples == 4
        with pytest.raises(Unavailable):
            await Supervisor().able(0)

    rendering(test)
