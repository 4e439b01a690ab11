"""The server's hold on the renderer's process: starts it, speaks with it, starts another when it dies."""

from __future__ import annotations

import asyncio
import itertools
import logging
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Protocol

from service.problems import Unavailable
from service.rendering import link
from service.rendering.messages import Drop, FromRenderer, Loaded, Ready, ToRenderer, Unable, Update, Usage
from service.rendering.statistics import Kind, Statistics

ROOT = Path(__file__).parents[2]
TRIES = 3  # in a row that don't get as far as rendering; then there is no renderer, and the reason is told
BETWEEN_TRIES_S = 0.5
FAREWELL_S = 3.0  # for the renderer to end by itself; one slice on a slow machine, or a compilation

log = logging.getLogger(__name__)


class Listener(Protocol):
    """Who opened a task hears what becomes of it, on the event loop."""

    def heard(self, message: FromRenderer) -> None: ...

    def lost(self, detail: str) -> None:
        """The renderer died, and the task with it."""


class Engine:
    def __init__(self, device: int | None = None) -> None:
        self.statistics = Statistics()
        self._device = device
        self._listeners: dict[int, Listener] = {}
        self._kinds: dict[int, Kind] = {}
        self._lost_at: float | None = None
        self._numbers = itertools.count(1)
        self._ready: asyncio.Future[dict[str, Any]] | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._link: link.Link | None = None
        self._began = 0.0
        self._failures = 0
        self._detail = "The renderer has not been started."
        self._restart: asyncio.Task[None] | None = None
        self._closed = False

    def start(self) -> None:
        """Starts the renderer's process; it is ready some tenths of a second later."""
        if self._ready is None or self._ready.done():
            self._ready = asyncio.get_running_loop().create_future()
        self._began = time.monotonic()
        ours, theirs = link.pair()
        self._process = _spawn(theirs, self._device)
        theirs.close()
        self._link = link.Link(ours, self._received, self._lost)

    async def close(self) -> None:
        self._closed = True
        if self._restart is not None:
            self._restart.cancel()
        self._fail_all("The server is shutting down.")
        if self._link is not None:
            self._link.close()
        if self._process is not None:
            await asyncio.to_thread(_reap, self._process, FAREWELL_S)

    @property
    def process_id(self) -> int | None:
        return None if self._process is None else self._process.pid

    @property
    def info(self) -> dict[str, Any] | None:
        """What renders; None while nothing can."""
        done = self._ready is not None and self._ready.done() and not self._ready.cancelled()
        return self._ready.result() if self._ready is not None and done and not self._ready.exception() else None

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        """What renders, as soon as it does. Raises Unavailable saying why nothing does."""
        if self._ready is None or self._closed:
            raise Unavailable(self._detail)
        try:
            return await asyncio.wait_for(asyncio.shield(self._ready), timeout_s)
        except TimeoutError:
            raise Unavailable("The renderer is starting.") from None

    def open(self, listener: Listener, kind: Kind = "stream") -> int:
        """The number of a new task, whose messages `listener` hears until `drop`. Raises Unavailable."""
        if self._link is None or self._closed:
            raise Unavailable(self._detail)
        task = next(self._numbers)
        self._listeners[task], self._kinds[task] = listener, kind
        return task

    def drop(self, task: int) -> None:
        self._kinds.pop(task, None)
        self.statistics.gpu_s_of.pop(task, None)
        if self._listeners.pop(task, None) is not None and self._link is not None:
            self._link.send(Drop(task))

    def send(self, message: ToRenderer) -> None:
        """Hands the message on; nothing happens when its task is lost or dropped."""
        if message.task in self._listeners and self._link is not None:
            self._link.send(message)

    async def send_scene(self, update: Update) -> None:
        """Like `send`, for a whole scene: copying that to shared memory is not the event loop's work."""
        encoded = await asyncio.to_thread(link.encode, update)
        if update.task in self._listeners and self._link is not None:
            self._link.send_encoded(encoded)
        else:
            link.discard(encoded)

    def _received(self, message: FromRenderer) -> None:
        if isinstance(message, Ready):
            seconds = time.monotonic() - self._began
            log.info("renderer ready renderer=%s seconds=%.2f", message.info.get("renderer"), seconds)
            if self._ready is not None and not self._ready.done():
                self._ready.set_result(message.info)
            if self._lost_at is not None:
                self.statistics.recovery_s.add(time.monotonic() - self._lost_at)
                self._lost_at = None
        elif isinstance(message, Unable):
            self._detail = message.detail
            log.error("no renderer: %s", message.detail)
        elif isinstance(message, Usage):
            self._account(message)
        else:
            if isinstance(message, Loaded):
                self._count(message)
            listener = self._listeners.get(message.task)
            if listener is not None:
                listener.heard(message)

    def _account(self, usage: Usage) -> None:
        statistics = self.statistics
        statistics.samples += usage.samples
        statistics.tasks = usage.tasks
        for task, seconds in usage.gpu_s.items():
            if task in self._listeners:
                statistics.gpu_s_of[task] += seconds
            statistics.gpu_s[self._kinds.get(task, "server")] += seconds

    def _count(self, loaded: Loaded) -> None:
        self.statistics.setup_s.add(loaded.setup_s)
        if loaded.compile_ms:
            self.statistics.compile_s.add(loaded.compile_ms / 1e3)
        else:
            self.statistics.kernels_found += 1

    def _lost(self) -> None:
        """The renderer's end of the link is closed."""
        process, lived_s, was_ready = self._process, time.monotonic() - self._began, self.info is not None
        self._link = self._process = None
        if self._closed or process is None:
            return
        self._failures = 0 if was_ready else self._failures + 1
        log.error("renderer lost lived_s=%.1f failures=%d", lived_s, self._failures)
        self.statistics.restarts["crashed"] += 1
        self._lost_at = self._lost_at or time.monotonic()
        if was_ready:
            self._detail = "The renderer was lost."
            self._ready = asyncio.get_running_loop().create_future()
        self._fail_all(self._detail)
        self._restart = asyncio.get_running_loop().create_task(self._again(process))

    async def _again(self, process: subprocess.Popen[bytes]) -> None:
        await asyncio.to_thread(_reap, process, 0.0)
        if self._failures < TRIES:
            await asyncio.sleep(BETWEEN_TRIES_S * self._failures)
            self.start()
        elif self._ready is not None:
            self._ready.set_exception(Unavailable(self._detail))
            self._ready.exception()  # looked at: perhaps nobody waits, and asyncio would complain

    def _fail_all(self, detail: str) -> None:
        listeners = list(self._listeners.values())
        self._listeners.clear()
        for listener in listeners:
            listener.lost(detail)


def _spawn(end: socket.socket, device: int | None) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "service.rendering.worker", str(end.fileno()), "--server", str(os.getpid())]
    command += ["--log-level", str(logging.getLogger().getEffectiveLevel())]
    command += [] if device is None else ["--device", str(device)]
    # Its own process group: Ctrl-C in a terminal is for the server, which ends the renderer in good order.
    # stdout is the command line's, who may be read by a script that waits for its end.
    return subprocess.Popen(
        command,
        pass_fds=[end.fileno()],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        process_group=0,
    )


def _reap(process: subprocess.Popen[bytes], patience_s: float) -> None:
    try:
        process.wait(patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
