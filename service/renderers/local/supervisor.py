"""Supervises one renderer: its tasks, whose messages go to their listeners, and a new process gets them when one is
lost."""

from __future__ import annotations

import itertools
import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

from service.ipc import channel
from service.ipc.leases import Lease, LeaseDone, LeaseFailed, LeaseRefuted
from service.ipc.messages import (
    Checkpoint,
    Discarded,
    Done,
    EvaluateBsdf,
    Evicted,
    Frame,
    Heard,
    Image,
    Loaded,
    Progress,
    Progressed,
    Read,
    Restore,
    SavedPicture,
    ToRenderer,
    Update,
    Usage,
)
from service.ipc.task_control import Drop
from service.problems import MISTAKE, Unavailable
from service.renderers.local.keeper import BY_OTHERS, CLOSING, Keeper
from service.renderers.local.process import Cause, Options, Process, RendererProcess, Start
from service.renderers.protocol import Events, Listener, Member, NoEvents, Place
from service.renderers.replay_log import ReplayLog, TaskRecord
from service.renderers.statistics import Kind, RendererLoad, Statistics
from service.system.background import reported
from service.system.executors import sending, tending

STRIKES = 3  # renderers that a task may bring down
FORGIVEN_S = 5.0  # of life with that task, after which an earlier loss was not its fault

log = logging.getLogger(__name__)


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
        self.tasks: dict[int, TaskRecord] = {}  # those that were opened here, or taken over, by their numbers
        self._events = events or NoEvents()
        self._keeper = Keeper(
            self.place.id, start or partial(Process, options), options.patience_s, self.statistics, self
        )

    def start(self) -> None:
        """Starts the renderer's process, if that was not done before; it is ready some tenths of a second later."""
        self._keeper.start()

    def drain(self) -> None:
        """Takes no new tasks from now on; those that are there go on."""
        self._keeper.drain()

    async def close(self) -> None:
        await self._keeper.stop()
        self._fail_all(CLOSING)
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
        """The reason why there is no place for the renderer, which waits for one; its tasks wait with it."""
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
    def takes_tasks(self) -> bool:
        """True if it takes tasks; they wait while its process starts or is replaced."""
        return self._keeper.takes_tasks

    @property
    def replaces(self) -> bool:
        """True if something rendered here, and does or will again soon."""
        return self.driver is not None and self.takes_tasks

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        """The device that renders, as soon as one does. Raises Unavailable with the reason why none does."""
        return await self._keeper.ready(timeout_s)

    async def able(self, timeout_s: float) -> None:
        """Returns when something renders, or did and is being replaced: work then waits. Raises Unavailable."""
        if not self.replaces:
            await self.ready(timeout_s)

    def open(self, listener: Listener, kind: Kind = "stream", client: str = "") -> int:
        """The number of a new task, whose messages `listener` hears until `drop`. Raises Unavailable.

        Tasks of one `client` share its part of the GPU's time; without a name each has its own.
        """
        if not self.takes_tasks:
            raise Unavailable(self.detail)
        number = next(self._numbers)
        self.tasks[number] = TaskRecord(listener, kind, client or str(number), ReplayLog(number))
        return number

    def take_over(self, number: int, task: TaskRecord) -> None:
        """Go on with a task that was opened elsewhere, as with one's own after a loss of the process."""
        self.tasks[number] = task
        if self._keeper.process is not None:
            self._begin_again(number, task)

    def give_up(self, number: int) -> TaskRecord:
        """A task, for another supervisor to take over; this one's renderer forgets it."""
        task = self.tasks[number]
        self._remove(number)
        self._keeper.send(Drop(number))
        return task

    def divide(self, task: int, most: int | None) -> None:
        """There is one renderer."""

    def tracing(self, task: int | None) -> int:
        found = None if task is None else self.tasks.get(task)
        return int(found is not None and found.active)

    def drop(self, task: int) -> None:
        if self._forget(task) is not None:
            self._keeper.send(Drop(task))

    def send(self, message: ToRenderer) -> None:
        """Hands the message on; nothing happens when its task was lost or dropped."""
        task = self.tasks.get(message.task)
        if task is None:
            return
        if isinstance(message, EvaluateBsdf):
            message = replace(message, client=task.client)
        task.record.note(message)
        if task.resident:
            self._keeper.send(message)
        elif isinstance(message, Read):
            self._bring_back_soon(message.task, task)

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
            task.record.note(update)
            if task.resident:
                self._keeper.send_encoded(encoded)
            else:
                channel.discard(encoded)
            return True
        task.record.note_scene(update, encoded)
        if restore is None:
            self._keeper.send_encoded(encoded)
            return True
        task.record.restored(restore)
        task.resident = False
        channel.discard(encoded)
        await self._bring_back(update.task, task)
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

    # What becomes of its tasks.

    def _remove(self, number: int) -> TaskRecord | None:
        """The task, which is not here from now on; None where it was not."""
        self.statistics.gpu_s_of.pop(number, None)
        return self.tasks.pop(number, None)

    def _forget(self, number: int) -> TaskRecord | None:
        """The task, of which nothing stays; None where it is not here."""
        if (task := self._remove(number)) is not None:
            task.record.close()
            self._events.ended(number)
        return task

    def _fail_all(self, detail: str) -> None:
        tasks = dict(self.tasks)
        for number in tasks:
            self._forget(number)
        for task in tasks.values():
            task.listener.lost(detail)

    def _bring_back_soon(self, number: int, task: TaskRecord) -> None:
        """Begin to bring back a picture; where that fails, what was under way begins again."""
        self._keeper.do(
            "return of a picture", self._bring_back(number, task), partial(self._lose_picture, number, task)
        )

    async def _bring_back(self, number: int, task: TaskRecord) -> None:
        """Send the process a picture that it does not have, to go on with it or to read it."""
        process, stored_picture = self._keeper.process, task.record.stored_picture
        try:
            encoded = await tending(
                lambda: channel.encode(stored_picture() if callable(stored_picture) else stored_picture)
            )
        except Exception as error:
            return self._lose_picture(number, task, error)
        if task.resident or process is None or process is not self._keeper.process or number not in self.tasks:
            return channel.discard(encoded)
        task.resident = True
        self._replay(number, task.record, encoded)

    def changed(self) -> None:
        self._events.changed()

    def began(self) -> None:
        for number, task in self.tasks.items():
            self._begin_again(number, task)

    def received(self, message: Heard) -> None:
        if isinstance(message, Usage):
            self._account(message)
        elif isinstance(message, Lease | LeaseDone | LeaseFailed | LeaseRefuted):
            self._events.leased(message)
        elif (task := self.tasks.get(message.task)) is not None:
            with reported("message of a renderer", lambda _: self._lose_task(message.task)):
                self._hear(message, task)

    def lost(self, process: RendererProcess, cause: Cause) -> None:
        self._blame(process, cause)
        self._events.lost()

    def given_up(self) -> None:
        self._fail_all(self._keeper.detail)

    def _begin_again(self, number: int, task: TaskRecord) -> None:
        """Send a process that does not know the task all that it needs."""
        task.resident = task.record.stored_picture is None
        if task.resident:
            self._replay(number, task.record)
            task.listener.again()
        elif task.record.saved is None or task.record.reads:
            self._bring_back_soon(number, task)

    def _replay(self, number: int, record: ReplayLog, picture: channel.Encoded | None = None) -> None:
        for message in record.again(picture):
            if isinstance(message, tuple):
                self._keeper.send_encoded(message)
            else:
                self._keeper.send(message)
        self._events.replayed(number)

    def _lose_picture(self, number: int, task: TaskRecord, error: Exception) -> None:
        """The server's copy of a picture cannot be read: what was under way begins again."""
        log.error("could not read a picture that was stored", {"task": number, "error": error})
        if task.resident or number not in self.tasks:
            return
        if task.record.saved is not None:
            if self._forget(number) is not None:
                self._keeper.send(Drop(number))
            return task.listener.lost("The stored picture cannot be read.")
        task.record.forget()
        task.resident = True
        self._replay(number, task.record)
        task.listener.again()

    def _lose_task(self, number: int) -> None:
        """End a task after an error of the server, by which a message was lost: the next ones would lack it."""
        if (task := self._forget(number)) is not None:
            self._keeper.send(Drop(number))
            task.listener.lost(MISTAKE)

    def _hear(self, message: Heard, task: TaskRecord) -> None:
        if isinstance(message, Evicted):
            return self._evicted(message.task, task)
        if isinstance(message, Done) and task.record.saved is not None:
            return  # it was brought back, and had a turn before it learned that it has ended
        if isinstance(message, Discarded):
            task.record.forget()
            return task.listener.again()
        if isinstance(message, Loaded):
            self._count(message)
        elif isinstance(message, Checkpoint):
            self.statistics.checkpoints += 1
        elif isinstance(message, Frame | Progressed | Done) and time.monotonic() - task.struck_at > FORGIVEN_S:
            task.strikes = 0
        message = task.record.heard(message)
        task.listener.heard(message)
        self._events.heard(message)

    def _evicted(self, number: int, task: TaskRecord) -> None:
        task.resident = task.record.saved is None
        if task.resident:  # it ended before it had a sample
            for read in list(task.record.reads.values()):
                task.listener.heard(task.record.heard(Image(number, read.serial, None, Progress())))
        elif task.record.reads:
            self._bring_back_soon(number, task)

    def _account(self, usage: Usage) -> None:
        statistics = self.statistics
        statistics.samples += usage.samples
        statistics.load = RendererLoad(usage.tasks, usage.bytes, usage.resting, usage.kernels)
        statistics.kernels_evicted += usage.evicted
        for number, seconds in usage.gpu_s.items():
            task = self.tasks.get(number)
            if task is None:
                statistics.worked(*self._events.work_of(number), seconds)
                continue
            statistics.gpu_s_of[number] += seconds
            statistics.worked(task.kind, task.client, seconds)

    def _count(self, loaded: Loaded) -> None:
        self.statistics.setup_s.add(loaded.setup_s)
        if loaded.compile_ms:
            self.statistics.compile_s.add(loaded.compile_ms / 1e3)
        else:
            self.statistics.kernels_found += 1

    def _blame(self, process: RendererProcess, cause: Cause) -> None:
        """Count the loss against the task that was worked on, unless the renderer was ended from outside."""
        if cause in BY_OTHERS:
            return
        number = process.task
        task = self.tasks.get(number)
        if task is None:
            return self._events.leased(LeaseFailed(number, 0, f"the renderer {cause}"))
        task.strikes += 1
        task.struck_at = time.monotonic()
        log.warning("blamed a task for the loss of the renderer", {"task": number, "strikes": task.strikes})
        if task.strikes >= STRIKES:
            self._forget(number)
            task.listener.lost(f"Rendering this scene brought the renderer down {STRIKES} times ({cause}).")
