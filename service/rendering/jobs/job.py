"""One render asked for over REST: its scene, its progress and its picture."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import numpy as np

from service.memory import MemoryBudget
from service.pack import Packed
from service.problems import Conflict, Gone, Internal, ServiceError, Unavailable, answer
from service.rendering.ipc.kernel_messages import KernelMeasured, MeasureKernel
from service.rendering.ipc.messages import (
    Checkpoint,
    Done,
    Failed,
    FromRenderer,
    Image,
    Loaded,
    Progress,
    Progressed,
    Restore,
    Update,
    View,
)
from service.rendering.ipc.orders import Stop, TakeCheckpoint
from service.rendering.jobs.followers import Changes
from service.rendering.jobs.memory import RenderMemory
from service.rendering.jobs.ordered import Ordered
from service.rendering.jobs.reads import Reads
from service.rendering.jobs.recorder import Recorder, Writing
from service.rendering.jobs.status import KernelQuestion, error_of, status
from service.rendering.jobs.store.record import Order, Outcome, State
from service.rendering.jobs.waiting import first_of, within
from service.rendering.renderers import Renderers
from service.rendering.requests.request_reader import stop_rule

PATIENCE_S = 30.0  # for the first sample after the renderer was lost
AGAIN_S = 5.0  # between two attempts to begin a render where nothing renders, or the disk fails

log = logging.getLogger(__name__)


class Job(Ordered):
    """A render, on the event loop.

    With a `recorder` it outlives the server, and its picture comes back from the disk when somebody looks at it.
    Without one it keeps its picture in the renderer until `release`."""

    recorder: Recorder | None = None
    number = 0  # rises in the order of arrival

    def __init__(
        self,
        renderers: Renderers,
        order: Order,
        load: Callable[[bytes], Awaitable[Packed]],
        document: bytes | None = None,
        packed: Packed | None = None,
        outcome: Outcome | None = None,
        budget: MemoryBudget | None = None,
    ) -> None:
        """`load` packs the scene of a folded `document`, which may be left out where there is a recorder. Raises
        TooLarge for a render that never fits into the `budget`."""
        super().__init__(order, outcome or Outcome())
        self.began = self.outcome.state == "running"  # when the server ended before
        self.ended_at = 0.0  # by the monotonic clock, once it is finished
        self.finished = asyncio.Event()
        self._memory = RenderMemory(order.settings, budget)
        if packed is not None:
            self._memory.packed(packed)
            self._memory.check()
        self._over = asyncio.Event()  # finished, or the server ends
        self._lost = asyncio.Event()  # nothing renders any more
        self.changes = Changes[Job]()
        self.renderers = renderers
        self._load = load
        self._document = document
        self._packed = packed
        self._kernel = KernelQuestion()
        self._error: ServiceError | None = None
        self._task: int | None = None
        self._shown = False  # the task only shows what was stored, and renders nothing
        self._loading = asyncio.Lock()
        self._least_samples = 0  # of the checkpoint that it goes on from: the renderer may report fewer before that
        self._reads = Reads()
        self._looking = 0  # how many wait for an image
        self._ending: Writing | None = None
        self._sampled = asyncio.Event()  # cleared while there are no samples any more, the renderer having been lost
        self._sampled.set()
        if self.outcome.state in ("queued", "running"):
            self.outcome = replace(self.outcome, state="queued")
        else:
            self._error = self.outcome.error
            self._finish()

    @property
    def resident_bytes(self) -> int:
        """About the memory that its scene and its picture take while the renderer has them; 0 otherwise."""
        return 0 if self._task is None else self._memory.bytes

    @property
    def size(self) -> int:
        """The bytes that it keeps: on the disk, or in memory where it is not stored."""
        if self.recorder is not None and self.recorder.whole:
            return self.recorder.store.size(self.order)
        return self.resident_bytes + self.order.bytes

    def set_aside(self) -> None:
        """Forget the packed scene: it waits as a document, and is packed again when its turn comes."""
        self._packed = None

    def forget_document(self) -> None:
        """The store has it from now on."""
        self._document = None

    async def document(self) -> bytes:
        """The folded document. Raises Unavailable, Internal."""
        if self._document is not None:
            return self._document
        assert self.recorder is not None
        return await self.recorder.store.document(self.recorder.number)

    async def run(self) -> None:
        """Take the render from queued to finished, however it ends; return early when the server ends."""
        try:
            if self.recorder is not None:
                starts = await self.recorder.start(self.outcome)
                self.outcome = replace(self.outcome, starts=starts)  # which may have been cancelled meanwhile
            while not await self._ended():
                self.outcome = replace(self.outcome, state="queued")
                await within(self._over, AGAIN_S)
        except ServiceError as error:
            self._fail(error)
        except Exception:
            log.exception("could not begin a render id=%s", self.id[:6])
            self._fail(Internal("The server made a mistake; its log says which."))
        await self._over.wait()

    def cancel(self) -> None:
        """Stop at once; the image so far stays."""
        if self.finished.is_set() or self._ending is not None:
            return
        self._packed = None
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
            self.recorder.expect()
            self.renderers.send(TakeCheckpoint(self._task))
            await self.recorder.checkpointed()
        await self.recorded()

    def release(self) -> None:
        """Forget the picture in the renderer."""
        if self._task is not None:
            self.renderers.drop(self._task)
            self._task, self._shown = None, False
        self._memory.release()

    def rest(self) -> bool:
        """Release what can be brought back from the disk, if nobody waits for it; whether that was possible."""
        possible = self.recorder is not None and self.recorder.whole and self.finished.is_set()
        possible = possible and not self._reads and not self._looking and not self._kernel.awaited
        if possible:
            self.release()
        return possible

    async def measure_kernel(self) -> None:
        """Have the renderer measure what the kernel saves, when it has nothing else to do."""
        if self._error is None and self._kernel.ask():
            if self.finished.is_set():
                with contextlib.suppress(Conflict):
                    await self._bring_back()
            if self.outcome.kernel is not None and self._task is not None:
                self.renderers.send(MeasureKernel(self._task))

    async def settled(self, measured: bool) -> None:
        """Return when the render is finished (`measured`: its kernel measured, too), or the server ends."""
        await self._over.wait()
        if measured and self.finished.is_set() and self.outcome.kernel is not None and self._task is not None:
            await self._kernel.answered.wait()

    async def changed(self) -> bool:
        """Return at the next change of the status: True; or when the server ends, which leaves it as it is."""
        await self.changes.next()
        return self.finished.is_set() or not self._over.is_set()

    def status(self, kernel: bool = False) -> dict[str, Any]:
        known = self._kernel.known if kernel else None
        return status(self.order, self.outcome, self.renderers.tracing(self._task), known)

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
        elif isinstance(message, KernelMeasured):
            self._kernel.answer(message)
        elif isinstance(message, Failed) and message.serial is not None:
            self._reads.answer(message.serial, error_of(message))
        elif self._shown:
            if isinstance(message, Failed):
                self._reads.answer_all(error_of(message))
                self.release()
        elif isinstance(message, Loaded):
            self.outcome = self.outcome.loaded(message)
            if self._kernel.awaited and self._task is not None:
                self.renderers.send(MeasureKernel(self._task))
        elif isinstance(message, Progressed):
            if message.progress.samples >= self._least_samples:
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
            self._reads.answer_all(Unavailable("The renderer was lost: ask again.", int(AGAIN_S)))
        elif self.recorder is not None and self.renderers.hopeless and not self.finished.is_set():
            self._lost.set()  # which was not its fault: it goes on when something renders again
        elif self.finished.is_set():
            self._forget(Gone(detail))
        else:
            self._fail(Internal(detail))

    async def _ended(self) -> bool:
        """Render; False: something is missing that may come back. Raises what loading the scene raises."""
        self._lost.clear()
        try:
            await self._begin()
        except Unavailable as error:
            if self.recorder is None:
                raise
            if not self.waits:  # it is tried again every few seconds
                log.warning("a render has to wait id=%s reason=%s", self.id[:6], error)
            self.waits = True
        else:
            self.waits = False
            await first_of(self._over, self._lost)
        return self._over.is_set()

    async def _begin(self) -> None:
        """Raises what loading the scene raises, and Unavailable where nothing renders."""
        packed, self._packed = self._packed, None
        self._memory.hold()  # as far as it is known, so that no scene is packed for nothing
        if packed is None:
            packed = await self._load(await self.document())
        self._memory.packed(packed)
        async with self._loading:
            self.release()
            if self._over.is_set():
                return
            self._memory.hold()
            self._task = task = self.renderers.open(self, "render", self.owner)
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

    async def _bring_back(self) -> None:
        """Have the renderer show what was stored last. Raises Conflict where nothing was."""
        async with self._loading:
            recorder = self.recorder
            if self._task is not None:
                return
            if recorder is None or (kind := recorder.store.latest(self.id)) is None:
                raise Conflict("There is no sample yet.")
            packed = await self._load(await self.document())
            self._memory.packed(packed)
            self._memory.hold()
            self._task = task = self.renderers.open(self, "render", self.owner)
            self._shown = True
            try:
                restore = await recorder.store.read(self.id, kind, task)
                if restore is None:
                    raise Internal("The stored picture is damaged.")
                await self._send_scene(task, packed, replace(restore, reason=restore.reason or "stopped"))
            except BaseException:  # the client may go away meanwhile, too
                self.release()
                raise

    async def _send_scene(self, task: int, packed: Packed, restore: Restore | None) -> None:
        settings = self.settings
        update = Update(task, 1, packed.arrays, settings.for_gpu(), stop_rule(settings), denoise=settings.denoise)
        await self.renderers.send_scene(update, restore)
        self._reads.ask_again(task, self.renderers.send)

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
        self._error, self._packed = error, None
        self._memory.release()
        self._sampled.set()
        self._kernel.answered.set()
        self._reads.answer_all(error)

    def _wake(self) -> None:
        self.changes.tell(self)
