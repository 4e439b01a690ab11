"""Renderers that answer for a render as a test says, and a disk that can be full."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np

from service.ipc.messages import Checkpoint, Done, Image, Progress, Read, Reason, Restore, SavedPicture, Update
from service.ipc.task_control import Stop, TakeCheckpoint
from service.problems import Unavailable
from service.server.renders.store.store import RenderStore
from tests.service.rendering.fakes import Renderers


def saved(samples: int) -> SavedPicture:
    return SavedPicture(samples, (0, 0, 0), [np.full(64, samples % 256, np.uint8)])


class Disk(RenderStore):
    """`full`: whatever is written is refused. `busy`: calls that are under way."""

    full, busy = False, 0


def _counted(name: str) -> Callable[..., Awaitable[Any]]:
    async def method(self: Disk, *args: Any, **values: Any) -> Any:
        if self.full and name in ("update", "write"):
            raise Unavailable("The disk is full.")
        self.busy += 1
        try:
            return await getattr(RenderStore, name)(self, *args, **values)
        finally:
            self.busy -= 1

    return method


for _name in ("update", "write", "read", "delete", "document", "free"):
    setattr(Disk, _name, _counted(_name))


class Farm(Renderers):
    """Renderers that answer readings and orders for checkpoints; samples come as the test says."""

    def __init__(self) -> None:
        super().__init__()
        self.listeners, self.samples, self.kept = dict[int, Any](), dict[int, int](), dict[int, int]()
        self.stopped = set[int]()

    def open(self, listener: Any, kind: str, client: str) -> int:
        task = super().open(listener, kind, client)
        self.listeners[task] = listener
        return task

    def drop(self, task: int) -> None:
        self.listeners.pop(task, None)

    def send(self, message: Any) -> None:
        if message.task not in self.listeners:
            return
        if isinstance(message, Stop):
            self.stopped.add(message.task)
        elif isinstance(message, Read):
            asyncio.get_running_loop().call_soon(self._read, message)
        elif isinstance(message, TakeCheckpoint):
            asyncio.get_running_loop().call_soon(self.checkpoint, message.task)

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        if update.task in self.listeners:
            self.samples[update.task] = restore.progress.samples if restore is not None else 0
            self.kept[update.task] = self.samples[update.task]

    def say(self, message: Any) -> None:
        if message.task in self.listeners:
            self.listeners[message.task].heard(message)

    def checkpoint(self, task: int) -> None:
        if samples := self.samples.get(task, 0):
            self.kept[task] = samples
            self.say(Checkpoint(task, 1, Progress(samples, None, 1.0), saved(samples)))

    def done(self, task: int, reason: Reason) -> None:
        samples = self.samples[task]
        picture = saved(samples) if samples else None
        self.say(Done(task, 1, reason, Progress(samples, None, 1.0), [], picture))

    def lose(self) -> None:
        """No process can be started any more."""
        self.hopeless = True
        for task in list(self.listeners):
            self.listeners.pop(task).lost("No renderer could be started.")

    def stored(self, task: int, picture: SavedPicture, read: Callable[[], Restore]) -> None: ...

    def _read(self, message: Read) -> None:
        samples = self.samples.get(message.task, 0)
        pixels = np.full((4, 4, 4), samples, np.float32) if samples else None
        self.say(Image(message.task, message.serial, pixels, Progress(samples)))
