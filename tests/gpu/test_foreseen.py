"""Kernels that are compiled before anybody waits for them."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from gpu import KernelKey, Renderer, RenderSettings
from gpu.precompile.kernel_keys import keys_after_edit
from service.rendering.ipc.messages import Foresee, Loaded, StopRule, Update, driver_of
from service.rendering.supervisor.supervisor import Supervisor
from service.rendering.worker.device.loaded_scene import begin_key
from service.rendering.worker.helpers.compile_client import records
from tests.gpu.test_precompile import SIZE, Ears, arrays, cold
from tests.supervisors import with_supervisor

__all__ = ["arrays", "cold"]  # fixtures


def test_a_foreseen_scene_begins_with_a_kernel_that_is_there(gpu: Renderer, arrays: Any, cold: Path) -> None:
    """As does the first touch of its opacity, once a stream has begun with it."""

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        supervisor.send(Foresee(task, arrays, SIZE))
        await recorded(begin_key(Foresee(task, arrays, SIZE)))
        await supervisor.send_scene(Update(task, 1, arrays, SIZE, StopRule(4), interactive=True))
        assert (await ears.next(task, Loaded)).compile_ms < 250.0  # from the disk cache
        for key in keys_after_edit(arrays, RenderSettings(**SIZE)):
            await recorded(key)

    async def recorded(key: KernelKey) -> None:
        async with asyncio.timeout(60):
            while not (records() / key.digest(driver_of(gpu.info))).exists():
                await asyncio.sleep(0.05)

    with_supervisor(test)
