"""A long render that loses its renderer goes on from where it was saved last, to the same bits."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Generator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from service.rendering.ipc import channel
from service.rendering.ipc.messages import Checkpoint, Done, Image, Progress, Progressed, Read, Stop, StopRule, Update
from service.rendering.supervisor.supervisor import Supervisor
from service.rendering.worker.device import checkpoints
from tests.gpu.test_precompile import LINEAR, arrays_of
from tests.service.rendering.test_worker import Ears, settings
from tests.supervisors import with_supervisor

ENDLESS = 1 << 24


async def begun(supervisor: Supervisor, samples: int, **more: Any) -> tuple[int, Ears]:
    ears = Ears()
    task = supervisor.open(ears, "render")
    await supervisor.send_scene(Update(task, 1, arrays_of("plain"), settings(96, seed=4, **more), StopRule(samples)))
    return task, ears


async def lost(supervisor: Supervisor, ears: Ears) -> int:
    """The samples of the last checkpoint; its renderer is no more, and what it said was heard."""
    saved = (await ears.next(Checkpoint)).progress.samples
    pid = supervisor.process_id
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    while supervisor.process_id == pid:
        await asyncio.sleep(0.001)
    while not ears.messages.empty():
        message = ears.messages.get_nowait()
        assert not isinstance(message, Done | str)
        saved = message.progress.samples if isinstance(message, Checkpoint) else saved
    return int(saved)


async def picture(supervisor: Supervisor, task: int, ears: Ears) -> np.ndarray:
    supervisor.send(Read(task, 1, LINEAR))
    return np.array((await ears.next(Image)).pixels)


@pytest.mark.parametrize("adaptive", [False, True])
def test_it_goes_on_to_the_same_bits(gpu: Renderer, adaptive: bool) -> None:
    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, ENDLESS, adaptive=adaptive)
        elapsed_s = 0.0
        for _ in range(3):
            saved = await lost(supervisor, ears)
            supervisor.send(Read(task, 1, LINEAR))  # waits until there is something to read
            assert (await ears.next(Image)).progress.samples == saved > 0
            again = (await ears.next(Progressed)).progress
            assert again.samples >= saved and again.elapsed_s > elapsed_s
            elapsed_s = again.elapsed_s
        supervisor.send(Update(task, 2, stop=StopRule(again.samples + 8), base=1))
        done = await ears.next(Done)
        assert done.reason == "max_samples" and done.progress.samples >= again.samples
        assert supervisor.statistics.checkpoints >= 3 and supervisor.statistics.restarts["killed"] == 3
        pixels = await picture(supervisor, task, ears)
        supervisor.drop(task)
        task, ears = await begun(supervisor, done.progress.samples, adaptive=adaptive)
        await ears.next(Done)
        assert np.array_equal(pixels, await picture(supervisor, task, ears))

    with_supervisor(test, checkpoint_s=0.05)


def test_what_is_cancelled_meanwhile_stays_as_it_was(gpu: Renderer) -> None:
    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, ENDLESS)
        saved = await lost(supervisor, ears)
        supervisor.send(Stop(task))
        done = await ears.next(Done)
        assert done.reason == "stopped" and done.progress.samples == saved
        assert (await picture(supervisor, task, ears)).shape == (96, 96, 4)

    with_supervisor(test, checkpoint_s=0.05)


def test_a_short_render_has_none(gpu: Renderer) -> None:
    async def test(supervisor: Supervisor) -> None:
        _, ears = await begun(supervisor, 20)
        await ears.next(Done)
        assert supervisor.statistics.checkpoints == 0

    with_supervisor(test, checkpoint_s=1e3)


def test_a_stream_has_none(gpu: Renderer) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(
            Update(task, 1, arrays_of("plain"), settings(64), StopRule(200), interactive=True)
        )
        await ears.next(Done)
        assert supervisor.statistics.checkpoints == 0

    with_supervisor(test, checkpoint_s=0.001)


def test_one_descriptor_goes_with_a_picture(gpu: Renderer) -> None:
    """The server keeps 64 of them and more."""
    scene = gpu.load(arrays_of("plain"))
    picture = gpu.picture(scene, RenderSettings(192, 192))
    picture.trace(60.0, 2)
    kept, saved = checkpoints.Checkpointer(10.0), None
    kept.begin(picture)
    while saved is None:
        saved = kept.step()
    encoded = channel.encode(Checkpoint(1, 1, Progress(), saved))
    assert len(encoded[1]) == 1
    received = channel.decode(*encoded).saved
    for mine, theirs, buffer in zip(saved.buffers, received.buffers, picture.state, strict=True):
        assert mine.tobytes() == theirs.tobytes() == buffer.read()
    picture.release()
    scene.release()


def test_it_takes_a_hundredth_of_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0

    def slow(room: Any) -> Generator[None, None, str]:
        nonlocal now
        for _ in range(4):
            now += 0.5
            yield
        return "saved"

    monkeypatch.setattr(checkpoints.time, "monotonic", lambda: now)
    kept, shown = (
        checkpoints.Checkpointer(10.0),
        SimpleNamespace(samples=1, settings=RenderSettings(512, 512), state=[], save=slow),
    )
    small: Any = shown
    assert not kept.due(small)
    now = 10.0
    assert kept.due(small)
    for side, kept_too in ((2236, True), (2400, False)):  # up to 5 megapixels, as the configuration says
        large: Any = SimpleNamespace(samples=1, settings=RenderSettings(side, side))
        assert kept.due(large) is kept_too
    kept.begin(small)
    steps = [kept.step() for _ in range(5)]
    assert steps == [None] * 4 + ["saved"] and not kept.under_way
    now += 199.0
    assert not kept.due(small)
    now += 1.0
    assert kept.due(small)
