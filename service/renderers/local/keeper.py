"""Keeps one renderer's process alive: starts it, watches it, replaces it when it is lost, and says how it stands."""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Coroutine
from typing import Any, Protocol

from service.ipc import channel
from service.ipc.messages import FromRenderer, Heard, Ready, ToRenderer, Unable
from service.problems import Unavailable
from service.renderers.local.process import Cause, NoPlace, RendererProcess, Start
from service.renderers.protocol import State
from service.renderers.statistics import RendererLoad, Statistics
from service.system.background import Background, Died, reported

TRIES = 3  # starts in a row that end before rendering; then there is no renderer, and the reason is given
# Causes from outside, which never count as a failure to start.
BY_OTHERS: tuple[Cause, ...] = ("killed", "stopped", "node lost", "drained", "released")
BETWEEN_TRIES_S = 0.5
AFTER_KILLS_S = 5.0  # between starts of renderers that others kill as soon as they begin, at most
HOPELESS_S = 15.0  # between tries after that, while nobody waits


class Restarts:
    """Counts starts in a row that came to nothing: those that failed, and those that others ended."""

    def __init__(self) -> None:
        self.failures = self.shots = 0

    @property
    def hopeless(self) -> bool:
        return self.failures >= TRIES

    def succeeded(self) -> None:
        self.failures = self.shots = 0

    def lost(self, process: RendererProcess, cause: Cause) -> None:
        if process.ready:
            return
        # A process that was dying slowly may be killed at last by others.
        by_others = cause in BY_OTHERS and not process.unable
        self.failures += not by_others
        self.shots += by_others

    def pause_s(self, lived_s: float) -> float:
        """Seconds before the next start: more after each failure to start, or after kills in quick succession."""
        if self.hopeless:
            return HOPELESS_S
        after_kill_s = min(BETWEEN_TRIES_S * self.shots, AFTER_KILLS_S) - lived_s
        return max(BETWEEN_TRIES_S * self.failures, after_kill_s, 0.0)


LAST_WORDS_S = 5.0  # for a renderer that closed its end of the channel to exit, so that its exit code says why
WATCH_S = 0.5
AGAIN_S = 5.0  # between two attempts to start a process where the system refuses it
FAREWELL_S = 3.0  # for the renderer to end by itself; one slice on a slow machine, or a compilation
STARTING = "The renderer is starting."
CLOSING = "The server is shutting down."

log = logging.getLogger(__name__)


class ProcessEvents(Protocol):
    """Events of a keeper's process, on the event loop."""

    def received(self, message: Heard) -> None:
        """The process has sent this."""

    def began(self) -> None:
        """Another process has been started; messages reach it from now on."""

    def lost(self, process: RendererProcess, cause: Cause) -> None:
        """This process has ended, for this reason."""

    def given_up(self) -> None:
        """It was lost once more while it started, and the next attempt is some time away."""

    def changed(self) -> None:
        """The process is ready or lost, has to wait, or was given up."""


class Keeper:
    """For the event loop."""

    def __init__(
        self, id: str, start: Start, patience_s: float, statistics: Statistics, events: ProcessEvents
    ) -> None:
        """`id` names the renderer in the log; `patience_s` is how long it may be without progress."""
        self.detail = "The renderer has not been started."  # why there is none, where there is none
        self.waiting = ""  # what it waits for, where there is no place for the process
        self.driver: str | None = None  # of the process that was ready last; None: there was none
        self.process: RendererProcess | None = None
        self.restarts = Restarts()
        self._events = events
        self._id, self._begin_process, self._patience_s, self._statistics = id, start, patience_s, statistics
        self._ready: asyncio.Future[dict[str, Any]] | None = None
        self._lost_at: float | None = None
        self._chores = Background()
        self._draining = self._closed = False
        self._lifeline: tuple[int, int] | None = None  # a pipe: what outlives a renderer ends with its other end

    def start(self) -> None:
        if self._ready is None:
            self._ready = asyncio.get_running_loop().create_future()
            self._lifeline = os.pipe()
            self._begin()
            self.do("watchdog", self._watch())

    def drain(self) -> None:
        self._draining, self.detail = True, CLOSING

    async def stop(self) -> None:
        """End all chores; what is lost from now on is not replaced."""
        self.drain()
        self._closed = True
        await self._chores.close()

    async def end(self) -> None:
        """End the process, after `stop`."""
        process, self.process = self.process, None
        if process is not None:
            await process.end(FAREWELL_S)
        for end in self._lifeline or ():
            os.close(end)
        self._lifeline = None

    @property
    def state(self) -> State:
        if self._draining:
            return "draining"
        if self.process is not None and self.process.ready:
            return "ready"
        return "starting" if self._lost_at is None else "lost"

    @property
    def takes_tasks(self) -> bool:
        """True if it takes tasks; they wait while the process starts or is replaced."""
        return self._ready is not None and not self._draining and not self.restarts.hopeless

    @property
    def info(self) -> dict[str, Any] | None:
        ready = self._ready
        known = ready is not None and ready.done() and not self.restarts.hopeless
        return ready.result() if ready is not None and known else None

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        if self._ready is None or not self.takes_tasks:
            raise Unavailable(self.detail)
        try:
            async with asyncio.timeout(timeout_s):
                return await asyncio.shield(self._ready)
        except TimeoutError:
            raise Unavailable(self.waiting or STARTING) from None

    def send(self, message: ToRenderer) -> None:
        """Nothing happens where there is no process; it is told later what it needs."""
        if self.process is not None:
            self.process.link.send(message)

    def send_encoded(self, encoded: channel.Encoded) -> None:
        if self.process is not None:
            self.process.link.send_encoded(encoded)
        else:
            channel.discard(encoded)

    def do(self, what: str, work: Coroutine[Any, Any, None], died: Died | None = None) -> None:
        """Run a coroutine, which `stop` cancels; see Background."""
        self._chores.start(what, work, died)

    def _begin(self) -> None:
        lifeline = None if self._lifeline is None else self._lifeline[0]
        process: RendererProcess = self._begin_process(self._received, lambda: self._lose(process), lifeline)
        self.process = process
        self._events.began()

    def _received(self, message: FromRenderer | NoPlace) -> None:
        if isinstance(message, Ready):
            self._is_ready(message)
        elif isinstance(message, NoPlace):
            self._waits(message)
        elif isinstance(message, Unable):
            self.detail = message.detail
            if self.process is not None:
                self.process.unable = True
            log.error("could not start a renderer", {"renderer": self._id, "error": message.detail})
        else:
            self._events.received(message)

    def _waits(self, message: NoPlace) -> None:
        if message.detail != self.waiting:
            level = logging.WARNING if message.needed else logging.INFO
            log.log(level, "a renderer waits", {"renderer": self._id, "reason": message.detail})
        self.waiting = message.detail
        self._events.changed()

    def _is_ready(self, message: Ready) -> None:
        assert self.process is not None
        if self.process.ready and self.info is not None:
            self.info.update(message.info)
            return
        self.process.ready, self.driver, self.waiting = True, message.driver, ""
        self.restarts.succeeded()
        seconds = time.monotonic() - self.process.began
        log.info("renderer ready", {"renderer": self._id, "driver": self.driver, "seconds": round(seconds, 2)})
        if self._ready is not None and not self._ready.done():
            self._ready.set_result(message.info)
        if self._lost_at is not None:
            self._statistics.recovery_s.add(time.monotonic() - self._lost_at)
            self._lost_at = None
        self._events.changed()

    async def _watch(self) -> None:
        loop, pause_s = asyncio.get_running_loop(), min(WATCH_S, self._patience_s / 4)
        while True:
            began = loop.time()
            await asyncio.sleep(pause_s)
            late = loop.time() - began > 2 * pause_s  # then it is the server that was slow, and has not listened
            if self.process is not None:
                with reported("watchdog"):
                    self.process.watch(excused=late)

    def _lose(self, process: RendererProcess) -> None:
        """Replace a renderer whose end of the channel is closed."""
        if self._closed or process is not self.process:
            return
        self.process = None
        self._lost_at = self._lost_at or time.monotonic()
        if process.ready:
            if not self._draining:
                self.detail = "The renderer was lost."
            self._ready = asyncio.get_running_loop().create_future()
        self._events.changed()
        self.do("replacement of a renderer", self._replace(process), self._begin_later)

    def _begin_later(self, _: Exception) -> None:
        """An error of the server ended a replacement, or no process could be started."""
        if not self._closed:
            asyncio.get_running_loop().call_later(AGAIN_S, self._begin_if_lost)

    def _begin_if_lost(self) -> None:
        if not self._closed and self.process is None:
            with reported("replacement of a renderer", self._begin_later):
                self._begin()

    async def _replace(self, process: RendererProcess) -> None:
        cause = await process.end(LAST_WORDS_S)
        self.restarts.lost(process, cause)
        self._statistics.restarts[cause] += 1
        self._statistics.load = RendererLoad()  # of its memory as well, which others may wait for
        level = logging.INFO if cause == "released" else logging.ERROR
        log.log(
            level,
            "renderer lost",
            {
                "renderer": self._id,
                "cause": cause,
                "lived_s": round(process.lived_s, 1),
                "failures": self.restarts.failures,
            },
        )
        self._events.lost(process, cause)
        if self.restarts.hopeless:
            self._events.given_up()
            self._events.changed()
            if self._ready is not None and not self._ready.done():
                self._ready.set_exception(Unavailable(self.detail))
                self._ready.exception()  # looked at: perhaps nobody waits, and asyncio would complain
        await asyncio.sleep(self.restarts.pause_s(process.lived_s))
        if self.restarts.hopeless:
            self._ready = asyncio.get_running_loop().create_future()
        self._begin()
