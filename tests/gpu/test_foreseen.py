"""Kernels that are compiled before anybody waits for them."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

import pytest

from gpu import KernelKey, Renderer, RenderSettings
from gpu.precompile import fallback
from gpu.precompile.kernel_keys import keys_after_edit
from service.document import parse_scene
from service.ipc.messages import Foresee, Frame, Loaded, StopRule, Update, View, Want, driver_of
from service.pack import pack
from service.renderers.local.supervisor import Supervisor
from service.worker.device.loaded_scene import begin_key, slider_keys
from service.worker.helpers.compile_client import records
from tests.documents import Shelf
from tests.serving import PATIENCE_S, SCENE
from tests.supervisors import SIZE, Ears, arrays_of, with_supervisor

pytestmark = pytest.mark.exact


@pytest.mark.slow
def test_a_foreseen_scene_begins_with_a_kernel_that_is_there(
    gpu: Renderer, arrays: Any, cold: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As does the first touch of its sliders; and that of opacity, once a stream has begun with it."""
    # On a busy machine there is no time that nobody else wants, in which they are asked for.
    (tmp_path / "sitecustomize.py").write_text("import os\nos.sched_setscheduler = lambda *_: None\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", os.getcwd())]))

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        unforeseen = supervisor.open(ears)  # alone, so that its kernel is compiled while it is loaded
        await supervisor.send_scene(Update(unforeseen, 1, arrays_of("rich"), SIZE, StopRule(4)))
        cold_ms = (await ears.next_of(unforeseen, Loaded)).compile_ms
        supervisor.drop(unforeseen)
        task = supervisor.open(ears)
        supervisor.send(Foresee(task, arrays, SIZE))
        for key in [begin_key(Foresee(task, arrays, SIZE)), *slider_keys(Foresee(task, arrays, SIZE))]:
            await recorded(key)
        await supervisor.send_scene(Update(task, 1, arrays, SIZE, StopRule(4), interactive=True))
        assert (await ears.next_of(task, Loaded)).compile_ms < cold_ms / 4  # from the disk cache
        for key in keys_after_edit(arrays, RenderSettings(**SIZE)):
            await recorded(key)

    async def recorded(key: KernelKey) -> None:
        await until_recorded(gpu, key)

    with_supervisor(test, ahead="all")


@pytest.mark.slow
def test_a_lamp_is_seen_before_its_kernel_is_there(gpu: Renderer, arrays: Any, cold: Path) -> None:
    """Any number of shapes may begin to shine, so that the kernel for it is not foreseen; the superset kernel is."""
    lamp = {name: {**material, "emission": 2.0} for name, material in SCENE["materials"].items()}
    lit = pack(parse_scene({**SCENE, "materials": lamp}), Shelf()).arrays
    superset = fallback.superset(arrays)
    keys = fallback.superset_keys(arrays, RenderSettings(**SIZE), superset)
    assert fallback.kernel_key(lit, RenderSettings(**SIZE), superset) in keys

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays, SIZE, StopRule(4), interactive=True))
        await ears.next_of(task, Loaded)
        for key in keys:
            await until_recorded(gpu, key)
        await supervisor.send_scene(Update(task, 2, lit, SIZE, StopRule(4), interactive=True))
        supervisor.send(Want(task, 1, View()))
        while (first := await ears.next_of(task, Frame, Loaded)).generation != 2:
            supervisor.send(Want(task, 1, View()))
        assert isinstance(first, Frame) and first.provisional
        assert (await ears.next_of(task, Loaded)).generation == 2

    with_supervisor(test, ahead="some")


async def until_recorded(gpu: Renderer, key: KernelKey) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not (records() / key.digest(driver_of(gpu.info))).exists():
            await asyncio.sleep(0.05)
