"""Kernels that are compiled before anybody waits for them, or not: SUNBOX_AHEAD, from its reading to the compiler."""

from __future__ import annotations

import asyncio
import os
from types import SimpleNamespace
from typing import Any, get_args

import pytest

from gpu import KernelKey, Renderer
from gpu.precompile.kernel_keys import common_keys
from service.config import Ahead, ConfigError, load_config
from service.ipc.messages import Done, StopRule, Update
from service.renderers.local.supervisor import Supervisor
from service.renderers.pool.devices import renderer_specs
from service.server import app
from service.worker.foreseen import ForeseenKernels
from service.worker.helpers.compile_client import CompileClient
from tests.serving import AHEAD
from tests.supervisors import SIZE, Ears, Rendering, arrays_of, compile_helpers, with_supervisor


@pytest.mark.parametrize("ahead", get_args(Ahead))
def test_each_renderer_has_the_server_s_setting(ahead: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_AHEAD", ahead)
    assert [seat.options.ahead for seat in renderer_specs(load_config(devices="llvmpipe:2"), 1000)] == [ahead] * 2


def test_another_word_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_AHEAD", "none")
    with pytest.raises(ConfigError, match=r"^SUNBOX_AHEAD: "):
        load_config()


@pytest.mark.parametrize(("ahead", "asked"), [("off", 0), ("some", 1)])
def test_a_server_without_it_asks_for_no_first_frame(ahead: str, asked: int, monkeypatch: pytest.MonkeyPatch) -> None:
    asks: list[Any] = []

    async def warm_up(*given: Any) -> bool:
        asks.append(given)
        return False

    monkeypatch.setattr(app, "warm_up", warm_up)
    state = SimpleNamespace(config=load_config(ahead=ahead), renderers=None, reader=None)
    server: Any = SimpleNamespace(state=SimpleNamespace(sunbox=state))
    asyncio.run(app._warm(server))
    assert len(asks) == asked


class Helper:
    """In the place of the process that compiles."""

    process_id = None

    def __init__(self) -> None:
        self.asked: list[KernelKey] = []

    def ask(self, key: KernelKey) -> None:
        self.asked.append(key)

    def pause(self, is_paused: bool) -> None: ...


def test_only_what_somebody_waits_for_is_compiled_without_it(
    gpu: Renderer, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    compiler, helper = CompileClient(gpu.info, None, foresees=False), Helper()
    for lane in compiler._all_lanes:
        lane.helper = helper  # type: ignore[assignment]
        lane.begins = 0.0
    compiler.prepare(common_keys(), "soon")
    compiler.prepare(common_keys(), "spare")
    assert not ForeseenKernels(compiler).prepare() and helper.asked == []
    assert compiler.queue(common_keys()[0], lambda milliseconds: None) and helper.asked == common_keys()[:1]


@pytest.mark.parametrize("ahead", ["off", "some"])
def test_a_renderer_begins_to_compile_ahead_or_never_does(
    ahead: str, rendering: Rendering, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both show a stream's picture. By then a helper compiles what may be needed next, or there is none."""

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays_of("plain"), SIZE, StopRule(4), interactive=True))
        await ears.next_of(task, Done)
        assert len(compile_helpers(supervisor.process_id, "soon")) == (ahead != "off")
        assert compile_helpers(supervisor.process_id, "spare") == []

    if ahead == os.environ[AHEAD]:  # as the session's renderers have it
        rendering(test)
    else:  # one that finds no kernel compiled
        monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
        with_supervisor(test, ahead=ahead)
