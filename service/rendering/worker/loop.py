"""One loop: the newest messages, a slice of work, what is wanted of the result."""

from __future__ import annotations

import logging
import socket
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from gpu import GpuError, OutOfMemory, Renderer, SceneTooLarge
from service.rendering import link
from service.rendering.messages import (
    Drop,
    Failed,
    FromRenderer,
    Pause,
    Read,
    Resume,
    Stop,
    ToRenderer,
    Update,
    Usage,
    Want,
)
from service.rendering.scheduler import Scheduler
from service.rendering.worker.denoiser import Denoiser
from service.rendering.worker.task import Task

REPORT_S = 0.25  # between two accounts of the GPU time that was used

log = logging.getLogger(__name__)


@dataclass
class _Clock:
    seconds: float = 0.0


class Loop:
    def __init__(self, end: socket.socket, renderer: Renderer) -> None:
        self._end = end
        self._renderer = renderer
        self._tasks: dict[int, Task] = {}
        self._scheduler = Scheduler()
        self._denoiser = Denoiser()
        self._used_s: dict[int, float] = defaultdict(float)  # by task, not reported yet
        self._traced = 0
        self._reported = 0.0

    def run(self) -> None:
        """Until the server is gone: raises link.Closed. Sleeps on its sockets when there is nothing to do."""
        busy = False
        while True:
            for message in coalesced(self._pending(wait=not busy)):
                with self._charged(message.task):
                    self._take(message)
            self._denoiser.hear()
            task = self._scheduler.choose(self._tasks.values())
            if task is not None:
                with self._charged(task.number) as clock:
                    self._guard(task, task.step)
                task.used_s += clock.seconds
            for task in self._tasks.values():
                if task.want is None:
                    continue
                with self._charged(task.number) as clock:
                    answered = self._guard(task, task.answer)
                if answered:
                    task.used_s += clock.seconds
            busy = any(task.ready for task in self._tasks.values())
            self._account(at_once=not busy)

    @contextmanager
    def _charged(self, task: int) -> Iterator[_Clock]:
        """Measures what is done inside, on the account of that task."""
        clock, began = _Clock(), time.perf_counter()
        yield clock
        clock.seconds = time.perf_counter() - began
        self._used_s[task] += clock.seconds

    def _account(self, at_once: bool) -> None:
        """Tells what was used, now and then; at once before there is nothing to do."""
        now = time.monotonic()
        if self._used_s and (at_once or now - self._reported >= REPORT_S):
            traced = sum(task.traced for task in self._tasks.values())
            self._send(Usage(dict(self._used_s), traced - self._traced, len(self._tasks)))
            self._used_s.clear()
            self._traced, self._reported = traced, now

    def _pending(self, wait: bool) -> Iterator[ToRenderer]:
        """What has come in by now; with `wait`, as soon as there is anything, or a picture was denoised."""
        if wait:
            self._denoiser.sleep(self._end)
        try:
            while True:
                yield link.receive(self._end)
        except BlockingIOError:
            return

    def _take(self, message: ToRenderer) -> None:
        task = self._tasks.get(message.task)
        if isinstance(message, Update):
            if task is None:
                task = self._tasks[message.task] = Task(self._renderer, message.task, self._send, self._denoiser)
            self._guard(task, lambda: task.update(message))
        elif task is None:
            return  # dropped, and the server had not heard of it when it sent this
        elif isinstance(message, Want):
            task.want = message
        elif isinstance(message, Read):
            self._guard(task, lambda: task.read(message), message)
        elif isinstance(message, Pause):
            task.pause()
        elif isinstance(message, Resume):
            task.resume()
        elif isinstance(message, Stop):
            self._guard(task, task.stop)
        elif isinstance(message, Drop):
            self._traced -= task.traced
            self._tasks.pop(message.task).release()

    def _guard(self, task: Task, work: Callable[[], bool | None], read: Read | None = None) -> bool | None:
        """Does the work; what goes wrong in it is this task's misfortune and nobody else's."""
        try:
            return work()
        except link.Closed:
            raise
        except GpuError as error:
            log.warning("failed task=%d %s: %s", task.number, type(error).__name__, error)
            detail, refused = str(error), isinstance(error, SceneTooLarge | OutOfMemory)
        except Exception:
            log.exception("failed task=%d", task.number)
            detail, refused = "The renderer made a mistake; its log says which.", False
        if read is None:
            task.release()
        serial = read.serial if read else None
        self._send(Failed(task.number, task.generation, detail, refused, serial))
        return None

    def _send(self, message: FromRenderer) -> None:
        link.send(self._end, message)


def coalesced(messages: Iterator[ToRenderer]) -> Iterator[ToRenderer]:
    """The messages in order, a run of updates of one task joined into its last. A Want in between changes nothing."""
    updates: dict[int, Update] = {}
    wants: dict[int, Want] = {}
    for message in messages:
        earlier = updates.get(message.task)
        if isinstance(message, Update):
            updates[message.task] = earlier.then(message) if earlier else message
        elif isinstance(message, Want):
            wants[message.task] = message
        else:
            if earlier is not None:
                yield updates.pop(message.task)
            if message.task in wants:
                yield wants.pop(message.task)
            yield message
    yield from updates.values()
    yield from wants.values()
