"""The renderer's process: when it is enough, and that nothing brings it down."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, SceneEdit
from service.document import parse_scene
from service.ipc import channel, heartbeat
from service.ipc.leases import Lease
from service.ipc.messages import (
    Done,
    Evicted,
    Failed,
    Frame,
    Image,
    Loaded,
    Progressed,
    Read,
    StopRule,
    ToRenderer,
    Update,
    View,
    Want,
)
from service.ipc.task_control import Drop, Hold, Pause, Resume, Stop
from service.pack import pack
from service.problems import Unavailable
from service.renderers.local.keeper import CLOSING
from service.renderers.local.supervisor import Supervisor
from service.worker.device.resolution_ladder import FULL_S, NEXT_S, ResolutionLadder
from service.worker.loop import Loop, coalesced
from service.worker.progress import NoiseReading, judged_after, judged_from, late, reached
from tests.documents import Shelf
from tests.service.rendering.fakes import FakeProcesses, with_fake_processes
from tests.serving import PATIENCE_S, SCENE
from tests.supervisors import ENDLESS, LINEAR, Ears, settings


@pytest.mark.parametrize(
    ("stop", "samples", "noise", "expected"),
    [
        (StopRule(10), 9, None, None),
        (StopRule(10), 10, None, "max_samples"),
        (StopRule(), 1 << 24, None, "max_samples"),
        (StopRule(target_noise=0.1), 16, 0.09, "target_noise"),
        (StopRule(target_noise=0.1), 16, 0.11, None),
        (StopRule(target_noise=0.1), 15, 0.01, None),  # the meter is not to be trusted yet
        (StopRule(target_noise=0.1), 20, None, None),
    ],
)
def test_reached(stop: StopRule, samples: int, noise: float | None, expected: str | None) -> None:
    assert reached(stop, samples, noise) == expected


def test_every_message_has_one_handler_and_may_come_too_late(gpu: Renderer) -> None:
    """The server may write about a task before it hears that the task is gone; it waits for the answer to a Read."""
    mine, its = channel.pair()
    memory = heartbeat.memory()
    loop = Loop(its, gpu, heartbeat.Heartbeat(memory), 0, None, 1.0)
    os.close(memory)
    assert set(loop.handlers) == set(get_args(ToRenderer))
    for message in (
        Pause(1),
        Resume(1),
        Hold(1),
        Stop(1),
        Drop(1),
        Want(1, 1, View()),
        Lease(1, 1, 1, 0, 8, 56, 0, 8),
    ):
        loop.handlers[type(message)](message)
    with pytest.raises(BlockingIOError):
        channel.receive(mine)
    loop.handlers[Read](Read(1, 2, View()))
    assert channel.receive(mine) == Evicted(1)
    mine.close()
    its.close()


def test_a_noise_that_was_reported_is_read_again_before_it_decides() -> None:
    """A checkpoint's may be of fewer samples than the picture has."""
    reading, picture = NoiseReading(), SimpleNamespace(samples=64, noise=lambda: 0.25)
    reading.set(64, 0.5)
    shown: Any = picture
    assert reading.read(shown) == 0.5 and reading.read(shown, fresh=True) == 0.25 and reading.at == 64


def test_noise_is_judged_at_numbers_that_depend_on_nothing() -> None:
    """At most 16 in an octave, all of them borders of blocks of samples from 64 on."""
    judged, samples = [], 0
    while samples < 1 << 16:
        samples = judged_after(samples)
        judged.append(samples)
        assert judged_from(samples) == judged_from(samples - 0.5) == samples
    assert judged[:6] == [16, 32, 64, 128, 192, 256] and not any(n % 64 for n in judged[2:])
    for octave in range(4, 16):
        assert 1 <= sum(1 << octave <= n < 2 << octave for n in judged) <= 16


@pytest.mark.parametrize(
    ("now_s", "sample_s", "even", "expected"),
    [
        (1.9, 0.01, True, False),
        (2.0, 0.01, True, True),
        (2.0, 0.01, False, False),  # a pass under way may be finished ...
        (2.15, 0.01, False, True),  # ... but not for long
        (1.5, 1.0, True, True),  # the next would end too late
        (1.5, 1.0, False, False),
        (0.0, 9.0, True, False),  # one is tried in any case
    ],
)
def test_late(now_s: float, sample_s: float, even: bool, expected: bool) -> None:
    assert late(StopRule(time_limit=2.0), now_s, sample_s, even) is expected
    assert not late(StopRule(), now_s, sample_s, even)


class Pictures:
    """As much of a renderer as a ladder needs before it is climbed."""

    def __init__(self, software: bool = True) -> None:
        self.info = {"software": software}

    def picture(self, scene: Any, settings: RenderSettings) -> RenderSettings:
        return settings


@pytest.mark.parametrize("side", [1, 40, 512, 4096])
@pytest.mark.parametrize("pixel_s", [None, 1e-9, 1.2e-7, 1e-6, 1e-3])
@pytest.mark.parametrize("software", [True, False])
def test_ladder(side: int, pixel_s: float | None, software: bool) -> None:
    renderer: Any = Pictures(software)
    ladder = ResolutionLadder(renderer, renderer, RenderSettings(side, side))
    scale = ladder.first(pixel_s)
    assert scale == 1.0 or side * scale >= 16
    if pixel_s and side * side * pixel_s <= FULL_S:
        assert scale == 1.0
    climbed = [scale]
    while climbed[-1] < 1.0:
        climbed.append(ladder.next(climbed[-1], pixel_s))
    assert all(higher >= 2 * lower for lower, higher in pairwise(climbed))
    if pixel_s and side * side * pixel_s <= NEXT_S:
        assert len(climbed) <= 2


def test_a_gpu_shows_the_whole_picture_at_once() -> None:
    """Before anything was measured, 1920 x 1080 begins at full size, where a processor begins with a part."""
    scene: Any = None
    renderers: list[Any] = [Pictures(True), Pictures(False)]
    ladders = [ResolutionLadder(renderer, scene, RenderSettings(1920, 1080)) for renderer in renderers]
    assert [ladder.first(None) for ladder in ladders] == [1 / 16, 1.0]


class Costly:
    """As much of a picture as a ladder needs to pass its rates on."""

    def __init__(self) -> None:
        self.samples, self.cost_s = 0, 0.0
        self.like: Any = None

    def expect_costs(self, other: Any) -> None:
        self.cost_s, self.like = other.cost_s, other


def test_each_rung_is_expected_to_cost_what_the_sharpest_so_far_did() -> None:
    renderer: Any = SimpleNamespace(picture=lambda scene, settings: Costly(), info={"software": True})
    ladder = ResolutionLadder(renderer, renderer, RenderSettings(512, 512))
    first: Any = ladder.picture(1 / 8)
    second: Any = ladder.picture(1 / 4)
    assert first.like is second.like is None
    first.samples, first.cost_s = 1, 1e-6
    assert ladder.picture(1 / 4) is second and second.like is first
    second.samples = 1
    whole: Any = ladder.picture(1.0)
    assert whole.like is second and whole.cost_s == 1e-6
    assert first.like is None


def test_coalescing_keeps_order_where_it_matters() -> None:
    first, second, third = (SceneEdit(camera=word) for word in ("c", "d", "e"))  # type: ignore[arg-type]
    camera, material, limit = Update(1, 2, edit=first), Update(1, 3, edit=second), Update(1, 4, stop=StopRule(9))
    want, other = Want(1, 5, View()), Update(2, 1, edit=third)
    assert list(coalesced(iter([camera, want, material, other, limit]))) == [
        Update(1, 4, edit=second, stop=StopRule(9)),
        other,
        want,
    ]
    assert list(coalesced(iter([camera, Stop(1), material]))) == [camera, Stop(1), material]


@pytest.fixture(scope="module")
def arrays(gpu: Renderer) -> Any:
    return pack(parse_scene(SCENE), Shelf()).arrays


def test_load_trace_done_read(rendering: Any, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays, settings(), StopRule(20)))
        loaded = await ears.next(Loaded)
        assert loaded.generation == 1 and loaded.setup_s > 0 and loaded.warnings == []
        done = await ears.next(Done)
        assert done.reason == "max_samples" and done.progress.samples == 20 and done.progress.noise > 0
        supervisor.send(Read(task, 3, LINEAR))
        supervisor.send(Read(task, 4, View(encoding="f4")))
        linear, shown = await ears.next(Image), await ears.next(Image)
        assert (linear.serial, shown.serial) == (3, 4)
        assert linear.pixels.shape == shown.pixels.shape == (32, 32, 4) and 0 <= shown.pixels.min() <= 1
        supervisor.drop(task)

    rendering(test)


def test_pauses_and_other_tasks_change_no_pixel(rendering: Any, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        async def picture(disturbed: bool) -> np.ndarray:
            ears = Ears()
            task = supervisor.open(ears)
            await supervisor.send_scene(Update(task, 1, arrays, settings(128), StopRule(24)))
            for _ in range(3 if disturbed else 0):
                await asyncio.sleep(0.03)
                supervisor.send(Pause(task))
                await asyncio.sleep(0.02)
                supervisor.send(Resume(task))
            await ears.next(Done)
            supervisor.send(Read(task, 1, LINEAR))
            pixels = (await ears.next(Image)).pixels
            supervisor.drop(task)
            return np.array(pixels)

        alone = await picture(disturbed=False)
        crowd = await asyncio.gather(*(picture(disturbed=True) for _ in range(3)))
        assert all(np.array_equal(alone, one) for one in crowd)

    rendering(test)


def test_a_want_is_answered_once_and_only_by_something_new(rendering: Any, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays, settings(), StopRule(4), interactive=True))
        await ears.next(Done)
        supervisor.send(Want(task, 1, View()))
        frame = await ears.next(Frame)
        assert frame.serial == 1 and frame.last and frame.progress.samples == 4 and frame.pixels.dtype == np.uint8
        supervisor.send(Want(task, 2, View()))
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(ears.next(Frame), 0.2)
        supervisor.send(Want(task, 3, View(exposure=1.0), anyway=True))
        assert (await ears.next(Frame)).serial == 3
        supervisor.drop(task)

    rendering(test)


def test_a_failure_is_the_tasks_own(rendering: Any, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        good, bad = Ears(), Ears()
        one, other = supervisor.open(good), supervisor.open(bad)
        await supervisor.send_scene(Update(one, 1, arrays, settings(), ENDLESS))
        await supervisor.send_scene(Update(other, 1, arrays, settings(filter="sinc"), ENDLESS))
        failed = await bad.next(Failed)
        assert failed.generation == 1 and failed.detail and failed.serial is None
        before = (await good.next(Progressed)).progress.samples
        while (await good.next(Progressed)).progress.samples <= before:  # a pass takes longer than a report
            pass
        supervisor.send(Update(other, 2, edit=SceneEdit(materials=arrays.materials)))  # in vain, and harmless
        await supervisor.send_scene(Update(other, 3, arrays, settings(), StopRule(2)))
        assert (await bad.next(Done)).generation == 3
        supervisor.send(Read(other, 9, View(aov="beauty")))
        assert (await bad.next(Failed)).serial == 9
        supervisor.send(Read(other, 10, LINEAR))
        assert (await bad.next(Image)).pixels is not None
        supervisor.drop(one)
        supervisor.drop(other)

    rendering(test)


def test_an_image_before_the_first_sample_is_none(rendering: Any, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays, settings(2048, max_bounces=64), ENDLESS))
        supervisor.send(Read(task, 1, LINEAR))
        assert (await ears.next(Image)).pixels is None
        supervisor.send(Stop(task))
        assert (await ears.next(Done)).reason == "stopped"
        supervisor.drop(task)

    rendering(test)


def test_idle_costs_nothing(rendering: Any, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays, settings(), StopRule(4)))
        await ears.next(Done)
        assert supervisor.process_id is not None
        before = cpu_ticks(supervisor.process_id)
        await asyncio.sleep(0.4)
        assert cpu_ticks(supervisor.process_id) - before <= 1
        supervisor.drop(task)

    rendering(test)


def cpu_ticks(pid: int) -> int:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[11]) + int(fields[12])


def test_what_was_used_is_told(rendering: Any, arrays: Any) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears, before = Ears(), dict(supervisor.statistics.gpu_s)
        samples, loads = supervisor.statistics.samples, supervisor.statistics.setup_s.count
        task = supervisor.open(ears, "render")
        await supervisor.send_scene(Update(task, 1, arrays, settings(), StopRule(20)))
        await ears.next(Done)
        await asyncio.sleep(0.1)
        used_s = supervisor.statistics.gpu_s["render"] - before.get("render", 0.0)
        assert 0 < used_s < 20 and supervisor.statistics.gpu_s_of[task] == pytest.approx(used_s)
        assert supervisor.statistics.samples - samples == 20 * 32 * 32
        assert supervisor.statistics.setup_s.count == loads + 1 and supervisor.statistics.load.tasks >= 1
        supervisor.drop(task)
        assert task not in supervisor.statistics.gpu_s_of

    rendering(test)


def test_no_renderer_is_told_after_three_tries(impatient: None) -> None:
    processes = FakeProcesses("")

    async def test(supervisor: Supervisor) -> None:
        with pytest.raises(Unavailable, match="no such device"):
            await supervisor.ready(PATIENCE_S)
        assert processes.began == 3
        with pytest.raises(Unavailable, match="no such device"):
            supervisor.open(Ears())

    with_fake_processes(test, processes)


def test_its_end_is_told_to_all_who_have_work_there() -> None:
    ears = Ears()

    async def test(supervisor: Supervisor) -> None:
        await supervisor.ready(PATIENCE_S)
        supervisor.open(ears)

    with_fake_processes(test, FakeProcesses())
    assert ears.messages.get_nowait() == CLOSING


@pytest.mark.parametrize("module", ["service.worker.loop", "service.worker.helpers.compile_main"])
def test_what_renders_loads_no_model_of_a_document(module: str) -> None:
    """pydantic and the models take as long to load as all else that these processes need."""
    program = f"import sys, {module}; print({{'pydantic', 'service.document', 'asyncio'}} & set(sys.modules))"
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (answer.returncode, answer.stdout) == (0, "set()\n"), answer.stderr
