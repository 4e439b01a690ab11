"""Everybody's part of the GPU, in measured seconds of it: clients, not tasks; streams and renders alike."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from gpu import Renderer, SceneEdit
from service.document import parse_scene
from service.ipc.messages import FromRenderer, StopRule, Update
from service.ipc.task_control import Pause
from service.pack import pack
from service.renderers.local.supervisor import Supervisor
from service.renderers.statistics import Kind
from tests.documents import Shelf
from tests.serving import SCENE
from tests.supervisors import Rendering

SIDE = {"width": 64, "height": 64}


class Deaf:
    def heard(self, message: FromRenderer) -> None: ...

    def again(self) -> None: ...

    def lost(self, detail: str) -> None: ...


def jain(shares: list[float]) -> float:
    """1 where all are equal, 1/n where one has everything. Jain, Chiu and Hawe 1984, eq. 2."""
    return sum(shares) ** 2 / (len(shares) * sum(share**2 for share in shares))


@pytest.fixture(scope="module")
def arrays(gpu: Renderer) -> Any:
    return pack(parse_scene(SCENE), Shelf()).arrays


def sharing(
    rendering: Rendering,
    arrays: Any,
    clients: list[tuple[Kind, str]],
    seconds: float,
    act: Callable[..., None] | None = None,
    enough: Callable[[list[float]], bool] = lambda shares: True,
) -> list[float]:
    """What each task used of so many seconds of GPU time, or of up to four times as many until it is `enough`.

    A loaded machine makes single turns long, and then it takes more of them to even out. `act` is called all the
    while with supervisor, tasks and count.
    """

    shares: list[float] = []

    async def test(supervisor: Supervisor) -> None:
        nonlocal shares
        used = supervisor.statistics.gpu_s_of
        for interactive in (True, False):  # kernels are compiled before anybody pays for them
            first = supervisor.open(Deaf(), "server")
            await supervisor.send_scene(Update(first, 1, arrays, SIDE, StopRule(1), interactive=interactive))
            while not used[first]:
                await asyncio.sleep(0.02)
            supervisor.drop(first)
        tasks = [supervisor.open(Deaf(), kind, client) for kind, client in clients]
        for task, (kind, _) in zip(tasks, clients, strict=True):
            await supervisor.send_scene(Update(task, 1, arrays, SIDE, StopRule(), interactive=kind == "stream"))
        while not all(used[task] for task in tasks):  # everybody is loaded
            await asyncio.sleep(0.02)
        count = 0
        shares = [0.0]
        while sum(shares) < seconds or not (enough(shares) or sum(shares) > 4 * seconds):
            await asyncio.sleep(0.005)
            if act is not None:
                act(supervisor, tasks, count := count + 1)
            shares = [used[task] for task in tasks]  # what they used to load included: who had more waits

    rendering(test)
    return shares


@pytest.mark.slow
def test_thirty_two_equal_clients(rendering: Rendering, arrays: Any) -> None:
    """Streams and renders: Jain's index, over about as many turns as it takes to tell."""
    clients: list[tuple[Kind, str]] = [("stream" if n % 2 else "render", f"client {n}") for n in range(32)]
    shares = sharing(rendering, arrays, clients, 7.0, enough=lambda shares: jain(shares) >= 0.95)
    assert jain(shares) >= 0.95, shares


@pytest.mark.slow
def test_all_that_one_key_renders_is_one_client(rendering: Rendering, arrays: Any) -> None:
    shares = sharing(rendering, arrays, [("render", "busy")] * 4 + [("stream", "busy")] * 2 + [("stream", "")], 2.5)
    assert 0.4 < shares[-1] / sum(shares) < 0.6, shares
    assert jain(shares[:-1]) > 0.8, shares


def test_a_flood_of_edits_takes_no_more_than_its_part(rendering: Rendering, arrays: Any) -> None:
    """Whole scenes, one after the other: to load them is work like any other."""

    def flood(supervisor: Supervisor, tasks: list[int], count: int) -> None:
        supervisor.send(
            Update(tasks[0], 1 + count, edit=SceneEdit(materials=arrays.materials), settings=SIDE | {"seed": count})
        )

    shares = sharing(rendering, arrays, [("stream", "hostile"), ("stream", "kind"), ("render", "other")], 3.0, flood)
    assert shares[0] / sum(shares) < 0.5, shares


def test_who_pauses_uses_nothing(rendering: Rendering, arrays: Any) -> None:
    def pause(supervisor: Supervisor, tasks: list[int], count: int) -> None:
        supervisor.send(Pause(tasks[0]))

    shares = sharing(rendering, arrays, [("stream", "hidden"), ("stream", "seen")], 3.0, pause)
    assert shares[0] < 0.4 * shares[1], shares  # it was loaded, and seen once
