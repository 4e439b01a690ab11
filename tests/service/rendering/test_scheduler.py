"""Whose turn it is in the renderer's process, and how long a pass may be then."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from gpu import Renderer
from gpu.picture.tiles import LEAST_A_PASS
from service.pack import pack
from service.rendering.ipc.messages import StopRule, Update
from service.rendering.worker.context import WorkerContext
from service.rendering.worker.helpers.denoise_client import DenoiseClient
from service.rendering.worker.scheduler import FIRST_FRAME_LEAD_S, Scheduler
from service.rendering.worker.task import Task
from service.scene import parse_scene
from tests.documents import Shelf
from tests.serving import SCENE


@dataclass(eq=False)
class Turn:
    ready: bool = True
    unseen: bool = False
    used_s: float = 0.0
    client: str = ""

    def __post_init__(self) -> None:
        self.client = self.client or str(id(self))


def turns(tasks: list[Turn], count: int, slice_s: float = 0.02) -> list[int]:
    """How often each had its turn."""
    scheduler, had = Scheduler(), [0] * len(tasks)
    for _ in range(count):
        task = scheduler.choose(tasks)
        assert task is not None
        scheduler.charge(task, slice_s)
        had[tasks.index(task)] += 1
    return had


def test_everyone_gets_the_same_time() -> None:
    assert turns([Turn(), Turn(), Turn()], 300) == [100, 100, 100]
    assert turns([Turn(), Turn(ready=False)], 10) == [10, 0]
    assert Scheduler().choose([Turn(ready=False)]) is None


def test_sharers_are_those_who_are_ready() -> None:
    scheduler, mine, other = Scheduler(), [Turn(client="mine") for _ in range(3)], [Turn(client="other")]
    assert scheduler.sharers("mine") == 1
    scheduler.choose(mine + other)
    assert scheduler.sharers("mine") == 6  # a half, in three
    assert scheduler.sharers("other") == 2
    other[0].ready = False
    scheduler.choose(mine[:1] + other)
    assert scheduler.sharers("mine") == 1


def test_a_stream_among_many_takes_passes_of_one_sample(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the next picture of each comes soon; nobody waits for the next pass of a render."""
    monkeypatch.setattr("service.rendering.worker.task.SLICE_S", 0.0)  # a tile a turn
    context = WorkerContext(gpu, lambda _: None, DenoiseClient(), sharers=lambda client: 10**6)
    arrays = pack(parse_scene(SCENE), Shelf()).arrays
    passes = {}
    for interactive in (True, False):
        task = Task(context, 1)
        task.update(Update(1, 1, arrays, {"width": 32, "height": 32}, StopRule(24), interactive=interactive))
        passes[interactive] = {0}
        while task.ready:
            task.turn()
            passes[interactive].add(task._residency.full.under_way[0])
        task.release()
    assert passes[True] == {0, 1} and max(passes[False]) >= LEAST_A_PASS


def test_who_was_idle_saves_nothing_up() -> None:
    scheduler, busy, late_comer = Scheduler(), Turn(), Turn(ready=False)
    for _ in range(100):
        assert scheduler.choose([busy, late_comer]) is busy
        scheduler.charge(busy, 1.0)
    late_comer.ready = True
    had = 0
    for _ in range(20):
        task = scheduler.choose([busy, late_comer])
        assert task is not None
        scheduler.charge(task, 1.0)
        had += task is late_comer
    assert 9 <= had <= 11


def test_a_first_frame_goes_first_but_starves_nobody() -> None:
    newest, other = Turn(unseen=True), Turn()
    scheduler = Scheduler()
    assert scheduler.choose([newest, other]) is newest
    scheduler.charge(newest, FIRST_FRAME_LEAD_S / 2)
    assert scheduler.choose([newest, other]) is newest
    had = turns([Turn(unseen=True), Turn()], 200)  # as when an edit follows an edit
    assert had[1] > 80
