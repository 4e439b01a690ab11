"""One render asked for over REST: its scene, its progress and its picture."""

from __future__ import annotations

import asyncio
import logging
import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from service.ipc.messages import (
    Checkpoint,
    Done,
    Failed,
    FromRenderer,
    Image,
    Loaded,
    Progress,
    Progressed,
    Restore,
    View,
)
from service.ipc.orders import Stop, TakeCheckpoint
from service.pack import Packed
from service.problems import Conflict, Gone, Internal, ServiceError, Unavailable, answer
from service.renderers.protocol import Renderers
from service.renders.followers import Changes
from service.renders.recorder import Recorder, Writing
from service.renders.resident import Resident
from service.renders.scene import Load, RenderScene
from service.renders.status import error_of, status
from service.renders.store.record import Order, Outcome, State
from service.renders.waiting import first_of, within
from service.system.memory import MemoryBudget

PATIENCE_S = 30.0  # for the first sample after the renderer was lost
GIVING_WAY_S = 10.0  # for the checkpoint of a render that gives its slot to another one
ASK_AGAIN_S = 5  # for a client whose picture was lost with a renderer

log = logging.getLogger(__name__)


class Job(Resident):
    """A render, on the event loop.

    With a `recorder` it outlives the server, and its picture comes back from the disk when somebody looks at it.
    Without one it keeps its picture in the renderer until `release`."""

    def __init__(
        self,
        renderers: Renderers,
        order: Order,
        load: Load,
        document: bytes | None = None,
        packed: Packed | None = None,
        outcome: Outcome | None = None,
        budget: MemoryBudget | None = None,
    ) -> None:
        """The folded `document` may be left out where there is a recorder. Raises TooLarge for a render that never
        fits into the `budget`."""
        scene = RenderScene(order.settings, load, packed, budget)
        super().__init__(renderers, order, outcome or Outcome(), scene, document)
        self.ended_at = 0.0  # by the monotonic clock, once it is finished
        self._over = asyncio.Event()  # finished, or the server ends
        self._lost = asyncio.Event()  # nothing renders any more
        self._gave_way = asyncio.Event()
        self._gives_way = False  # its checkpoint is being stored for that; it may go on
        self._started = False  # this server began it, which is stored
        self.changes = Changes[Job]()
        self._least_samples = 0  # of the checkpoint that it goes on from: the renderer may report fewer before that
        self._ending: Writing | None = None
        self._sampled = asyncio.Event()  # cleared while there are no samples any more, the renderer having been lost
        self._sampled.set()
        if self.outcome.state in ("queued", "running"):
            self.outcome = replace(self.outcome, state="queued")
        else:
            self._error = self.outcome.error
            self._finish()

    async def run(self) -> None:
        """Render until it has ended, however it ends, or until the server ends.

        A stored one returns unfinished as well, without its memory, where it has to go back in line: it gave way to
        another render, or it `waits` for memory, for the disk, or for a renderer.
        """
        try:
            await self._begin()
            self.waits = False
            await first_of(self._over, self._lost, self._gave_way)
            if self._lost.is_set():
                self.wait(Unavailable("No renderer could be started."))
        except ServiceError as error:
            if isinstance(error, Unavailable) and self.recorder is not None:
                self.wait(error)
            else:
                self._fail(error)
        except Exception:
            log.exception("could not begin a render id=%s", self.id[:6])
            self._fail(Internal("The server made a mistake; its log says which."))
        if self._over.is_set() or not (self.waits or self._gave_way.is_set()):
            await self._over.wait()
            return
        if not self._shown:
            self.release()
        if self._gave_way.is_set():
            self._reads.answer_all(Unavailable("The render has just given way to another one: ask again.", 1))
        self.outcome = replace(self.outcome, state="queued")
        self._wake()

    @property
    def can_give_way(self) -> bool:
        """Whether another render may have its slot: it has got on since it began, and its samples can be stored."""
        runs = self._task is not None and self._ending is None and not (self._over.is_set() or self._gives_way)
        got_on = self.state == "running" and self.outcome.progress.samples > self._least_samples
        return self.recorder is not None and runs and got_on

    async def give_way(self) -> bool:
        """Store the samples so far and have `run` return, to go on later to the same bits. Whether it does: not where
        the render ends meanwhile, or the disk fails."""
        recorder, asked = self.recorder, self.outcome.progress
        if recorder is None or self._task is None:
            return False
        take = partial(self.renderers.send, TakeCheckpoint(self._task))
        self._gives_way = True
        stored = await recorder.store_now(take, asked.samples, GIVING_WAY_S)
        self._gives_way = False
        if not stored or self._task is None or self._over.is_set() or self._ending is not None:
            return False
        self.began, self.outcome = True, replace(self.outcome, progress=recorder.reached)
        self._gave_way.set()
        return True

    def cancel(self) -> None:
        """Stop at once; the image so far stays."""
        if self.finished.is_set() or self._ending is not None:
            return
        self._scene.set_aside()
        self.outcome = replace(self.outcome, state="cancelled", ended_at=time.time())
        if self._task is not None:
            self.renderers.send(Stop(self._task))
        self._finish()
        if self.recorder is not None:
            self._ending = asyncio.create_task(self.recorder.note(self.outcome))
            self.recorder.whole = self._task is None or self._shown

    async def recorded(self) -> None:
        """Return when its end is on the disk."""
        if self._ending is not None:
            await asyncio.shield(self._ending)

    async def close(self) -> None:
        """The server ends: have the last samples stored, and leave the render for the next start."""
        self._over.set()
        self._wake()
        if self.recorder is not None and self.state == "running" and self._task is not None:
            await self.recorder.store_now(partial(self.renderers.send, TakeCheckpoint(self._task)))
        await self.recorded()

    async def settled(self) -> None:
        """Return when the render is finished, or the server ends."""
        await self._over.wait()

    async def changed(self) -> bool:
        """Return at the next change of the status: True; or when the server ends, which leaves it as it is."""
        await self.changes.next()
        return self.finished.is_set() or not self._over.is_set()

    def status(self, kernel: bool = False) -> dict[str, Any]:
        return status(self.order, self.outcome, self.renderers.tracing(self._task), kernel)

    async def image(self, view: View) -> tuple[np.ndarray, Progress]:
        """The picture so far. Raises Conflict before the first sample, and the render's own error where it failed."""
        if self._error is not None:
            raise self._error
        self._looking += 1
        try:
            await within(self._sampled, PATIENCE_S)
            await self._bring_back()  # last, as the render may go on at any moment, with another task
            if self._task is None:
                raise self._error or Conflict("There is no sample yet.")
            image = await self._reads.ask(view, self._task, self.renderers.send)
        finally:
            self._looking -= 1
        if image.pixels is None:
            raise Conflict("There is no sample yet.")
        return image.pixels, image.progress

    def heard(self, message: FromRenderer) -> None:
        if isinstance(message, Image):
            self._reads.answer(message.serial, message)
        elif isinstance(message, Failed) and message.serial is not None:
            self._reads.answer(message.serial, error_of(message))
        elif self._shown:
            if isinstance(message, Failed):
                self._reads.answer_all(error_of(message))
                self.release()
        elif isinstance(message, Loaded):
            self.outcome = self.outcome.loaded(message)
        elif isinstance(message, Progressed):
            if message.progress.samples >= self._least_samples and not self._gives_way:
                self._progressed(message.progress)
        elif isinstance(message, Checkpoint):
            if self.recorder is not None and not self.finished.is_set():
                self.recorder.checkpoint(message)
        elif isinstance(message, Done):
            self._end(message)
        elif isinstance(message, Failed):
            self._fail(error_of(message))
        self._wake()

    def again(self) -> None:
        """Another renderer begins the render again; a cancelled one has no image until that has samples."""
        self._least_samples = 0
        if self.outcome.progress.samples:
            self._sampled.clear()
        if not self.finished.is_set():
            self.outcome = replace(self.outcome, progress=Progress())

    def lost(self, detail: str) -> None:
        self._task, shown = None, self._shown
        self._shown = False
        self._memory.release()
        if shown or (self.recorder is not None and (self.recorder.whole or self._over.is_set())):
            self._reads.answer_all(Unavailable("The renderer was lost: ask again.", ASK_AGAIN_S))
        elif self.recorder is not None and self.renderers.hopeless and not self.finished.is_set():
            self._lost.set()  # which was not its fault: it goes on when something renders again
        elif self.finished.is_set():
            self._forget(Gone(detail))
        else:
            self._fail(Internal(detail))

    async def _begin(self) -> None:
        """Raises what loading the scene raises, and Unavailable where nothing renders."""
        self._lost.clear()
        self._gave_way.clear()
        if self.outcome.started_at is None and not self.finished.is_set():
            self.outcome = replace(self.outcome, started_at=time.time())
        if self.recorder is not None and not self._started:
            starts = await self.recorder.start(self.outcome)
            self._started, self.outcome = True, replace(self.outcome, starts=starts)  # it may be cancelled by now
        async with self._loading:
            try:
                packed = None if self._over.is_set() else await self._scene.load(self.document)
                if packed is None or self._over.is_set():
                    return
                self._memory.hold()
                self._drop()  # somebody may look at its checkpoint
                self._task = task = self.renderers.open(self, "render", self.owner)
            finally:
                if self._task is None:
                    self._memory.release()
            restore = await self._checkpoint(task)
            await self._send_scene(task, packed, restore)
        if self.finished.is_set():  # cancelled meanwhile: that message went ahead of the scene
            self.renderers.send(Stop(task))

    async def _checkpoint(self, task: int) -> Restore | None:
        restore = None
        if self.recorder is not None and self.recorder.store.has(self.id, "checkpoint"):
            restore = await self.recorder.store.read(self.id, "checkpoint", task)
        progress = Progress() if restore is None else restore.progress
        self.outcome, self._least_samples = replace(self.outcome, progress=progress), progress.samples
        return restore

    def _progressed(self, progress: Progress) -> None:
        self.outcome = replace(self.outcome, progress=progress)
        if progress.samples:
            self._sampled.set()

    def _end(self, done: Done) -> None:
        self._progressed(done.progress)
        self._sampled.set()
        self.outcome = replace(self.outcome, reason=done.reason).warned(done.warnings)
        if not self.finished.is_set():
            state: State = "cancelled" if done.reason == "stopped" else "done"
            self._end_with(replace(self.outcome, state=state, ended_at=time.time()), done)
        elif self.recorder is not None:
            self._end_with(self.outcome, done)

    def _end_with(self, outcome: Outcome, done: Done | None = None) -> None:
        """Finish, where it is stored once that is on the disk."""
        if self.recorder is None:
            self.outcome = outcome
            self._finish()
        else:
            self._ending = asyncio.create_task(self._record_end(self.recorder, self._ending, outcome, done))

    async def _record_end(self, to: Recorder, before: Writing | None, outcome: Outcome, done: Done | None) -> None:
        if before is not None:
            await before
        await to.end(outcome, done)
        if not self.finished.is_set():
            self.outcome = outcome
            self._finish()

    def _finish(self) -> None:
        self.ended_at = time.monotonic() - max(0.0, time.time() - (self.outcome.ended_at or time.time()))
        self.finished.set()
        self._over.set()
        if self._task is None:
            self._memory.release()
        self._wake()

    def _fail(self, error: ServiceError) -> None:
        self.renderers.statistics.errors[answer(error).type] += 1
        self._forget(error)
        self._end_with(self.outcome.failed(error, time.time()))

    def _forget(self, error: ServiceError) -> None:
        self._error = error
        self._scene.set_aside()
        self._memory.release()
        self._sampled.set()
        self._reads.answer_all(error)

    def _wake(self) -> None:
        self.changes.tell(self)
