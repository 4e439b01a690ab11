"""The Ray actor: it runs the renderer's process on its node, and passes messages on in both directions."""

from __future__ import annotations

import asyncio
import hashlib
import os
import socket
from collections import deque
from dataclasses import replace
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from service.config import cores
from service.ipc import channel
from service.ipc.messages import FromRenderer, Ready, SceneData, ToRenderer, Update
from service.renderers.local.process import Options, Process
from service.renderers.pool.devices import listed, of_cuda
from service.renderers.ray.control import ProcessEnded
from service.system.background import Background, reported, within
from service.system.memory import MemoryBudget

ROOT = Path(__file__).parents[3]
# All that decides about a picture's bits and about what messages mean.
FOLDERS = ("gpu", "shaders", "service/ipc", "service/renderers", "service/worker")
SUFFIXES = {".py", ".glsl", ".comp"}


@cache
def version() -> str:
    """The version of Sunbox with a digest of its code: a checkout keeps its version while its code changes."""
    digest = hashlib.sha256()
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in SUFFIXES:
                digest.update(f"{path.relative_to(ROOT)}\0".encode() + path.read_bytes() + b"\0")
    return f"{metadata.version('sunbox')}+{digest.hexdigest()[:12]}"


def difference(host: str, there: str) -> str | None:
    """The error about a node with another version than this process has; None where they are the same."""
    if there == version():
        return None
    return (
        f"SUNBOX_RAY: host {host} has Sunbox {there}, and this server has {version()}. "
        "Install the same Sunbox on all nodes of the Ray cluster, and restart Ray there."
    )


LAST_WORDS_S = 5.0  # for a renderer that closed its end of the channel to exit, so that its exit code says why
WATCH_S = 0.5
SILENCE_S = 5.0  # the longest that `hear` waits: its answer also says that the node lives
MOST_WAITING = 64  # messages that wait to be fetched; the renderer waits when there are more


class Renderer:
    """Made an actor by `ray.remote`. Its methods run on one event loop."""

    def __init__(self) -> None:
        self._process: Process | None = None
        self._outgoing: deque[FromRenderer | ProcessEnded] = deque()
        self._news = asyncio.Event()
        self._paused = False
        self._chores = Background()
        self._lifeline: tuple[int, int] | None = None  # a pipe: what outlives a renderer ends with its other end

    async def describe(self) -> dict[str, str]:
        """Where this actor runs, and with which code; also understood by other versions of the server."""
        return {"host": socket.gethostname(), "version": version()}

    async def begin(self, options: dict[str, Any], threads: int | None) -> None:
        """Start a renderer, in place of the last one; `threads`: the node's processors that it has for rendering."""
        await self.end(0.0)
        self._news.set()  # for a call that still waits for what the last one says
        self._outgoing, self._news, self._paused = deque(), asyncio.Event(), False
        self._lifeline = self._lifeline or os.pipe()
        share = 1.0 if threads is None else min(1.0, threads / cores())
        memory = int(MemoryBudget().limit * share)
        device = None if threads is not None else await asyncio.to_thread(_gpu)
        given = Options(device=device, software=threads is not None, cores=threads, host_memory=memory, **options)
        process = Process(
            given, lambda message: self._received(process, message), lambda: self._lose(process), self._lifeline[0]
        )
        self._process = process
        self._chores.start("watchdog", self._watch(process, min(WATCH_S, given.patience_s / 4)))

    async def take(self, messages: list[ToRenderer]) -> None:
        """Pass small messages on, in order."""
        for message in messages:
            if self._process is not None:
                self._process.link.send(message)

    async def take_large(self, message: ToRenderer, scene: SceneData | None) -> None:
        """Pass on a message with large arrays, which lie in the node's object store; `scene`: of an Update."""
        if isinstance(message, Update) and scene is not None:
            message = replace(message, scene=scene)
        process = self._process
        encoded = await asyncio.to_thread(channel.encode, message)
        if process is not None and process is self._process:
            process.link.send_encoded(encoded)
        else:
            channel.discard(encoded)

    async def hear(self) -> list[FromRenderer | ProcessEnded]:
        """The renderer's messages since the last call, as soon as there are some; an empty list after a while."""
        outgoing, news = self._outgoing, self._news
        if not outgoing:
            news.clear()
            await within(news, SILENCE_S)
        heard = list(outgoing)
        outgoing.clear()
        if outgoing is self._outgoing and self._paused and self._process is not None:
            self._paused = False
            self._process.link.resume_reading()
        return heard

    async def end(self, patience_s: float) -> None:
        """Let the renderer end within that time, or kill it."""
        process, self._process = self._process, None
        if process is not None:
            await process.end(patience_s)

    def _received(self, process: Process, message: FromRenderer) -> None:
        if process is not self._process:
            return
        if isinstance(message, Ready):
            message = replace(message, info={**message.info, "host": socket.gethostname()})
        self._outgoing.append(message)
        self._news.set()
        if len(self._outgoing) >= MOST_WAITING and not self._paused:
            self._paused = True
            process.link.pause_reading()

    def _lose(self, process: Process) -> None:
        if process is self._process:
            self._process = None
            self._chores.start("end of a renderer", self._bury(process, self._outgoing, self._news))

    async def _bury(
        self, process: Process, outgoing: deque[FromRenderer | ProcessEnded], news: asyncio.Event
    ) -> None:
        cause = await process.end(LAST_WORDS_S)
        outgoing.append(ProcessEnded(cause, process.task))
        news.set()

    async def _watch(self, process: Process, pause_s: float) -> None:
        loop = asyncio.get_running_loop()
        while process is self._process:
            began = loop.time()
            await asyncio.sleep(pause_s)
            if process is self._process:
                # A renderer whose messages are not fetched waits, and is not at fault.
                with reported("watchdog"):
                    process.watch(excused=self._paused or loop.time() - began > 2 * pause_s)


def _gpu() -> int | None:
    """EGL's number of the GPU that Ray gave to this actor; None where it gave none. Raises NoDevices."""
    import ray

    ids = ray.get_gpu_ids()
    return of_cuda(str(ids[0]), listed()) if ids else None
