"""Supervises one renderer: routes its messages to the tasks' listeners, and replays the tasks when it is lost."""

from __future__ import annotations

import itertools
import logging
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from service.ipc import channel
from service.ipc.leases import Lease, LeaseDone, LeaseFailed, LeaseRefuted
from service.ipc.messages import (
    Checkpoint,
    Discarded,
    Done,
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
from service.ipc.orders import Drop
from service.problems import Unavailable
from service.renderers.local.keeper import CLOSING, Keeper
from service.renderers.local.process import Cause, Options, Process, RendererProcess, Start
from service.renderers.local.restarts import BY_OTHERS
from service.renderers.protocol import Listener, Member, Place
from service.renderers.replay_log import ReplayLog
from service.renderers.statistics import Kind, Statistics
from service.renderers.task import Task
from service.system.executors import sending, tending

STRIKES = 3  # renderers that a task may bring down
FORGIVEN_S = 5.0  # of life with that task, after which an earlier loss was not its fault

log = logging.getLogger(__name__)


class Supervisor:
    """Fulfils `Renderers` with one process.

    Whoever has several of them sets what they call, on the event loop: `changed` when the process is ready or lost,
    and when there is no hope for it; `lost` when others may take over its tasks, none of which can still be blamed
    for the loss; `ended` with the number of a task that is there no more, for whatever reason; `stray` with a message
    for a task that is another supervisor's, or nobody's any more; `handed` with leases and their results; `noticed`
    with what a task's listener hears; `told` with the number of a task of which another process was told. `kind_of`
    says whose another supervisor's task is.
    """

    def __init__(
        self,
        options: Options | None = None,
        start: Start | None = None,
        place: Place | None = None,
        numbers: Iterator[int] | None = None,
    ) -> None:
        """`start` starts the process, by default one of this machine; the tasks get their `numbers` from there."""
        self.statistics = Statistics()
        self.place = place or Place()
        options = replace(options or Options(), name=self.place.id)
        self.changed: Callable[[], None] = lambda: None
        self.lost: Callable[[], None] = lambda: None
        self.ended: Callable[[int], None] = lambda task: None
        self.stray: Callable[[Heard], None] = lambda message: None
        self.handed: Callable[[Lease | LeaseDone | LeaseFailed | LeaseRefuted], None] = lambda message: None
        self.noticed: Callable[[Heard], None] = lambda message: None
        self.told: Callable[[int], None] = lambda task: None
        self.kind_of: Callable[[int], Kind] = lambda task: "server"
        self._tasks: dict[int, Task] = {}
        self._numbers = numbers or itertools.count(1)
        self._keeper = keeper = Keeper(
            self.place.id, start or partial(Process, options), options.patience_s, self.statistics
        )
        keeper.heard, keeper.began, keeper.lost = self._received, self._began, self._lose
        keeper.changed, keeper.hopeless = lambda: self.changed(), lambda: self._fail_all(self.detail)

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
        return [Member(place, self._keeper.state, self.driver, self.process_id, self.statistics)]

    @property
    def tasks(self) -> Mapping[int, Task]:
        """Those that were opened here, or taken over, by their numbers."""
        return self._tasks

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
        self._tasks[number] = Task(listener, kind, client or str(number), ReplayLog(number))
        return number

    def take_over(self, number: int, task: Task) -> None:
        """Go on with a task that was opened elsewhere, as with one's own after a loss of the process."""
        self._tasks[number] = task
        if self._keeper.process is not None:
            self._begin_again(number, task)

    def give_up(self, number: int) -> Task:
        """A task, for another supervisor to take over; this one's renderer forgets it."""
        task = self._tasks.pop(number)
        self.statistics.gpu_s_of.pop(number, None)
        self._keeper.send(Drop(number))
        return task

    def divide(self, task: int, most: int | None) -> None:
        """There is one renderer."""

    def tracing(self, task: int | None) -> int:
        held = None if task is None else self._tasks.get(task)
        return int(held is not None and held.active)

    def drop(self, task: int) -> None:
        if self._forget(task) is not None:
            self._keeper.send(Drop(task))

    def send(self, message: ToRenderer) -> None:
        """Hands the message on; nothing happens when its task was lost or dropped."""
        held = self._tasks.get(message.task)
        if held is None:
            return
        held.record.told(message)
        if held.resident:
            self._keeper.send(message)
        elif isinstance(message, Read):
            self._keeper.do(self._bring_back(message.task, held))

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        """Like `send`, for a whole scene or a large edit: copying that to shared memory is not the event loop's work.

        `restore`: its picture as the server has it.
        """
        await self.sent_scene(update, restore)

    async def sent_scene(self, update: Update, restore: Restore | None = None) -> bool:
        """Send it; False where the task is not here any more, and nothing was done."""
        held = self._tasks.get(update.task)
        if held is None:
            return False
        update = replace(update, client=held.client)
        encoded = await sending(partial(channel.encode, update))
        if update.task not in self._tasks:
            channel.discard(encoded)
            return False
        if update.scene is None:
            held.record.told(update)
            if held.resident:
                self._keeper.send_encoded(encoded)
            else:
                channel.discard(encoded)
            return True
        held.record.scene_told(update, encoded)
        if restore is None:
            self._keeper.send_encoded(encoded)
            return True
        held.record.restored(restore)
        held.resident = False
        channel.discard(encoded)
        await self._bring_back(update.task, held)
        return True

    def stored(self, task: int, picture: SavedPicture, read: Callable[[], Restore]) -> None:
        """A task's picture need not stay in memory: `read`, which is not for an event loop, gives it."""
        if (held := self._tasks.get(task)) is not None:
            held.record.stored(picture, read)

    def relay(self, message: ToRenderer) -> None:
        """Send the process a message for a task that is another supervisor's; lost where there is no process."""
        self._keeper.send(message)

    def relay_encoded(self, encoded: channel.Encoded) -> None:
        """The same for what `channel.encode` gave, whose descriptors are the process's from now on."""
        self._keeper.send_encoded(encoded)

    def _began(self) -> None:
        for number, task in self._tasks.items():
            self._begin_again(number, task)

    def _begin_again(self, number: int, task: Task) -> None:
        """Tell a process that has not heard of the task all that it needs."""
        task.resident = task.record.kept is None
        if task.resident:
            self._tell_all(number, task.record)
            task.listener.again()
        elif task.record.saved is None or task.record.reads:
            self._keeper.do(self._bring_back(number, task))

    def _tell_all(self, number: int, record: ReplayLog, kept: channel.Encoded | None = None) -> None:
        for message in record.again(kept):
            if isinstance(message, tuple):
                self._keeper.send_encoded(message)
            else:
                self._keeper.send(message)
        self.told(number)

    async def _bring_back(self, task: int, held: Task) -> None:
        """Send the renderer a picture that it no longer has, to go on with or to be read."""
        process, kept = self._keeper.process, held.record.kept
        try:
            encoded = await tending(lambda: channel.encode(kept() if callable(kept) else kept))
        except Exception as error:
            return self._lose_picture(task, held, error)
        if held.resident or process is None or process is not self._keeper.process or task not in self._tasks:
            return channel.discard(encoded)
        held.resident = True
        self._tell_all(task, held.record, encoded)

    def _lose_picture(self, task: int, held: Task, error: Exception) -> None:
        """The server's copy of a picture cannot be read: begin again what was under way."""
        log.error("could not read a picture that was stored task=%d error=%s", task, error)
        if held.resident or task not in self._tasks:
            return
        if held.record.saved is not None:
            self.drop(task)
            return held.listener.lost("The stored picture cannot be read.")
        held.record.forget()
        held.resident = True
        self._tell_all(task, held.record)
        held.listener.again()

    def _received(self, message: Heard) -> None:
        if isinstance(message, Usage):
            self._account(message)
        elif isinstance(message, Lease | LeaseDone | LeaseFailed | LeaseRefuted):
            self.handed(message)
        elif (held := self._tasks.get(message.task)) is not None:
            self._hear(message, held)
        else:
            self.stray(message)

    def _hear(self, message: Heard, held: Task) -> None:
        if isinstance(message, Evicted):
            held.resident = held.record.saved is None
            if held.resident:  # it ended before it had a sample
                for read in list(held.record.reads.values()):
                    held.listener.heard(held.record.heard(Image(message.task, read.serial, None, Progress())))
            elif held.record.reads:
                self._keeper.do(self._bring_back(message.task, held))
            return
        if isinstance(message, Done) and held.record.saved is not None:
            return  # it was brought back, and had a turn before it heard that it is finished
        if isinstance(message, Discarded):
            held.record.forget()
            return held.listener.again()
        if isinstance(message, Loaded):
            self._count(message)
        elif isinstance(message, Checkpoint):
            self.statistics.checkpoints += 1
        elif isinstance(message, Frame | Progressed | Done) and time.monotonic() - held.struck_at > FORGIVEN_S:
            held.strikes = 0
        message = held.record.heard(message)
        held.listener.heard(message)
        self.noticed(message)

    def _account(self, usage: Usage) -> None:
        statistics = self.statistics
        statistics.samples += usage.samples
        statistics.tasks, statistics.gpu_bytes = usage.tasks, usage.bytes
        statistics.kernels, statistics.kernels_evicted = usage.kernels, statistics.kernels_evicted + usage.evicted
        for task, seconds in usage.gpu_s.items():
            held = self._tasks.get(task)
            if held is not None:
                statistics.gpu_s_of[task] += seconds
            statistics.gpu_s[self.kind_of(task) if held is None else held.kind] += seconds

    def _count(self, loaded: Loaded) -> None:
        self.statistics.setup_s.add(loaded.setup_s)
        if loaded.compile_ms:
            self.statistics.compile_s.add(loaded.compile_ms / 1e3)
        else:
            self.statistics.kernels_found += 1

    def _lose(self, process: RendererProcess, cause: Cause) -> None:
        self._blame(process, cause)
        self.lost()

    def _blame(self, process: RendererProcess, cause: Cause) -> None:
        """Count the loss against the task that was worked on, unless the renderer was ended from outside."""
        task = process.task
        held = self._tasks.get(task)
        if cause in BY_OTHERS:
            return
        if held is None:
            return self.handed(LeaseFailed(task, 0, f"the renderer {cause}"))
        held.strikes += 1
        held.struck_at = time.monotonic()
        log.warning("blamed a task for the loss of the renderer task=%d strikes=%d", task, held.strikes)
        if held.strikes >= STRIKES:
            self._forget(task)
            held.listener.lost(f"Rendering this scene brought the renderer down {STRIKES} times ({cause}).")

    def _fail_all(self, detail: str) -> None:
        tasks = dict(self._tasks)
        for number in tasks:
            self._forget(number)
        for held in tasks.values():
            held.listener.lost(detail)

    def _forget(self, number: int) -> Task | None:
        """The task, if it was there; nothing is left of it."""
        task = self._tasks.pop(number, None)
        if task is not None:
            self.statistics.gpu_s_of.pop(number, None)
            task.record.close()
            self.ended(number)
        return task
