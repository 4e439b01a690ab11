"""Several renderers behind one door: where tasks go, and who goes on with those of a renderer that is lost."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from service.ipc.messages import (
    Checkpoint,
    Done,
    Failed,
    Progress,
    Read,
    Restore,
    SavedPicture,
    StopRule,
    Update,
    View,
    Want,
)
from service.ipc.task_control import ApplyNow, Pause, Resume
from service.problems import Unavailable
from service.renderers.local.process import NoPlace
from service.renderers.pool.pool import RendererPool, RendererSpec
from service.renderers.protocol import Place
from tests.service.rendering.fakes import Fake
from tests.supervisors import LINEAR, Ears, arrays_of, settings


class Fakes:
    """A pool of fakes. `drivers` may be changed: a process that is begun then has that one; "" is unable to begin."""

    def __init__(self, *drivers: str) -> None:
        self.drivers, self.processes = list(drivers), dict[int, Fake]()
        self.pool = RendererPool(
            [RendererSpec(Place(str(i), str(i)), start=partial(self._start, i)) for i in range(len(drivers))]
        )

    def _start(self, number: int, *given: Any) -> Any:
        self.processes[number] = Fake(self.drivers[number], *given)
        return self.processes[number]

    def home(self, task: int) -> str:
        return self.pool.homes[task].place.id

    def homes(self, *tasks: int) -> str:
        return "".join(self.home(task) for task in tasks)

    async def until(self, *states: str) -> None:
        async with asyncio.timeout(10):
            while [member.state for member in self.pool.members] != list(states):
                await asyncio.sleep(0.001)


def with_fakes(test: Callable[[Fakes], Awaitable[None]], *drivers: str) -> None:
    async def run() -> None:
        fakes = Fakes(*drivers)
        fakes.pool.start()
        try:
            await test(fakes)
        finally:
            await fakes.pool.close()

    asyncio.run(run())


def test_streams_go_where_the_fewest_are_attended() -> None:
    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        await fakes.until("ready", "ready", "ready")
        streams = [pool.open(Ears()) for _ in range(6)]
        assert fakes.homes(*streams) == "012012" and len(set(streams)) == 6
        pool.send(Pause(streams[1], away=True))
        assert fakes.home(pool.open(Ears())) == "1"
        pool.send(Resume(streams[1]))
        pool.send(Pause(streams[2]))  # its client looks at it all the same
        pool.drop(streams[3])
        assert fakes.home(pool.open(Ears())) == "0"
        assert fakes.processes[1].heard(Pause) == [streams[1]]

    with_fakes(test, "a", "a", "a")


def test_among_equals_a_stream_goes_where_its_client_is() -> None:
    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        await fakes.until("ready", "ready")
        assert fakes.homes(pool.open(Ears(), client="ann"), pool.open(Ears(), client="bob")) == "01"
        assert fakes.homes(pool.open(Ears(), client="bob"), pool.open(Ears(), client="bob")) == "10"

    with_fakes(test, "a", "a")


def test_renders_go_where_the_fewest_renders_are() -> None:
    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        await fakes.until("ready", "ready")
        streams = [pool.open(Ears()) for _ in range(3)]
        assert fakes.homes(*streams) == "010"
        renders = [pool.open(Ears(), "render", "ann") for _ in range(3)]
        assert fakes.homes(*renders) == "101"
        done = Done(renders[0], 1, "max_samples", Progress(4), [], SavedPicture(4, (0, 0, 0), []))
        fakes.processes[1].say(done)  # what has ended takes no time any more
        assert fakes.home(pool.open(Ears(), "render")) == "1"
        assert fakes.homes(pool.open(Ears(), "bsdf"), pool.open(Ears(), "server")) == "01"

    with_fakes(test, "a", "a")


def test_a_loss_keeps_nobody_from_the_others() -> None:
    async def test(fakes: Fakes) -> None:
        pool, ears = fakes.pool, Ears()
        await fakes.until("ready", "ready")
        mine, other, question = pool.open(ears), pool.open(Ears()), pool.open(Ears(), "bsdf")
        assert fakes.homes(mine, other, question) == "010"
        pool.drop(other)
        fakes.processes[0].lose()
        await fakes.until("lost", "ready")
        while fakes.home(question) != "1":  # it does not wait for another process
            await asyncio.sleep(0)
        assert pool.members[0].state == "lost"
        await pool.able(0)
        assert (await pool.ready(0))["renderer"] == "b" == pool.info["renderer"] and not pool.hopeless
        assert fakes.homes(*(pool.open(Ears()) for _ in range(3))) == "111"
        await fakes.until("ready", "ready")
        assert fakes.home(mine) == "0" and await ears.next(str) == "again"
        assert pool.info["renderer"] == "a" and fakes.home(pool.open(Ears())) == "0"
        crashed = [dict(member.statistics.restarts) for member in pool.members]
        assert crashed == [{"crashed": 1}, {}]

    with_fakes(test, "a", "b")


def test_tasks_of_a_hopeless_one_go_on_elsewhere(impatient: None) -> None:
    async def test(fakes: Fakes) -> None:
        pool, ears = fakes.pool, [Ears() for _ in range(3)]
        await fakes.until("ready", "ready", "ready")
        picture = SavedPicture(4, (0, 0, 0), [np.arange(8, dtype=np.uint8)], driver="gpu")
        tasks = [pool.open(each, "render") for each in ears]
        for task in tasks:
            await pool.send_scene(Update(task, 1, arrays_of("plain"), settings(8), StopRule(9)))
        pool.send(Read(tasks[2], 1, LINEAR))
        fakes.processes[2].say(Checkpoint(tasks[2], 1, Progress(4), picture))
        fakes.drivers[2] = ""
        fakes.processes[2].lose()
        await fakes.until("ready", "ready", "lost")
        while fakes.home(tasks[2]) == "2":
            await asyncio.sleep(0.001)
        assert fakes.homes(*tasks) == "011"  # the one with the driver that can go on with the picture
        while len(fakes.processes[1].heard(Read)) == 0:
            await asyncio.sleep(0.001)
        told = [message for message in fakes.processes[1].told if message.task == tasks[2]]
        assert [type(message) for message in told] == [Update, Restore, Read]
        assert told[1].saved.samples == 4 and told[1].saved.driver == "gpu" and told[0].client == str(tasks[2])
        assert pool.members[2].state == "lost" and not pool.hopeless and ears[2].messages.qsize() == 1
        assert {fakes.home(pool.open(Ears(), "render")) for _ in range(4)} == {"0", "1"}
        pool.drop(tasks[2])
        assert fakes.processes[1].told[-1].task == tasks[2] and tasks[2] not in pool.homes
        fakes.drivers[2] = "other"
        await fakes.until("ready", "ready", "ready")
        assert fakes.home(pool.open(Ears(), "render")) == "2" and pool.members[2].driver == "other"

    with_fakes(test, "other", "gpu", "gpu")


def test_tasks_of_one_that_waits_for_a_place_go_to_one_that_is_ready() -> None:
    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        await fakes.until("ready", "ready")
        begun, saved = pool.open(Ears(), "render"), pool.open(Ears(), "render")
        pool.move(saved, pool.supervisors[0])
        await pool.send_scene(Update(saved, 1, arrays_of("plain"), settings(8)))
        fakes.processes[0].say(Checkpoint(saved, 1, Progress(4), SavedPicture(4, (0, 0, 0), [], "a")))
        fakes.processes[1].lose()
        await fakes.until("ready", "lost")
        fakes.processes[0].say(NoPlace("There is no room."))
        assert fakes.homes(begun, saved) == "00"  # they would wait there, too
        await fakes.until("ready", "ready")
        assert fakes.homes(begun, saved) == "10"  # from its checkpoint only one with its driver can go on

    with_fakes(test, "a", "b")


def test_without_any_renderer_tasks_are_lost_until_one_is_back(impatient: None) -> None:
    async def test(fakes: Fakes) -> None:
        pool, ears = fakes.pool, Ears()
        await fakes.until("ready", "ready")
        task = pool.open(ears)
        fakes.drivers[:] = ["", ""]
        for process in list(fakes.processes.values()):
            process.lose()
        while await ears.next(str) != "There is no such device.":
            pass
        assert pool.hopeless and pool.info is None and not pool.homes
        with pytest.raises(Unavailable, match="no such device"):
            pool.open(Ears())
        with pytest.raises(Unavailable, match=r"^There is no such device\.$"):
            await pool.ready(5)
        with pytest.raises(Unavailable):
            await pool.able(0)
        pool.send(Want(task, 1, View()))  # of a task that is gone
        pool.drop(task)
        fakes.drivers[1] = "a"
        await fakes.until("lost", "ready")
        assert fakes.home(pool.open(Ears())) == "1" and not pool.hopeless

    with_fakes(test, "a", "a")


def test_a_scene_that_meets_a_move_arrives_once(impatient: None) -> None:
    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        await fakes.until("ready", "ready")
        task = pool.open(Ears())
        sending = asyncio.create_task(pool.send_scene(Update(task, 1, arrays_of("plain"), settings(8))))
        await asyncio.sleep(0)  # it is being encoded now
        pool.move(task, pool.supervisors[1])
        await sending
        assert fakes.processes[0].heard(Update) == [] and fakes.processes[1].heard(Update) == [task]

    with_fakes(test, "a", "a")


def test_one_renderer_can_help_with_the_task_of_another() -> None:
    """It is told the same scenes, in the same order, and neither frames nor readings; its answers go nowhere."""

    async def test(fakes: Fakes) -> None:
        pool, ears = fakes.pool, Ears()
        await fakes.until("ready", "ready")
        home, helper = pool.supervisors
        task = pool.open(ears)  # which is not divided without being asked for
        await pool.send_scene(Update(task, 1, arrays_of("plain"), settings(8)))
        pool.send(Update(task, 2, stop=StopRule(4), base=1))
        pool.send(Update(task, 3, settings=settings(9), base=2))
        pool.send(Want(task, 1, View()))
        pool.send(Read(task, 1, LINEAR))
        for message in home.tasks[task].record.scenes():
            if isinstance(message, tuple):
                helper.relay_encoded(message)
            else:
                helper.relay(message)
        told = fakes.processes[1].told
        assert [type(message) for message in told] == [Update, Update, ApplyNow, Update, Update]
        assert [message.generation for message in told if isinstance(message, Update)] == [1, 2, 1, 3]
        assert told[-1].settings == settings(9) and told[-1].stop == StopRule(4)
        fakes.processes[1].say(Failed(task, 3, "of the helper"))
        assert ears.messages.empty() and not helper.tasks

    with_fakes(test, "a", "a")


def test_a_stored_picture_goes_to_a_renderer_of_its_driver() -> None:
    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        await fakes.until("ready", "ready")
        for driver, reason, home in (("b", None, "1"), ("c", None, "0"), ("b", "max_samples", "0"), ("", None, "0")):
            task = pool.open(Ears(), "render")
            saved = SavedPicture(4, (0, 0, 0), [], driver=driver)
            await pool.send_scene(
                Update(task, 1, arrays_of("plain"), settings(8)), Restore(task, 1, saved, reason, Progress(4))
            )
            process = fakes.processes[int(home)]
            assert fakes.home(task) == home and process.heard(Restore)[-1] == process.heard(Update)[-1] == task
            pool.drop(task)

    with_fakes(test, "a", "b")


def test_a_stored_picture_waits_until_the_drivers_are_known() -> None:
    """As it must at the start of a server, which takes up its renders at once."""

    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        for home, driver in ((2, "c"), (1, "b"), (0, "a")):
            task = pool.open(Ears(), "render")
            assert fakes.home(task) == "0"
            saved = SavedPicture(4, (0, 0, 0), [], driver)
            update = Update(task, 1, arrays_of("plain"), settings(8))
            await pool.send_scene(update, Restore(task, 1, saved, None, Progress(4)))
            assert fakes.home(task) == str(home)
            pool.drop(task)

    with_fakes(test, "a", "b", "c")


def test_who_waits_gets_the_first_that_is_ready_and_nothing_at_the_end() -> None:
    async def test(fakes: Fakes) -> None:
        pool = fakes.pool
        assert [member.state for member in pool.members] == ["starting", "starting"]
        with pytest.raises(Unavailable, match="starting"):
            await pool.ready(0)
        assert (await pool.ready(5))["renderer"] == "a"
        pool.drain()
        assert [member.state for member in pool.members] == ["draining", "draining"]
        for refused in (pool.ready(5), pool.able(5)):
            with pytest.raises(Unavailable, match=r"^The server is shutting down\.$"):
                await refused
        with pytest.raises(Unavailable, match="shutting down"):
            pool.open(Ears())

    with_fakes(test, "a", "a")
    with pytest.raises(Unavailable, match="not been started"):
        asyncio.run(Fakes("a").pool.ready(0))
