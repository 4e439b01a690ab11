"""Supervises one renderer: starts its process, and takes messages for the tasks that it renders."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from service.ipc import channel
from service.ipc.messages import EvaluateBsdf, Read, Restore, SavedPicture, ToRenderer, Update
from service.ipc.task_control import Drop
from service.problems import Unavailable
from service.renderers.local.keeper import CLOSING
from service.renderers.local.process import Options, Process, Start
from service.renderers.local.tasks import Events, Tasks
from service.renderers.protocol import Listener, Member, Place
from service.renderers.replay_log import ReplayLog
from service.renderers.statistics import Kind, Statistics
from service.renderers.task import Task
from service.system.executors import sending


class Supervisor:
    """Fulfils `Renderers` with one process."""

    def __init__(
        self,
        options: Options | None = None,
        start: Start | None = None,
        place: Place | None = None,
        numbers: Iterator[int] | None = None,
        events: Events | None = None,
    ) -> None:
        """`start` starts the process, by default one of this machine; the tasks get their `numbers` from there."""
        self.statistics = Statistics()
        self.place = place or Place()
        options = replace(options or Options(), name=self.place.id)
        self._numbers = numbers or itertools.count(1)
        self._tasks = Tasks(
            self.place.id, start or partial(Process, options), options.patience_s, self.statistics, events
        )
        self._keeper = self._tasks.keeper

    def start(self) -> None:
        """Starts the renderer's process, if that was not done before; it is ready some tenths of a second later."""
        self._keeper.start()

    def drain(self) -> None:
        """Takes no new tasks from now on; those that are there go on."""
        self._keeper.drain()

    async def close(self) -> None:
        await self._keeper.stop()
        self._tasks.fail_all(CLOSING)
        await self._keeper.end()

    @property
    def process_id(self) -> int | None:
        process = self._keeper.process
        return None if process is None else process.id

    @property
    def info(self) -> dict[str, Any] | None:
        """The device that renders; None while nothing can."""
        return self._keeper.info

    @property
    def hopeless(self) -> bool:
        return self._keeper.restarts.hopeless

    @property
    def detail(self) -> str:
        """Why there is no renderer, where there is none."""
        return self._keeper.detail

    @property
    def waiting(self) -> str:
        """What the renderer waits for, where there is no place for it; it takes tasks, which wait with it."""
        return self._keeper.waiting

    @property
    def driver(self) -> str | None:
        """The driver and its version, of the process that was ready last; None: there was none."""
        return self._keeper.driver

    @property
    def members(self) -> list[Member]:
        known = self.info or {}  # a node of a cluster says where it is
        place = replace(self.place, host=known["host"]) if "host" in known else self.place
        vendor = known.get("vendor")
        return [Member(place, self._keeper.state, vendor, self.driver, self.process_id, self.statistics)]

    @property
    def tasks(self) -> Mapping[int, Task]:
        """Those that were opened here, or taken over, by their numbers."""
        return self._tasks.by_number

    @property
    def takes_tasks(self) -> bool:
        """Whether it takes tasks; they wait while its process starts or is replaced."""
        return self._keeper.takes_tasks

    @property
    def replaces(self) -> bool:
        """Whether something rendered here, and does or will again soon."""
        return self.driver is not None and self.takes_tasks

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        """The device that renders, as soon as one does. Raises Unavailable with the reason why none does."""
        return await self._keeper.ready(timeout_s)

    async def able(self, timeout_s: float) -> None:
        """Returns when something renders, or did and is being replaced: work can be taken, which then waits a little.

        Raises Unavailable.
        """
        if not self.replaces:
            await self.ready(timeout_s)

    def open(self, listener: Listener, kind: Kind = "stream", client: str = "") -> int:
        """The number of a new task, whose messages `listener` hears until `drop`. Raises Unavailable.

        Tasks of one `client` share its part of the GPU's time; without a name each has its own.
        """
        if not self.takes_tasks:
            raise Unavailable(self.detail)
        number = next(self._numbers)
        self._tasks.by_number[number] = Task(listener, kind, client or str(number), ReplayLog(number))
        return number

    def take_over(self, number: int, task: Task) -> None:
        """Go on with a task that was opened elsewhere, as with one's own after a loss of the process."""
        self._tasks.add(number, task)

    def give_up(self, number: int) -> Task:
        """A task, for another supervisor to take over; this one's renderer forgets it."""
        task = self.tasks[number]
        self._tasks.remove(number)
        self._keeper.send(Drop(number))
        return task

    def divide(self, task: int, most: int | None) -> None:
        """There is one renderer."""

    def tracing(self, task: int | None) -> int:
        found = None if task is None else self.tasks.get(task)
        return int(found is not None and found.active)

    def drop(self, task: int) -> None:
        if self._tasks.forget(task) is not None:
            self._keeper.send(Drop(task))

    def send(self, message: ToRenderer) -> None:
        """Hands the message on; nothing happens when its task was lost or dropped."""
        task = self.tasks.get(message.task)
        if task is None:
            return
        if isinstance(message, EvaluateBsdf):
            message = replace(message, client=task.client)
        task.record.told(message)
        if task.resident:
            self._keeper.send(message)
        elif isinstance(message, Read):
            self._tasks.bring_back_soon(message.task, task)

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        """Like `send`, for a whole scene or a large edit: copying that to shared memory is not the event loop's work.

        `restore`: its picture as the server has it.
        """
        await self.sent_scene(update, restore)

    async def sent_scene(self, update: Update, restore: Restore | None = None) -> bool:
        """Send it; False where the task is not here any more, and nothing was done."""
        task = self.tasks.get(update.task)
        if task is None:
            return False
        update = replace(update, client=task.client)
        encoded = await sending(partial(channel.encode, update))
        if update.task not in self.tasks:
            channel.discard(encoded)
            return False
        if update.scene is None:
            task.record.told(update)
            if task.resident:
                self._keeper.send_encoded(encoded)
            else:
                channel.discard(encoded)
            return True
        task.record.scene_told(update, encoded)
        if restore is None:
            self._keeper.send_encoded(encoded)
            return True
        task.record.restored(restore)
        task.resident = False
        channel.discard(encoded)
        await self._tasks.bring_back(update.task, task)
        return True

    def stored(self, task: int, picture: SavedPicture, read: Callable[[], Restore]) -> None:
        """A task's picture need not stay in memory: `read`, which is not for an event loop, gives it."""
        if (found := self.tasks.get(task)) is not None:
            found.record.stored(picture, read)

    def relay(self, message: ToRenderer) -> None:
        """Send the process a message for a task that is another supervisor's; lost where there is no process."""
        self._keeper.send(message)

    def relay_encoded(self, encoded: channel.Encoded) -> None:
        """The same for what `channel.encode` gave, whose descriptors are the process's from now on."""
        self._keeper.send_encoded(encoded)
