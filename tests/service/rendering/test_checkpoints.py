"""A long render that loses its renderer goes on from where it was saved last, to the same bits."""

from __future__ import annotations

import asyncio
import math
import os
import signal
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.picture.blocks import FIRST
from service.ipc import channel
from service.ipc.messages import (
    Checkpoint,
    Done,
    Image,
    Progress,
    Progressed,
    Read,
    Restore,
    StopRule,
    Update,
)
from service.ipc.task_control import CheckpointStored, Stop
from service.renderers.local.supervisor import Supervisor
from service.server.renders.recorder import Recorder
from service.server.renders.store.store import RenderStore
from service.worker.device import checkpoints
from tests.marks import seldom
from tests.supervisors import LINEAR, Ears, Rendering, arrays_of, settings

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


@pytest.mark.parametrize("adaptive", seldom([False, True], [True]))
def test_it_goes_on_to_the_same_bits(rendering: Rendering, adaptive: bool) -> None:
    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, ENDLESS, adaptive=adaptive)
        elapsed_s, killed = 0.0, supervisor.statistics.restarts["killed"]
        for _ in range(2):
            saved = await lost(supervisor, ears)
            supervisor.send(Read(task, 1, LINEAR))  # waits until there is something to read
            assert (await ears.next(Image)).progress.samples == saved > 0
            again = (await ears.next(Progressed)).progress
            assert again.samples >= saved and again.elapsed_s > elapsed_s
            elapsed_s = again.elapsed_s
        supervisor.send(Update(task, 2, stop=StopRule(again.samples + 8), base=1))
        done = await ears.next(Done)
        assert done.reason == "max_samples" and done.progress.samples >= again.samples
        assert supervisor.statistics.restarts["killed"] == killed + 2
        pixels = await picture(supervisor, task, ears)
        supervisor.drop(task)
        task, ears = await begun(supervisor, done.progress.samples, adaptive=adaptive)
        await ears.next(Done)
        assert np.array_equal(pixels, await picture(supervisor, task, ears))

    rendering(test, checkpoint_s=0.05)


@pytest.mark.parametrize("readable", [True, False])
def test_what_was_stored_is_read_from_there(rendering: Rendering, readable: bool) -> None:
    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, ENDLESS)
        checkpoint = await ears.next(Checkpoint)
        reads = []

        def read() -> Restore:
            reads.append(checkpoint.progress.samples)
            if not readable:
                raise OSError("the disk is broken")
            return Restore(task, 1, checkpoint.saved, None, checkpoint.progress)

        supervisor.stored(task, checkpoint.saved, read)
        pid = supervisor.process_id
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        while supervisor.process_id == pid:
            await asyncio.sleep(0.001)
        while not ears.messages.empty() and not reads:
            assert not isinstance(ears.messages.get_nowait(), Done)
        if not readable:
            assert await ears.next(str) == "again"
        again = (await ears.next(Progressed)).progress
        assert len(reads) == 1
        assert again.samples >= checkpoint.progress.samples if readable else again.samples > 0
        supervisor.send(Read(task, 1, LINEAR))
        assert (await ears.next(Image)).pixels is not None

    rendering(test)


@pytest.mark.slow
@pytest.mark.parametrize("reason", [None, "max_samples"])
def test_a_picture_of_an_earlier_version(rendering: Rendering, reason: Any) -> None:
    """It had no blocks of samples: under way it begins again, as other bits would follow; ended it is shown."""

    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, ENDLESS)
        checkpoint = await ears.next(Checkpoint)
        while checkpoint.saved.samples < FIRST:
            checkpoint = await ears.next(Checkpoint)
        supervisor.drop(task)
        samples = checkpoint.saved.samples + 50
        old = replace(checkpoint.saved, buffers=checkpoint.saved.buffers[:7], under_way=(0, 0, 0))
        task, ears = await begun(supervisor, samples)
        supervisor.send(Restore(task, 1, old, reason, checkpoint.progress))
        if reason is not None:
            supervisor.send(Read(task, 1, LINEAR))
            assert (await ears.next(Image)).progress.samples == old.samples
            return
        assert (await ears.next(Done)).progress.samples == samples
        pixels = await picture(supervisor, task, ears)
        task, ears = await begun(supervisor, samples)
        await ears.next(Done)
        assert np.array_equal(pixels, await picture(supervisor, task, ears))

    rendering(test, checkpoint_s=0.05)


def test_what_is_cancelled_meanwhile_stays_as_it_was(rendering: Rendering) -> None:
    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, ENDLESS)
        saved = await lost(supervisor, ears)
        supervisor.send(Stop(task))
        done = await ears.next(Done)
        assert done.reason == "stopped" and done.progress.samples == saved
        assert (await picture(supervisor, task, ears)).shape == (96, 96, 4)

    rendering(test, checkpoint_s=0.05)


def test_a_stream_has_none(rendering: Rendering) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears, before = Ears(), supervisor.statistics.checkpoints
        task = supervisor.open(ears)
        update = Update(task, 1, arrays_of("plain"), settings(64), StopRule(1000), interactive=True)
        await supervisor.send_scene(update)
        await ears.next(Done)
        assert supervisor.statistics.checkpoints == before

    rendering(test, checkpoint_s=0.05)


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


def test_it_costs_a_hundredth_of_the_time_until_too_much_could_be_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    now, step_s = 0.0, 0.005

    def slow(room: Any) -> Generator[None, None, str]:
        nonlocal now
        for _ in range(4):
            now += step_s
            yield
        return "saved"

    def saved(kept: checkpoints.Checkpointer, turns_s: float = 0.0) -> None:
        nonlocal now
        kept.begin(picture)
        for expected in [None] * 4 + ["saved"]:
            assert kept.step() == expected
            now += turns_s if expected is None else 0.0  # of other tasks
        assert not kept.under_way

    def pause_s(kept: checkpoints.Checkpointer, elapsed_s: float) -> float:
        nonlocal now
        began = now
        while not kept.due(picture, elapsed_s):
            now += 0.125
        return now - began

    def lost_s(kept: checkpoints.Checkpointer, elapsed_s: float, stored_s: float, turns_s: float = 0.0) -> float:
        """What would be lost at most: since the last one began to be read until the next one is on the disk."""
        began = now
        saved(kept, turns_s)
        kept.stored(stored_s)
        pause_s(kept, elapsed_s)
        saved(kept, turns_s)
        return now - began + stored_s

    monkeypatch.setattr(checkpoints.time, "monotonic", lambda: now)
    picture: Any = SimpleNamespace(samples=0, under_way=(1, 0, 8), state_sizes=[], save=slow, at_border=False)
    kept = checkpoints.Checkpointer(1.0)
    assert pause_s(kept, 1.0) == 1.0
    saved(kept)
    assert pause_s(kept, 20.0) == pytest.approx(2.0, abs=0.2)
    saved(kept)
    kept.stored(0.03)  # writing is work, too
    assert pause_s(kept, 20.0) == pytest.approx(5.0, abs=0.2)
    step_s = 0.125  # a large picture: a hundredth would be 50 s and more, and at most 10 s may be lost
    for stored_s in (0.5, 2.0, 5.0):
        assert 8.0 < lost_s(kept, 20.0, stored_s) <= 10.0
    assert 8.0 < lost_s(kept, 20.0, 1.0, turns_s=0.25) <= 10.0
    assert 80.0 < lost_s(kept, 10_000.0, 2.0) <= 100.0  # 1 % of the render may be lost
    step_s = 0.0
    saved(kept)
    kept.stored(0.0)
    assert pause_s(kept, 10_000.0) == pytest.approx(40.0, abs=0.2)  # a small one needs none more often than that
    assert pause_s(kept, 20.0) == 0.0  # it is due until it is taken
    saved(kept)
    kept.stored(60.0)  # a disk that is too slow for all that: as often as it was asked for, and no oftener
    assert pause_s(kept, 20.0) == 1.0
    saved(kept)
    kept.hasten()
    assert pause_s(kept, 10_000.0) == 0.0
    picture.under_way = (0, 0, 0)
    assert not kept.due(picture, 10_000.0)  # nothing was traced
    picture.samples = 1
    assert kept.due(picture, 10_000.0)


def test_a_picture_at_a_border_has_half_the_bytes(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """So one that reaches one when it is nearly due stops there, and is saved."""
    now = 0.0
    monkeypatch.setattr(checkpoints.time, "monotonic", lambda: now)
    scene = gpu.load(arrays_of("plain"))
    picture = gpu.picture(scene, RenderSettings(16, 16))
    kept = checkpoints.Checkpointer(4.0)
    picture.trace(60.0, 20)
    now = 2.9
    assert kept.border(picture, 10.0) == math.inf
    now = 3.1
    large = sum(picture.state_sizes)
    assert kept.border(picture, 10.0) == 64 and not kept.due(picture, 10.0)
    picture.trace(60.0, 64)
    small = sum(picture.state_sizes)
    assert kept.due(picture, 10.0) and large - small > 47 * 16 * 16  # bytes of the block's pixels
    picture.trace(60.0, 65)
    assert kept.border(picture, 10.0) == 128 and not kept.due(picture, 10.0)
    now = 4.1
    assert kept.due(picture, 10.0)  # wherever it is
    picture.release()
    scene.release()


def test_checkpoints_wait_for_a_border(rendering: Rendering) -> None:
    """Where one is near: a block of a picture of 32 x 32 takes some milliseconds."""

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears, "render")
        update = Update(task, 1, arrays_of("plain"), settings(32, seed=4), StopRule(ENDLESS))
        await supervisor.send_scene(update)
        saved = [(await ears.next(Checkpoint)).saved for _ in range(4)]
        sizes = [sum(buffer.nbytes for buffer in each.buffers) for each in saved]
        at_border = [each.samples % 64 == 0 and not each.under_way[0] for each in saved]
        assert at_border.count(True) >= 2, (sizes, at_border)

    rendering(test, checkpoint_s=0.4)


class Heard:
    """The renderers, and the seconds that they hear of."""

    def __init__(self, to: Supervisor, heard: list[float]) -> None:
        self._to, self._heard = to, heard

    def send(self, message: Any) -> None:
        self._heard.append(message.took_s)
        self._to.send(message)

    def stored(self, *what: Any) -> None: ...


def test_the_renderer_hears_how_long_the_disk_took(rendering: Rendering, tmp_path: Path) -> None:
    """From the store that a render is recorded in, on the way that it goes in a server."""

    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, ENDLESS)
        heard: list[float] = []
        recorder = Recorder(RenderStore(tmp_path), 1, "a", renderers=cast(Any, Heard(supervisor, heard)))
        checkpoint = await ears.next(Checkpoint)
        assert await recorder.store_now(lambda: recorder.checkpoint(checkpoint))
        await recorder.close()
        assert len(heard) == 1 and heard[0] > 0
        await ears.next(Checkpoint)  # the disk is fast, and they go on
        supervisor.send(CheckpointStored(task, 2.0))
        for _ in range(3):
            await ears.next(Progressed)
        while not ears.messages.empty():
            ears.messages.get_nowait()
        reports = 0
        while reports < 3:  # 0.1 s apart: without it several checkpoints would come
            message = await ears.messages.get()
            assert not isinstance(message, Checkpoint)
            reports += isinstance(message, Progressed)

    rendering(test, checkpoint_s=0.05)
