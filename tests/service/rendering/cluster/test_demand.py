"""How many renderers a pool asks its cluster for."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any

import pytest

from service.renderers.local.process import Start
from service.renderers.ray.control import Joined
from service.renderers.ray.pool import IDLE_S, LONG_S, ClusterPool
from service.renderers.ray.renderers import room
from tests.service.rendering.fakes import Fake
from tests.supervisors import Ears


class Counted:
    """A cluster with room for some of eight renderers, which notes those that rest."""

    device = "1 GPU"

    def __init__(self, room: int) -> None:
        self.options = {"patience_s": 10.0}
        self.joined = Joined("head:6379", False, 8, {"GPU": 1.0}, room)
        self.resting = set[int]()
        self.release_node, self.wake = self.resting.add, self.resting.remove

    def starter(self, number: int) -> Start:
        return partial(Fake, "driver")  # type: ignore[return-value]

    async def close(self) -> None: ...


@pytest.mark.parametrize(("there", "awake"), [(8, 8), (3, 3), (0, 1)])
def test_nodes_are_not_added_for_a_start(there: int, awake: int) -> None:
    cluster: Any = Counted(there)
    ClusterPool(cluster)
    assert cluster.resting == set(range(awake, 8))


def test_renderers_come_with_the_work_and_go_after_it() -> None:
    async def test() -> None:
        cluster: Any = Counted(1)
        pool = ClusterPool(cluster)
        pool.start()
        await pool.ready(5)
        began = pool._idle_since
        first = [pool.open(Ears(), "render") for _ in range(3)]
        pool.resize(began + 1)
        assert cluster.resting == set(range(3, 8))  # a renderer for each
        pool.resize(began + 1 + LONG_S)
        assert cluster.resting == set()  # the work lasts, and they divide it
        for task in first:
            pool.drop(task)
        pool.resize(began + LONG_S + IDLE_S)
        assert cluster.resting == set()
        pool.resize(began + 1.01 + LONG_S + IDLE_S)  # a sum of floats may be less
        assert cluster.resting == set(range(1, 8))
        pool.resize(began + 2 * IDLE_S)
        assert len(cluster.resting) == 7  # one is always there
        await pool.close()

    asyncio.run(test())


def test_room_counts_whole_renderers() -> None:
    nodes = [{"GPU": 2.0, "CPU": 1.0}, {"GPU": 1.0, "CPU": 9.0}, {"CPU": 4.0}]
    assert room(nodes, {"GPU": 1.0, "CPU": 1.0}) == 2
    assert room(nodes, {"CPU": 4.0}) == 3
