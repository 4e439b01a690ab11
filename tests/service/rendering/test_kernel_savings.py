"""What a render's kernel saves: told to who asks, when nothing else is to be done, and why it is not known before."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import KernelKey, Renderer, RenderSettings
from gpu.kernels import features
from service.cli import main
from service.ipc.kernel_messages import KernelMeasured, MeasureKernel
from service.ipc.messages import Done, StopRule, Update
from service.renderers.local.supervisor import Supervisor
from service.worker.context import WorkerContext
from service.worker.kernel_savings import NO_KERNEL, NO_PICTURE, KernelSavings
from tests.extremes.scenes import LONG
from tests.gpu.test_precompile import arrays_of
from tests.service.rendering.test_worker import Ears, settings
from tests.serving import PATIENCE_S, SCENE, SMALL, Server
from tests.supervisors import with_supervisor

FIGURES = ("saving", "sample_s", "full_sample_s", "full_compile_ms")


@pytest.fixture
def more(monkeypatch: pytest.MonkeyPatch, gpu: Renderer) -> None:
    """A stand-in for the kernel with everything on, which takes a minute and a half to compile."""
    raised = features.flags(arrays_of("plain")) | {"HAS_BLINN_PHONG", "HAS_METAL_ROUGH", "HAS_BOXES"}
    monkeypatch.setattr(features, "everything", lambda: raised)


class Elsewhere:
    """A compiler that has a kernel when it is told so."""

    def __init__(self) -> None:
        self.asked: list[KernelKey] = []
        self.told: Any = None
        self.there = False

    def waits(self, key: KernelKey, told: Any, alone: bool = False, client: str = "") -> bool:
        self.asked.append(key)
        self.told = told
        return not self.there

    def has(self, key: KernelKey) -> bool:
        return self.there

    def forget(self, told: Any) -> None:
        self.told = None


def test_it_is_measured_between_slices(gpu: Renderer, more: None) -> None:
    compiler, said = Elsewhere(), list[Any]()
    scene = gpu.load(arrays_of("plain"))
    picture = gpu.picture(scene, RenderSettings(40, 30, clamp=3.0))
    picture.trace(60.0, 4)
    before = picture.read()
    savings = KernelSavings(WorkerContext(gpu, said.append, None, compiler), 7)  # type: ignore[arg-type]
    assert not savings.due
    savings.ask()
    savings.step(picture)
    assert not savings.due and not said, "it waits for the kernel"
    assert dict(compiler.asked[0].defines)["HAS_BOXES"] == 1 and dict(compiler.asked[0].defines)["HAS_CLAMP"] == 1
    compiler.there = True
    compiler.told(12000.0)
    steps = 0
    while savings.due:
        savings.step(picture)
        steps += 1
        if steps == 4:
            savings.part()  # its picture was put aside, and is back
    (price,) = said
    assert steps > 10 and price.task == 7 and not price.detail and price.full_compile_ms >= 12000
    assert price.sample_s > 0 and price.full_sample_s > 0
    assert price.kernel["saving"] == pytest.approx(1 - price.sample_s / price.full_sample_s)
    picture.trace(60.0, 8)
    again = gpu.picture(scene, picture.settings)
    again.trace(60.0, 4)
    assert np.array_equal(again.read(), before)
    again.trace(60.0, 8)
    assert np.array_equal(again.read(), picture.read()), "nothing of the render has changed"
    for thing in (again, picture, scene):
        thing.release()


def test_what_cannot_be_had_is_told(gpu: Renderer, more: None) -> None:
    said: list[Any] = []
    scene = gpu.load(arrays_of("plain"))
    picture = gpu.picture(scene, RenderSettings(16, 16))
    for compiler, shown, why in ((None, picture, NO_KERNEL), (Elsewhere(), None, NO_PICTURE)):
        savings = KernelSavings(WorkerContext(gpu, said.append, None, compiler), 1)  # type: ignore[arg-type]
        savings.ask()
        savings.step(shown)
        assert said.pop() == KernelMeasured(1, why) and not savings.due
    picture.release()
    scene.release()


@pytest.fixture
def no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, str]]:
    variables = {"MESA_SHADER_CACHE_DISABLE": "true", "MESA_SHADER_CACHE_DIR": str(tmp_path)}
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    yield variables


def test_nobody_waits_for_it(gpu: Renderer, no_cache: dict[str, str]) -> None:
    """While another picture grows there is no answer; and none but why, where the renderer is lost."""

    async def test(supervisor: Supervisor) -> None:
        arrays, ears, other = arrays_of("plain"), Ears(), Ears()
        task, busy = supervisor.open(ears, "render"), supervisor.open(other)
        await supervisor.send_scene(Update(task, 1, arrays, settings(24), StopRule(2)))
        await ears.next(Done)
        await supervisor.send_scene(Update(busy, 1, arrays, settings(24), StopRule()))
        await other.next(object)
        supervisor.send(MeasureKernel(task))
        await asyncio.sleep(0.4)
        assert ears.messages.empty()
        supervisor.drop(busy)
        assert await ears.next(KernelMeasured) == KernelMeasured(task, NO_KERNEL)
        busy = supervisor.open(other)
        await supervisor.send_scene(Update(busy, 1, arrays, settings(24), StopRule()))
        await other.next(object)
        supervisor.send(MeasureKernel(task))
        assert supervisor.process_id is not None
        os.kill(supervisor.process_id, signal.SIGKILL)
        assert "lost" in (await ears.next(KernelMeasured)).detail
        supervisor.drop(busy)
        supervisor.send(MeasureKernel(task))  # brought back
        assert (await ears.next(KernelMeasured)).detail == NO_KERNEL

    with_supervisor(test, patience_s=60.0)  # a starved renderer is not to be replaced a second time


def test_a_status_says_why_it_is_not_known(tmp_path: Path, no_cache: dict[str, str]) -> None:
    server = Server(tmp_path, **no_cache)
    try:
        answer = server.http.post("/v1/renders", json={"scene": SCENE, "settings": SMALL})
        assert "kernel" not in answer.json()
        address = f"/v1/{answer.headers['location']}"
        kernel = server.http.get(address, params={"wait": PATIENCE_S, "kernel": "true"}).json()["kernel"]
        assert all(kernel[name] is None for name in FIGURES) and "?saving=true" in kernel["saving_unknown"]
        for query in ({"saving": "true", "wait": PATIENCE_S}, {"kernel": "true"}):
            kernel = server.http.get(address, params=query).json()["kernel"]
            assert kernel["saving"] is None and kernel["saving_unknown"] == NO_KERNEL
        assert server.http.get(address, params={"saving": "perhaps"}).status_code == 422
        parameters = server.http.get("/openapi.json").json()["paths"]["/v1/renders/{id}"]["get"]["parameters"]
        assert {"id", "wait", "kernel", "saving"} == {parameter["name"] for parameter in parameters}
    finally:
        server.stop()


@pytest.mark.skipif(not LONG, reason="compiles the kernel with everything on; SUNBOX_EXTREMES=1 does")
def test_the_real_thing(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Over REST, and then at once for the command line, which finds that kernel in the driver's cache."""
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path / "cache"))
    server = Server(tmp_path)
    try:
        answer = server.http.post("/v1/renders", json={"scene": SCENE, "settings": SMALL})
        address = f"/v1/{answer.headers['location']}"
        query = {"saving": "true", "wait": 500}
        kernel = server.http.get(address, params=query, timeout=520).json()["kernel"]
        assert kernel["saving_unknown"] is None and 0.3 < kernel["saving"] < 1 and kernel["full_compile_ms"] > 1000
        assert server.http.get(address, params={"kernel": "true"}).json()["kernel"] == kernel
    finally:
        server.stop()
    scene, stats = tmp_path / "scene.json", tmp_path / "stats.json"
    scene.write_text(json.dumps(SCENE))
    assert main(["render", str(scene), "-o", str(tmp_path / "a.png"), "--spp", "2", "--stats", str(stats)]) == 0
    kernel = json.loads(stats.read_text())["kernel"]
    assert 0.3 < kernel["saving"] < 1 and kernel["full_compile_ms"] < 1000
