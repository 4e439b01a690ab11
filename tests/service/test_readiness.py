"""What readiness makes of a renderer that answers well, wrongly, or not at all; the renderer is a stand-in."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
import pytest

from service.config import Config
from service.formats import Assets
from service.ipc.messages import Failed, Foresee, Frame, Progress, ToRenderer, Update, Want
from service.problems import Unavailable
from service.renderers.protocol import Listener
from service.renderers.statistics import Kind, Statistics
from service.server import readiness
from service.server.http.downloads import Downloads
from service.server.readiness import Readiness, foresee, warm_up
from service.server.requests.request_reader import RequestReader
from service.system.memory import MemoryBudget

READER = RequestReader(Config(_env_file=None), cast(Assets, None))  # type: ignore[call-arg]


class StandIn:
    """Two renderers of one device, which answers a wish for a frame with `answer(listener, task)`."""

    process_id = 1
    members = ("one", "another")

    def __init__(self, answer: Callable[[Listener, int], None], software: bool = False) -> None:
        self.statistics, self.info = Statistics(), {"renderer": "stand-in", "software": software}
        self.frames = self.foreseen = 0
        self.open_tasks: dict[int, Listener] = {}
        self._answer = answer

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        return self.info

    def open(self, listener: Listener, kind: Kind = "stream", client: str = "") -> int:
        task = 7 + len(self.open_tasks)
        self.open_tasks[task] = listener
        return task

    def drop(self, task: int) -> None:
        del self.open_tasks[task]

    async def send_scene(self, update: Update) -> None:
        assert update.stop is not None and update.stop.max_samples == 1

    def send(self, message: ToRenderer) -> None:
        if isinstance(message, Foresee):
            self.foreseen += 1
            return
        assert isinstance(message, Want)
        self.frames += 1
        self._answer(self.open_tasks[message.task], message.task)

    def start(self) -> None: ...
    async def close(self) -> None: ...
    async def able(self, timeout_s: float) -> None: ...


def grey(value: float, size: int = 8) -> Callable[[Listener, int], None]:
    pixels = np.full((size, size, 4), value, np.float32)
    return lambda listener, task: listener.heard(Frame(task, 1, 1, pixels, Progress(1), 1.0, True))


def fails(listener: Listener, task: int) -> None:
    listener.heard(Failed(task, 1, "out of memory", None))


def is_lost(listener: Listener, task: int) -> None:
    listener.lost("it was killed")


def is_silent(listener: Listener, task: int) -> None: ...


def checked(
    renderers: StandIn, times: int = 1, require_gpu: bool = False, downloads: Downloads | None = None
) -> None:
    async def run() -> None:
        tested = Readiness(renderers, READER, require_gpu, downloads)
        for _ in range(times):
            await tested.check()

    asyncio.run(run())


def test_an_answer_is_valid_for_a_while() -> None:
    renderers = StandIn(grey(0.5))
    checked(renderers, times=3)
    assert renderers.frames == 1 and not renderers.open_tasks


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (grey(0.0), "black pictures"),
        (fails, "out of memory"),
        (is_lost, "it was killed"),
        (is_silent, "has not rendered anything for 0.1 s"),
    ],
)
def test_a_bad_renderer_is_not_ready(
    answer: Callable[[Listener, int], None], reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(readiness, "PATIENCE_S", 0.1)
    renderers = StandIn(answer)
    with pytest.raises(Unavailable, match=reason):
        checked(renderers)
    assert not renderers.open_tasks, "nothing stays behind"


def test_a_server_that_can_answer_no_picture_is_not_ready(tmp_path: Path) -> None:
    """One whose disk is full can, as long as there is memory."""

    class FullDisk(Downloads):
        def _new_file(self) -> BinaryIO:
            return open("/dev/full", "wb")

    checked(StandIn(grey(0.5)), downloads=FullDisk(tmp_path))
    checked(StandIn(grey(0.5)), downloads=Downloads(tmp_path, MemoryBudget(0)))
    with pytest.raises(Unavailable, match="disk is full"):
        checked(StandIn(grey(0.5)), downloads=FullDisk(tmp_path, MemoryBudget(0)))


def test_a_software_renderer_is_not_ready_where_a_gpu_is_required() -> None:
    with pytest.raises(Unavailable, match="SUNBOX_REQUIRE_GPU"):
        checked(StandIn(grey(0.5), software=True), require_gpu=True)


@pytest.mark.parametrize(("answer", "logged"), [(grey(0.5, 64), "warmed up"), (fails, "did not warm up")])
def test_warming_up_leaves_no_task_and_raises_nothing(
    answer: Callable[[Listener, int], None], logged: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, logger=warm_up.__module__)
    renderers = StandIn(answer)
    assert asyncio.run(warm_up(renderers, READER, readiness.SCENE)) == (logged == "warmed up")
    assert renderers.frames == len(renderers.members) and not renderers.open_tasks
    assert [record.message for record in caplog.records if record.message.startswith(logged)]


def test_scenes_that_may_follow_are_foreseen() -> None:
    renderers = StandIn(grey(0.5, 64))
    asyncio.run(foresee(renderers, READER, readiness.SCENE, [readiness.SCENE] * 2, [readiness.SCENE]))
    assert renderers.foreseen == 3 and not renderers.open_tasks
