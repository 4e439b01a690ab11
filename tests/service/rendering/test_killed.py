"""Renderers that are killed at the worst moments: whoever has work there gets it done all the same, only later."""

from __future__ import annotations

import asyncio
import os
import signal
from pathlib import Path

import pytest

from gpu import Renderer, SceneEdit
from service.ipc.messages import Done, Failed, Frame, Image, Loaded, Read, StopRule, Update, View, Want
from service.problems import Unavailable
from service.renderers.local import restarts
from service.renderers.local.supervisor import Supervisor
from tests.supervisors import LINEAR, Ears, arrays_of, renderer_options, settings, with_supervisor


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


def test_who_kills_it_before_it_can_start_never_wins(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four times the three that may fail by themselves, and more than were once allowed."""
    monkeypatch.setattr(restarts, "AFTER_KILLS_S", 0.0)

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = await opened(supervisor, ears)
        await ears.next(Loaded)
        for _ in range(35):
            await replaced(supervisor)
        assert not supervisor.hopeless and supervisor.statistics.restarts["killed"] == 35
        supervisor.send(Want(task, 1, View()))
        assert (await ears.next(Frame)).serial == 1

    with_supervisor(test)


def test_renderers_that_are_killed_at_once_are_not_begun_all_the_time() -> None:
    killed = restarts.Restarts()
    killed.shots = 3
    assert killed.pause_s(0.1) == pytest.approx(1.4) and killed.pause_s(2.0) == 0.0
    killed.shots = 1000
    assert killed.pause_s(0.0) == restarts.AFTER_KILLS_S and killed.pause_s(8.0) == 0.0


def test_what_was_asked_while_there_was_none_is_answered(gpu: Renderer) -> None:
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

    with_supervisor(test)


def test_killed_between_a_frame_and_the_next_want(gpu: Renderer) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = await opened(supervisor, ears)
        for serial in range(1, 3):
            supervisor.send(Want(task, serial, View()))
            assert (await ears.next(Frame)).serial == serial
            await replaced(supervisor)

    with_supervisor(test)


def test_too_large_an_edit_that_meets_a_kill_falls_back_all_the_same(gpu: Renderer) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = await opened(supervisor, ears)
        await ears.next(Loaded)
        assert supervisor.process_id is not None
        os.kill(supervisor.process_id, signal.SIGKILL)
        supervisor.send(Update(task, 2, settings=settings(6000), base=1))
        failed = await ears.next(Failed)
        assert (failed.generation, failed.refused, failed.fallback) == (2, True, 1)
        supervisor.send(Want(task, 1, View(), anyway=True))
        assert (await ears.next(Frame)).generation == 1

    with_supervisor(test, memory=64 << 20)


def test_a_renderer_that_makes_a_mistake_is_not_one_that_was_killed(gpu: Renderer) -> None:
    """However busy the machine: it ends at once, and with a code of its own."""

    async def test(supervisor: Supervisor) -> None:
        pid = supervisor.process_id
        assert supervisor._keeper.process is not None
        supervisor._keeper.process.link.send("no message")
        while supervisor.process_id in (pid, None):
            await asyncio.sleep(0.001)
        assert dict(supervisor.statistics.restarts) == {"crashed": 1}

    with_supervisor(test)


def test_work_is_taken_while_it_is_replaced(gpu: Renderer) -> None:
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

    with_supervisor(test)


def test_it_starts_as_fast_as_others_and_steps_back_then(gpu: Renderer) -> None:
    async def test() -> None:
        supervisor = Supervisor(renderer_options())
        supervisor.start()
        own = os.getpriority(os.PRIO_PROCESS, 0)
        assert niceness(supervisor.process_id) == {own}
        await supervisor.ready(60)
        assert min(niceness(supervisor.process_id)) >= min(own + 10, 19)
        await supervisor.close()

    asyncio.run(test())
