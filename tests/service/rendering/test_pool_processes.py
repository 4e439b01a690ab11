"""A pool of real renderers, which are killed: streams and renders go on elsewhere, to the same bits."""

from __future__ import annotations

import asyncio
import os
import signal
from dataclasses import replace
from typing import Any

import numpy as np

from gpu import Renderer
from service.ipc.messages import (
    Checkpoint,
    Done,
    Frame,
    Image,
    Loaded,
    Progress,
    Read,
    Restore,
    StopRule,
    Update,
    View,
    Want,
)
from service.renderers.local.process import Options, Process
from service.renderers.local.supervisor import Supervisor
from service.renderers.pool.pool import RendererPool, RendererSpec
from service.renderers.protocol import Place
from tests.supervisors import LINEAR, Ears, Rendering, arrays_of, renderer_options, settings

ENDLESS = 1 << 24


def test_two_renderers_and_a_loss_for_good(gpu: Renderer, impatient: None) -> None:
    """Real ones: each has a stream and a render; one is killed, and later cannot begin any more."""
    broken = False

    def start(*given: Any) -> Process:
        return Process(Options(device=99) if broken else renderer_options(checkpoint_s=0.1), *given)

    async def rendering(pool: RendererPool, ears: Ears, samples: int) -> int:
        task = pool.open(ears, "render")
        size = settings(96, seed=4)
        await pool.send_scene(Update(task, 1, arrays_of("plain"), size, StopRule(samples)))
        return task

    async def picture(pool: RendererPool, task: int, ears: Ears) -> Any:
        pool.send(Read(task, 1, LINEAR))
        return np.array((await ears.next(Image)).pixels)

    async def test() -> None:
        nonlocal broken
        pool = RendererPool([RendererSpec(Place("0"), renderer_options()), RendererSpec(Place("1"), start=start)])
        pool.start()
        try:
            while not all(member.state == "ready" for member in pool.members):
                await asyncio.sleep(0.02)
            streams, looking = [], [Ears(), Ears()]
            for ears in looking:
                streams.append(pool.open(ears))
                size = settings(64)
                await pool.send_scene(Update(streams[-1], 1, arrays_of("plain"), size, interactive=True))
                await ears.next(Loaded)
            assert {pool.homes[stream].place.id for stream in streams} == {"0", "1"}
            away = next(stream for stream in streams if pool.homes[stream].place.id == "1")
            ears = looking[streams.index(away)]

            async def frame(serial: int) -> Frame:
                pool.send(Want(away, serial, View(), anyway=True))
                return await ears.next(Frame)

            assert (await frame(1)).generation == 1
            first, second = [member.process_id for member in pool.members]
            assert first is not None and second is not None
            os.kill(second, signal.SIGKILL)
            assert (await frame(2)).generation == 1 and pool.homes[away].place.id == "1"
            assert [member.process_id == id for member, id in zip(pool.members, (first, second), strict=True)] == [
                True,
                False,
            ]

            hearing = [Ears(), Ears()]
            renders = [await rendering(pool, each, ENDLESS) for each in hearing]
            mine = next(i for i, render in enumerate(renders) if pool.homes[render].place.id == "1")
            pool.drop(renders[1 - mine])
            saved = (await hearing[mine].next(Checkpoint)).progress.samples
            broken = True
            moved = pool.members[1].process_id
            assert moved is not None
            os.kill(moved, signal.SIGKILL)
            pool.send(Update(renders[mine], 2, stop=StopRule(saved + 40), base=1))
            done = await hearing[mine].next(Done)
            assert done.progress.samples == saved + 40 and pool.homes[renders[mine]].place.id == "0"
            assert (await frame(3)).generation == 1 and pool.homes[away].place.id == "0"
            assert pool.members[1].state == "lost" and not pool.hopeless
            alone = Ears()
            whole = await rendering(pool, alone, saved + 40)
            await alone.next(Done)
            bits = [await picture(pool, renders[mine], hearing[mine]), await picture(pool, whole, alone)]
            assert np.array_equal(*bits)
        finally:
            await pool.close()
        assert all(member.process_id is None for member in pool.members)

    asyncio.run(test())


def test_a_picture_of_another_driver_begins_again(rendering: Rendering) -> None:
    async def test(supervisor: Supervisor) -> None:
        first, update = Ears(), Update(0, 1, arrays_of("plain"), settings(64), StopRule(ENDLESS))
        task = supervisor.open(first, "render")
        await supervisor.send_scene(replace(update, task=task))
        saved = await first.next(Checkpoint)
        supervisor.drop(task)
        assert saved.saved.driver == supervisor.driver
        for driver, begins in ((saved.saved.driver, []), ("another", ["again"])):
            ears, stop = Ears(), StopRule(saved.progress.samples + 4)
            task = supervisor.open(ears, "render")
            progress = Progress(saved.progress.samples, None, 1000.0)
            restore = Restore(task, 1, replace(saved.saved, driver=driver), None, progress)
            await supervisor.send_scene(replace(update, task=task, stop=stop), restore)
            done = await ears.next(Done | str)
            again = [done] if isinstance(done, str) else []
            done = done if isinstance(done, Done) else await ears.next(Done)
            assert again == begins and (done.progress.elapsed_s > 1000) is (not begins)

    rendering(test, checkpoint_s=0.05)
