"""Supervises the renderer's process: routes its messages, replaces it when it is lost, and replays its tasks."""

from __future__ import annotations

import asyncio
import itertools
import logging
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from service.problems import Unavailable
from service.rendering.executors import sending, tending
from service.rendering.ipc import channel
from service.rendering.ipc.messages import (
    Checkpoint,
    Done,
    Drop,
    Evicted,
    Frame,
    FromRenderer,
    Image,
    KernelMeasured,
    Loaded,
    MeasureKernel,
    Progress,
    Progressed,
    Read,
    Ready,
    Restore,
    SavedPicture,
    ToRenderer,
    Unable,
    Update,
    Usage,
)
from service.rendering.renderers import Listener
from service.rendering.statistics import Kind, Statistics
from service.rendering.supervisor.process import Cause, Options, Process, RendererProcess, Start
from service.rendering.supervisor.replay_log import ReplayLog

TRIES = 3  # starts in a row that end before rendering; then there is no renderer, and the reason is given
BY_OTHERS: tuple[Cause, ...] = ("killed", "stopped")  # causes from outside, which never count as a failure to start
LAST_WORDS_S = 5.0  # for a renderer that closed its end of the channel to exit, so that its exit code says why
BETWEEN_TRIES_S = 0.5
AFTER_KILLS_S = 5.0  # between starts of renderers that others kill as soon as they begin, at most
HOPELESS_S = 15.0  # between tries after that, while nobody waits
STRIKES = 3  # renderers that a task may bring down
FORGIVEN_S = 5.0  # of life with that task, after which an earlier loss was not its fault
WATCH_S = 0.5
FAREWELL_S = 3.0  # for the renderer to end by itself; one slice on a slow machine, or a compilation

log = logging.getLogger(__name__)


@dataclass
class _Task:
    listener: Listener
    kind: Kind
    client: str
    record: ReplayLog
    resident: bool = True  # the renderer has it, or is being told
    strikes: int = 0
    struck_at: float = field(default=0.0)


class Supervisor:
    """Fulfils `Renderers` with one process."""

    def __init__(self, options: Options | None = None, start: Start | None = None) -> None:
        """`start` starts the process, which is one of this machine by default."""
        self.statistics = Statistics()
        self._options = options or Options()
        self._start: Start = start or partial(Process, self._options)
        self._tasks: dict[int, _Task] = {}
        self._numbers = itertools.count(1)
        self._ready: asyncio.Future[dict[str, Any]] | None = None
        self._process: RendererProcess | None = None
        self._lost_at: float | None = None
        self._failures = self._shots = 0  # in a row, to start; through others
        self._rendered = False  # there was one
        self._detail = "The renderer has not been started."
        self._chores: set[asyncio.Task[None]] = set()
        self._closed = False
        self._lifeline: tuple[int, int] | None = None  # a pipe: what outlives a renderer ends with its other end

    def start(self) -> None:
        """Starts the renderer's process; it is ready some tenths of a second later."""
        self._ready = asyncio.get_running_loop().create_future()
        self._lifeline = os.pipe()
        self._begin()
        self._do(self._watch())

    async def close(self) -> None:
        self._closed = True
        for chore in self._chores:
            chore.cancel()
        await asyncio.gather(*self._chores, return_exceptions=True)
        self._fail_all("The server is shutting down.")
        process, self._process = self._process, None
        if process is not None:
            await process.end(FAREWELL_S)
        for end in self._lifeline or ():
            os.close(end)
        self._lifeline = None

    @property
    def process_id(self) -> int | None:
        return None if self._process is None else self._process.id

    @property
    def info(self) -> dict[str, Any] | None:
        """The device that renders; None while nothing can."""
        ready = self._ready
        return ready.result() if ready is not None and ready.done() and not self.hopeless else None

    @property
    def hopeless(self) -> bool:
        return self._failures >= TRIES

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        """The device that renders, as soon as one does. Raises Unavailable with the reason why none does."""
        if self._ready is None or self._closed or self.hopeless:
            raise Unavailable(self._detail)
        try:
            return await asyncio.wait_for(asyncio.shield(self._ready), timeout_s)
        except TimeoutError:
            raise Unavailable("The renderer is starting.") from None

    async def able(self, timeout_s: float) -> None:
        """Returns when something renders, or did and is being replaced: work can be taken, which then waits a little.

        Raises Unavailable.
        """
        if not self._rendered or self._closed or self.hopeless:
            await self.ready(timeout_s)

    def open(self, listener: Listener, kind: Kind = "stream", client: str = "") -> int:
        """The number of a new task, whose messages `listener` hears until `drop`. Raises Unavailable.

        Tasks of one `client` share its part of the GPU's time; without a name each has its own.
        """
        if self._ready is None or self._closed or self.hopeless:
            raise Unavailable(self._detail)
        task = next(self._numbers)
        self._tasks[task] = _Task(listener, kind, client or str(task), ReplayLog(task))
        return task

    def drop(self, task: int) -> None:
        held = self._tasks.pop(task, None)
        if held is not None:
            self.statistics.gpu_s_of.pop(task, None)
            held.record.close()
            self._send(Drop(task))

    def send(self, message: ToRenderer) -> None:
        """Hands the message on; nothing happens when its task was lost or dropped."""
        held = self._tasks.get(message.task)
        if held is None:
            return
        held.record.told(message)
        if held.resident:
            self._send(message)
        elif isinstance(message, Read | MeasureKernel):
            self._do(self._bring_back(message.task, held))

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        """Like `send`, for a whole scene: copying that to shared memory is not the event loop's work.

        `restore`: its picture as the server has it.
        """
        held = self._tasks.get(update.task)
        if held is None:
            return
        update = replace(update, client=held.client)
        encoded = await sending(partial(channel.encode, update))
        if update.task not in self._tasks:
            return channel.discard(encoded)
        held.record.scene_told(update, encoded)
        if restore is None:
            return self._send_encoded(encoded)
        held.record.restored(restore)
        held.resident = False
        channel.discard(encoded)
        await self._bring_back(update.task, held)

    def stored(self, task: int, picture: SavedPicture, read: Callable[[], Restore]) -> None:
        """A task's picture need not stay in memory: `read`, which is not for an event loop, gives it."""
        if (held := self._tasks.get(task)) is not None:
            held.record.stored(picture, read)

    def _send(self, message: ToRenderer) -> None:
        if self._process is not None:
            self._process.link.send(message)

    def _send_encoded(self, encoded: channel.Encoded) -> None:
        if self._process is not None:
            self._process.link.send_encoded(encoded)
        else:
            channel.discard(encoded)

    def _begin(self) -> None:
        lifeline = None if self._lifeline is None else self._lifeline[0]
        process: RendererProcess = self._start(self._received, lambda: self._lose(process), lifeline)
        self._process = process
        for task, held in self._tasks.items():
            self._not_measured(held, "The renderer was lost before it could answer: ask again.")
            held.resident = held.record.kept is None
            if held.resident:
                self._tell_all(held.record)
                held.listener.again()
            elif held.record.saved is None or held.record.reads:
                self._do(self._bring_back(task, held))

    def _tell_all(self, record: ReplayLog, kept: channel.Encoded | None = None) -> None:
        for message in record.again(kept):
            if isinstance(message, tuple):
                self._send_encoded(message)
            else:
                self._send(message)

    async def _bring_back(self, task: int, held: _Task) -> None:
        """Send the renderer a picture that it no longer has, to go on with or to be read."""
        process, kept = self._process, held.record.kept
        try:
            encoded = await tending(lambda: channel.encode(kept() if callable(kept) else kept))
        except Exception as error:
            return self._lose_picture(task, held, error)
        if held.resident or process is None or process is not self._process or task not in self._tasks:
            return channel.discard(encoded)
        held.resident = True
        self._tell_all(held.record, encoded)

    def _lose_picture(self, task: int, held: _Task, error: Exception) -> None:
        """The server's copy of a picture cannot be read: begin again what was under way."""
        log.error("could not read a picture that was stored task=%d error=%s", task, error)
        if held.resident or task not in self._tasks:
            return
        if held.record.saved is not None:
            self.drop(task)
            return held.listener.lost("The stored picture cannot be read.")
        held.record.forget()
        held.resident = True
        self._tell_all(held.record)
        held.listener.again()

    def _received(self, message: FromRenderer) -> None:
        if isinstance(message, Ready):
            self._is_ready(message)
        elif isinstance(message, Unable):
            self._detail = message.detail
            if self._process is not None:
                self._process.unable = True
            log.error("could not start a renderer error=%s", message.detail)
        elif isinstance(message, Usage):
            self._account(message)
        elif (held := self._tasks.get(message.task)) is not None:
            self._hear(message, held)

    def _hear(self, message: FromRenderer, held: _Task) -> None:
        if isinstance(message, Evicted):
            self._not_measured(held, "The render made room for others before it was measured: ask again.")
            held.resident = held.record.saved is None
            if held.resident:  # it ended before it had a sample
                for read in list(held.record.reads.values()):
                    held.listener.heard(held.record.heard(Image(message.task, read.serial, None, Progress())))
            elif held.record.reads:
                self._do(self._bring_back(message.task, held))
            return
        if isinstance(message, Done) and held.record.saved is not None:
            return  # it was brought back, and had a turn before it heard that it is finished
        if isinstance(message, Loaded):
            self._count(message)
        elif isinstance(message, Checkpoint):
            self.statistics.checkpoints += 1
        elif isinstance(message, Frame | Progressed | Done) and time.monotonic() - held.struck_at > FORGIVEN_S:
            held.strikes = 0
        held.listener.heard(held.record.heard(message))

    def _not_measured(self, held: _Task, why: str) -> None:
        """Answer that the kernel was not measured; to retry unasked might bring down one renderer after another."""
        if (asked := held.record.measure_kernel) is not None:
            held.listener.heard(held.record.heard(KernelMeasured(asked.task, why)))

    def _is_ready(self, message: Ready) -> None:
        assert self._process is not None
        self._process.ready = self._rendered = True
        self._failures = self._shots = 0
        seconds = time.monotonic() - self._process.began
        log.info("renderer ready renderer=%s seconds=%.2f", message.info.get("renderer"), seconds)
        if self._ready is not None and not self._ready.done():
            self._ready.set_result(message.info)
        if self._lost_at is not None:
            self.statistics.recovery_s.add(time.monotonic() - self._lost_at)
            self._lost_at = None

    def _account(self, usage: Usage) -> None:
        statistics = self.statistics
        statistics.samples += usage.samples
        statistics.tasks, statistics.gpu_bytes = usage.tasks, usage.bytes
        statistics.kernels, statistics.kernels_evicted = usage.kernels, statistics.kernels_evicted + usage.evicted
        for task, seconds in usage.gpu_s.items():
            held = self._tasks.get(task)
            if held is not None:
                statistics.gpu_s_of[task] += seconds
            statistics.gpu_s["server" if held is None else held.kind] += seconds

    def _count(self, loaded: Loaded) -> None:
        self.statistics.setup_s.add(loaded.setup_s)
        if loaded.compile_ms:
            self.statistics.compile_s.add(loaded.compile_ms / 1e3)
        else:
            self.statistics.kernels_found += 1

    async def _watch(self) -> None:
        loop, pause_s = asyncio.get_running_loop(), min(WATCH_S, self._options.patience_s / 4)
        while True:
            began = loop.time()
            await asyncio.sleep(pause_s)
            late = loop.time() - began > 2 * pause_s  # then it is the server that was slow, and has not listened
            if self._process is not None:
                self._process.watch(excused=late)

    def _lose(self, process: RendererProcess) -> None:
        """Replace a renderer whose end of the channel is closed."""
        if self._closed or process is not self._process:
            return
        self._process = None
        self._lost_at = self._lost_at or time.monotonic()
        if process.ready:
            self._detail = "The renderer was lost."
            self._ready = asyncio.get_running_loop().create_future()
        self._do(self._replace(process))

    async def _replace(self, process: RendererProcess) -> None:
        cause = await process.end(LAST_WORDS_S)
        if not process.ready:
            by_others = (
                cause in BY_OTHERS and not process.unable
            )  # a process that was dying slowly may be killed at last by others
            self._failures += not by_others
            self._shots += by_others
        self.statistics.restarts[cause] += 1
        log.error("renderer lost cause=%s lived_s=%.1f failures=%d", cause, process.lived_s, self._failures)
        self._blame(process, cause)
        if self.hopeless:
            self._fail_all(self._detail)
            if self._ready is not None and not self._ready.done():
                self._ready.set_exception(Unavailable(self._detail))
                self._ready.exception()  # looked at: perhaps nobody waits, and asyncio would complain
            await asyncio.sleep(HOPELESS_S)
            self._ready = asyncio.get_running_loop().create_future()
        else:
            await asyncio.sleep(self._pause_s(process.lived_s))
        self._begin()

    def _pause_s(self, lived_s: float) -> float:
        """Seconds before the next start: more after each failure to start, or after kills in quick succession."""
        after_kill_s = min(BETWEEN_TRIES_S * self._shots, AFTER_KILLS_S) - lived_s
        return max(BETWEEN_TRIES_S * self._failures, after_kill_s, 0.0)

    def _blame(self, process: RendererProcess, cause: Cause) -> None:
        """Count the loss against the task that was worked on, unless the renderer was ended from outside."""
        task = process.task
        held = self._tasks.get(task)
        if held is None or cause in BY_OTHERS:
            return
        held.strikes += 1
        held.struck_at = time.monotonic()
        log.warning("blamed a task for the loss of the renderer task=%d strikes=%d", task, held.strikes)
        if held.strikes >= STRIKES:
            del self._tasks[task]
            self.statistics.gpu_s_of.pop(task, None)
            held.record.close()
            held.listener.lost(f"Rendering this scene brought the renderer down {STRIKES} times ({cause}).")

    def _fail_all(self, detail: str) -> None:
        tasks = list(self._tasks.values())
        self._tasks.clear()
        self.statistics.gpu_s_of.clear()
        for held in tasks:
            held.record.close()
            held.listener.lost(detail)

    def _do(self, work: Any) -> None:
        chore = asyncio.get_running_loop().create_task(work)
        self._chores.add(chore)
        chore.add_done_callback(self._chores.discard)
