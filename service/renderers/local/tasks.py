"""The tasks of one renderer: their messages go to their listeners, and a new process gets them when one is lost."""

from __future__ import annotations

import logging
import time
from functools import partial
from typing import Protocol

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
    Usage,
)
from service.ipc.task_control import Drop
from service.problems import MISTAKE
from service.renderers.local.keeper import Keeper
from service.renderers.local.process import Cause, RendererProcess, Start
from service.renderers.local.restarts import BY_OTHERS
from service.renderers.replay_log import ReplayLog
from service.renderers.statistics import Held, Kind, Statistics
from service.renderers.task import Task
from service.system.background import reported
from service.system.executors import tending

STRIKES = 3  # renderers that a task may bring down
FORGIVEN_S = 5.0  # of life with that task, after which an earlier loss was not its fault

log = logging.getLogger(__name__)


class Events(Protocol):
    """What the owner of several renderers learns of one of them, on the event loop."""

    def changed(self) -> None:
        """The process is ready or lost, waits for a place, or will not be started again for a while."""

    def lost(self) -> None:
        """The process was lost, and none of its tasks can still be blamed for that: others may take them over."""

    def ended(self, task: int) -> None:
        """The renderer has forgotten this task, for whatever reason."""

    def heard(self, message: Heard) -> None:
        """The listener of a task has received this message."""

    def leased(self, message: Lease | LeaseDone | LeaseFailed | LeaseRefuted) -> None:
        """The process gives a part of a picture to another renderer, or answers for a part that it was given."""

    def replayed(self, task: int) -> None:
        """A process that did not know this task has been sent all of it."""

    def kind_of(self, task: int) -> Kind:
        """Whose work another renderer's task is, which this one assists."""


class Alone:
    """Where a renderer is the only one, nobody needs its events."""

    def changed(self) -> None: ...

    def lost(self) -> None: ...

    def ended(self, task: int) -> None: ...

    def heard(self, message: Heard) -> None: ...

    def leased(self, message: Lease | LeaseDone | LeaseFailed | LeaseRefuted) -> None: ...

    def replayed(self, task: int) -> None: ...

    def kind_of(self, task: int) -> Kind:
        return "server"


class Tasks:
    """For the event loop. `by_number` has the tasks that were opened here or taken over; `keeper` has the process."""

    def __init__(
        self, name: str, start: Start, patience_s: float, statistics: Statistics, events: Events | None = None
    ) -> None:
        """`name` and `patience_s` are for the Keeper, which starts its processes with `start`."""
        self.by_number: dict[int, Task] = {}
        self._statistics = statistics
        self._events = events or Alone()
        self.keeper = Keeper(name, start, patience_s, statistics, self)

    def add(self, number: int, task: Task) -> None:
        """Go on with a task of another renderer, as after a loss of the process."""
        self.by_number[number] = task
        if self.keeper.process is not None:
            self._begin_again(number, task)

    def remove(self, number: int) -> Task | None:
        """The task, which is not here from now on; None where it was not."""
        self._statistics.gpu_s_of.pop(number, None)
        return self.by_number.pop(number, None)

    def forget(self, number: int) -> Task | None:
        """The task, of which nothing stays; None where it is not here."""
        if (task := self.remove(number)) is not None:
            task.record.close()
            self._events.ended(number)
        return task

    def fail_all(self, detail: str) -> None:
        tasks = dict(self.by_number)
        for number in tasks:
            self.forget(number)
        for task in tasks.values():
            task.listener.lost(detail)

    def bring_back_soon(self, number: int, task: Task) -> None:
        """Begin to bring back a picture; where that fails, what was under way begins again."""
        self.keeper.do(
            "return of a picture", self.bring_back(number, task), partial(self._lose_picture, number, task)
        )

    async def bring_back(self, number: int, task: Task) -> None:
        """Send the process a picture that it does not have, to go on with it or to read it."""
        process, kept = self.keeper.process, task.record.kept
        try:
            encoded = await tending(lambda: channel.encode(kept() if callable(kept) else kept))
        except Exception as error:
            return self._lose_picture(number, task, error)
        if task.resident or process is None or process is not self.keeper.process or number not in self.by_number:
            return channel.discard(encoded)
        task.resident = True
        self._replay(number, task.record, encoded)

    def changed(self) -> None:
        self._events.changed()

    def began(self) -> None:
        for number, task in self.by_number.items():
            self._begin_again(number, task)

    def received(self, message: Heard) -> None:
        if isinstance(message, Usage):
            self._account(message)
        elif isinstance(message, Lease | LeaseDone | LeaseFailed | LeaseRefuted):
            self._events.leased(message)
        elif (task := self.by_number.get(message.task)) is not None:
            with reported("message of a renderer", lambda _: self._lose_task(message.task)):
                self._hear(message, task)

    def lost(self, process: RendererProcess, cause: Cause) -> None:
        self._blame(process, cause)
        self._events.lost()

    def given_up(self) -> None:
        self.fail_all(self.keeper.detail)

    def _begin_again(self, number: int, task: Task) -> None:
        """Send a process that does not know the task all that it needs."""
        task.resident = task.record.kept is None
        if task.resident:
            self._replay(number, task.record)
            task.listener.again()
        elif task.record.saved is None or task.record.reads:
            self.bring_back_soon(number, task)

    def _replay(self, number: int, record: ReplayLog, kept: channel.Encoded | None = None) -> None:
        for message in record.again(kept):
            if isinstance(message, tuple):
                self.keeper.send_encoded(message)
            else:
                self.keeper.send(message)
        self._events.replayed(number)

    def _lose_picture(self, number: int, task: Task, error: Exception) -> None:
        """The server's copy of a picture cannot be read: what was under way begins again."""
        log.error("could not read a picture that was stored", {"task": number, "error": error})
        if task.resident or number not in self.by_number:
            return
        if task.record.saved is not None:
            if self.forget(number) is not None:
                self.keeper.send(Drop(number))
            return task.listener.lost("The stored picture cannot be read.")
        task.record.forget()
        task.resident = True
        self._replay(number, task.record)
        task.listener.again()

    def _lose_task(self, number: int) -> None:
        """An error of the server keeps a message from whom it is for, whom nothing reaches any more in order."""
        if (task := self.forget(number)) is not None:
            self.keeper.send(Drop(number))
            task.listener.lost(MISTAKE)

    def _hear(self, message: Heard, task: Task) -> None:
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
            self._statistics.checkpoints += 1
        elif isinstance(message, Frame | Progressed | Done) and time.monotonic() - task.struck_at > FORGIVEN_S:
            task.strikes = 0
        message = task.record.heard(message)
        task.listener.heard(message)
        self._events.heard(message)

    def _evicted(self, number: int, task: Task) -> None:
        task.resident = task.record.saved is None
        if task.resident:  # it ended before it had a sample
            for read in list(task.record.reads.values()):
                task.listener.heard(task.record.heard(Image(number, read.serial, None, Progress())))
        elif task.record.reads:
            self.bring_back_soon(number, task)

    def _account(self, usage: Usage) -> None:
        statistics = self._statistics
        statistics.samples += usage.samples
        statistics.held = Held(usage.tasks, usage.bytes, usage.resting, usage.kernels)
        statistics.kernels_evicted += usage.evicted
        for number, seconds in usage.gpu_s.items():
            task = self.by_number.get(number)
            if task is not None:
                statistics.gpu_s_of[number] += seconds
            statistics.gpu_s[self._events.kind_of(number) if task is None else task.kind] += seconds

    def _count(self, loaded: Loaded) -> None:
        self._statistics.setup_s.add(loaded.setup_s)
        if loaded.compile_ms:
            self._statistics.compile_s.add(loaded.compile_ms / 1e3)
        else:
            self._statistics.kernels_found += 1

    def _blame(self, process: RendererProcess, cause: Cause) -> None:
        """Count the loss against the task that was worked on, unless the renderer was ended from outside."""
        if cause in BY_OTHERS:
            return
        number = process.task
        task = self.by_number.get(number)
        if task is None:
            return self._events.leased(LeaseFailed(number, 0, f"the renderer {cause}"))
        task.strikes += 1
        task.struck_at = time.monotonic()
        log.warning("blamed a task for the loss of the renderer", {"task": number, "strikes": task.strikes})
        if task.strikes >= STRIKES:
            self.forget(number)
            task.listener.lost(f"Rendering this scene brought the renderer down {STRIKES} times ({cause}).")
