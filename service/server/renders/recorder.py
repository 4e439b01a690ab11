"""Writes what becomes of one render to the store, in order; of its checkpoints the newest."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial

from service.ipc.messages import Checkpoint, Done, Progress, Restore
from service.ipc.task_control import CheckpointStored
from service.problems import Internal, ServiceError
from service.renderers.protocol import Renderers
from service.server.renders.store.pictures import Kind
from service.server.renders.store.record import Outcome
from service.server.renders.store.store import RenderStore
from service.system.background import Background

log = logging.getLogger(__name__)

MOST_STARTS = 5  # of servers that ended before the first checkpoint: the render may be what ended them

Writing = asyncio.Task[None]


class Recorder:
    """For the event loop. `whole` says that everything about an ended render is on the disk."""

    def __init__(
        self,
        store: RenderStore,
        number: int,
        id: str,
        whole: bool = False,
        renderers: Renderers | None = None,
        owner: str = "",
    ) -> None:
        """`renderers` learn where the pictures that they keep can be read from. Turns on the disk go round the
        owners."""
        self.store = store
        self._renderers = renderers
        self.number = number
        self.whole = whole
        self.id = id
        self._owner = owner
        self.reached = Progress()  # of the last checkpoint that is on the disk
        self._checkpoint: Restore | None = None  # to be written next ...
        self._came_at = 0.0  # ... and when it came
        self._tasks = Background()
        self._writing: Writing | None = None
        self._written = asyncio.Event()  # set by the next checkpoint that is on the disk
        self._closed = False

    def checkpoint(self, checkpoint: Checkpoint) -> None:
        """Write a checkpoint as soon as the one before it is on the disk; if another one comes first, that one."""
        self._checkpoint = Restore(checkpoint.task, 1, checkpoint.saved, None, checkpoint.progress)
        self._came_at = time.monotonic()
        if self._writing is None and not self._closed:
            self._writing = self._tasks.start("checkpoints of a render", self._write_checkpoints(), self._died)

    async def store_now(self, take: Callable[[], None], samples: int = 0, patience_s: float | None = None) -> bool:
        """Have a checkpoint on the disk that `take` asks the renderer for, with at least so many samples.

        False where the render ends meanwhile, or that takes longer than `patience_s`."""
        with suppress(TimeoutError):
            async with asyncio.timeout(patience_s):
                while not self._closed:
                    self._written.clear()
                    take()
                    await self._written.wait()
                    if self.reached.samples >= samples:  # one from before may just have been being written
                        return not self._closed
        return False

    async def start(self, outcome: Outcome) -> int:
        """Write that this server begins to render it; the number of servers that did. Raises Internal where others
        ended again and again by then."""
        if outcome.starts >= MOST_STARTS and not outcome.progress.elapsed_s:
            raise Internal(f"The server ended {outcome.starts} times while this render was being prepared.")
        starts = outcome.starts + 1
        await self.note(replace(outcome, starts=starts, state="running"))
        return starts

    async def note(self, outcome: Outcome) -> None:
        """Write how far it is. Where that cannot be written, the next attempt counts."""
        try:
            await self.store.update(self.number, outcome)
        except Exception as error:
            self._failed("state", error)

    async def end(self, outcome: Outcome, done: Done | None) -> bool:
        """Write how it ended; whether that is on the disk. If not, the next start goes on from a checkpoint."""
        await self.close()
        picture = None
        if done is not None and done.saved is not None:
            picture = Restore(done.task, 1, done.saved, done.reason, done.progress)
        try:
            if picture is not None:
                await self.store.write(self.id, "picture", picture, self._owner)
            await self.store.update(self.number, outcome)
            if picture is not None:
                await self.store.delete(self.id, "checkpoint")
                self._let_go("picture", picture)
        except Exception as error:  # whatever it is, the render ends
            self._failed("picture", error)
            return False
        self.whole = True
        return True

    async def close(self) -> None:
        """Write no more checkpoints; return when the last one is written."""
        self._closed, self._checkpoint = True, None
        self._written.set()
        if self._writing is not None:
            with suppress(asyncio.CancelledError):
                await self._writing

    def _died(self, error: Exception) -> None:
        """The next checkpoint is written all the same."""
        self._writing = None
        self._failed("checkpoint", error)

    async def _write_checkpoints(self) -> None:
        while (restore := self._checkpoint) is not None:
            self._checkpoint = None
            last, came_at = [restore], self._came_at
            try:
                await self.store.write(self.id, "checkpoint", restore, self._owner)
                self.reached = restore.progress
                self._written.set()
                if self._renderers is not None:
                    self._renderers.send(CheckpointStored(restore.task, time.monotonic() - came_at))
                self._let_go("checkpoint", restore)
            except Exception as error:
                self._failed("checkpoint", error)
            del restore
            await self.store.free(last)
        self._writing = None

    def _let_go(self, kind: Kind, restore: Restore) -> None:
        """The renderers' copy of a picture is read from the disk from now on."""
        if self._renderers is not None:
            read = partial(self.store.read_now, self.id, kind, restore.task)
            self._renderers.stored(restore.task, restore.saved, read)

    def _failed(self, what: str, error: Exception) -> None:
        self.store.failures += 1
        unexpected = not isinstance(error, ServiceError)
        log.warning(
            f"could not store the {what} of a render", {"id": self.id[:6], "error": error}, exc_info=unexpected
        )
