"""Renders and streams that several real renderers trace together: the same bits as with one, whoever is killed."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Awaitable, Callable
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, SceneEdit
from service.ipc.messages import Done, Frame, Image, Progressed, Read, StopRule, Update, View, Want
from service.renderers.local.process import Options, Process
from service.renderers.pool.pool import RendererPool, RendererSpec
from service.renderers.protocol import Place
from tests.families import FamilyRenderer
from tests.serving import PATIENCE_S
from tests.supervisors import LINEAR, Ears, arrays_of, renderer_options, settings

SIDE, SAMPLES = 96, 500  # the last block ends before its border
LONG = 5000  # samples of a picture that takes longer than a renderer's new start


@pytest.fixture(scope="module")
def alone(gpu: FamilyRenderer) -> Callable[[int], dict[str, np.ndarray]]:
    """The AOVs of the picture that one renderer traces at a time, by the kernel that the renderers have; its argument
    is the number of samples."""

    @cache
    def traced(samples: int) -> dict[str, np.ndarray]:
        with gpu.exact():
            scene = gpu.load(arrays_of("plain"))
        picture = gpu.picture(scene, RenderSettings(**settings(SIDE, seed=4)))
        picture.trace(1e9, samples)
        read = {aov: picture.read(aov) for aov in ("color", "variance", "depth")}
        picture.release()
        scene.release()
        return read

    return traced


class _Divided:
    """A pool of three renderers with one render at a time, and what it is told of it."""

    def __init__(self) -> None:
        self.pool = RendererPool([RendererSpec(Place(str(n)), start=partial(self._start, n)) for n in range(3)])
        self.ears = Ears()
        self.task = 0
        self.broken: int | None = None  # the renderer that does not begin any more

    def _start(self, number: int, *given: Any) -> Process:
        return Process(Options(device=99) if number == self.broken else renderer_options(checkpoint_s=0.2), *given)

    async def begin(self, samples: int) -> None:
        if not self.task:
            self.pool.start()
        while not all(member.state == "ready" for member in self.pool.members):
            await asyncio.sleep(0.02)
        self.ears = Ears()
        self.task = self.pool.open(self.ears, "render")
        await self.pool.send_scene(
            Update(self.task, 1, arrays_of("plain"), settings(SIDE, seed=4), StopRule(samples))
        )

    async def trace_to(self, samples: int) -> None:
        while (await self.ears.next(Progressed)).progress.samples < samples:
            pass

    @property
    def home(self) -> int:
        return next(n for n, each in enumerate(self.pool.supervisors) if self.task in each.tasks)

    def kill(self, renderer: int) -> None:
        pid = self.pool.members[renderer].process_id
        assert pid is not None
        os.kill(pid, signal.SIGKILL)

    async def renderers(self, number: int) -> None:
        """Wait until so many trace the render."""
        while self.pool.tracing(self.task) != number:
            await asyncio.sleep(0.005)

    async def pictures(self, samples: int) -> dict[str, np.ndarray]:
        done = await self.ears.next(Done)
        assert done.reason == "max_samples" and done.progress.samples == samples
        out = {}
        for serial, aov in enumerate(("color", "variance", "depth"), 1):
            self.pool.send(Read(self.task, serial, View(aov, encoding=LINEAR.encoding)))
            pixels = (await self.ears.next(Image)).pixels
            assert pixels is not None
            out[aov] = np.array(pixels)
        return out


def _run(*acts: Callable[[_Divided], Awaitable[None]], samples: int = SAMPLES) -> list[dict[str, np.ndarray]]:
    """The picture of a render in which that happens, for one after the other in the same pool."""

    async def test() -> list[dict[str, np.ndarray]]:
        divided, found = _Divided(), list[dict[str, np.ndarray]]()
        try:
            async with asyncio.timeout(PATIENCE_S * len(acts)):
                for act in acts:
                    await divided.begin(samples)
                    await act(divided)
                    found.append(await divided.pictures(samples))
                    divided.pool.drop(divided.task)
            return found
        finally:
            await divided.pool.close()

    return asyncio.run(test())


async def _nothing(divided: _Divided) -> None:
    while divided.pool.tracing(divided.task):
        await asyncio.sleep(0.02)
    others = [member for n, member in enumerate(divided.pool.members) if n != divided.home]
    assert all(member.statistics.samples > 0 for member in others), "a renderer did not help"
    assert all(member.statistics.gpu_s["render"] > 0 for member in others)
    while (traced := sum(member.statistics.samples for member in divided.pool.members)) < SIDE**2 * SAMPLES:
        await asyncio.sleep(0.02)  # until the last report is there, which comes after the last block
    assert traced < 1.5 * SIDE**2 * SAMPLES, "samples that count twice"


async def _kill_home(divided: _Divided) -> None:
    await divided.trace_to(128)
    divided.kill(divided.home)


async def _kill_assistant(divided: _Divided) -> None:
    """It comes back while the picture is traced, and helps again."""
    await divided.trace_to(64)
    divided.kill((divided.home + 1) % 3)
    await divided.renderers(2)
    await divided.renderers(3)


async def _lose_home(divided: _Divided) -> None:
    """Its renderer cannot begin again, so that an assistant becomes the home."""
    await divided.trace_to(128)
    home = divided.home
    divided.broken = home
    divided.kill(home)
    while divided.home == home:
        await asyncio.sleep(0.02)
    await divided.renderers(2)


async def _kill_all(divided: _Divided) -> None:
    await divided.trace_to(200)
    for renderer in range(3):
        divided.kill(renderer)


@pytest.mark.parametrize(
    "acts",
    [
        (_nothing, _kill_home),
        *(pytest.param((a,), marks=pytest.mark.slow) for a in (_kill_assistant, _lose_home, _kill_all)),
    ],
    ids=lambda acts: " and ".join(act.__name__[1:] for act in acts),
)
def test_bits_are_those_of_one_renderer(
    acts: tuple[Callable[[_Divided], Awaitable[None]], ...],
    alone: Callable[[int], dict[str, np.ndarray]],
    impatient: None,
) -> None:
    samples = LONG if _kill_assistant in acts else SAMPLES
    for act, found in zip(acts, _run(*acts, samples=samples), strict=True):
        for aov, pixels in found.items():
            np.testing.assert_array_equal(pixels, alone(samples)[aov], err_msg=f"{act.__name__} {aov}")


@pytest.mark.exact
@pytest.mark.slow
def test_a_stream_on_all_renderers_takes_edits(gpu: Renderer) -> None:
    """Blocks of an older generation are thrown away; the picture after an edit is that of one renderer."""
    scene = gpu.load(arrays_of("plain"))
    scene.edit(SceneEdit(environment=(0.25, 0.0)).apply(scene.arrays))
    picture = gpu.picture(scene, RenderSettings(**settings(SIDE, seed=4)))
    picture.trace(1e9, 256)
    expected = picture.read("color")
    picture.release()
    scene.release()

    async def test() -> np.ndarray:
        divided = _Divided()
        pool, ears = divided.pool, divided.ears
        try:
            async with asyncio.timeout(240):
                pool.start()
                while not all(member.state == "ready" for member in pool.members):
                    await asyncio.sleep(0.02)
                task = divided.task = pool.open(ears)
                pool.divide(task, 99)
                size = settings(SIDE, seed=4)
                await pool.send_scene(Update(task, 1, arrays_of("plain"), size, StopRule(1 << 20), interactive=True))
                serial, samples = 0, 0
                while samples < 200:
                    serial += 1
                    pool.send(Want(task, serial, View()))
                    frame = await ears.next(Frame)
                    assert frame.progress.samples >= samples or frame.scale < 1.0
                    samples = frame.progress.samples
                assert pool.tracing(task) == 3
                pool.send(Update(task, 2, edit=SceneEdit(environment=(0.25, 0.0)), stop=StopRule(256), base=1))
                while (await ears.next(Done)).generation != 2:
                    pass
                pool.send(Read(task, 1, LINEAR))
                pixels = (await ears.next(Image)).pixels
                assert pixels is not None
                return np.array(pixels)
        finally:
            await pool.close()

    np.testing.assert_array_equal(asyncio.run(test()), expected)
