"""One render asked for over REST: its states, its task with a renderer, and its end."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, Protocol, runtime_checkable
from weakref import WeakValueDictionary

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
from service.ipc.task_control import Stop, TakeCheckpoint
from service.pack import Packed
from service.problems import MISTAKE, Gone, Internal, ServiceError, Unavailable, answer
from service.renderers.protocol import Listener, Renderers
from service.server.renders.followers import Changes
from service.server.renders.recorder import Recorder, Writing
from service.server.renders.scene import Load, PackedScenes, RenderScene
from service.server.renders.status import (
    Ended,
    Loading,
    PictureAt,
    Queued,
    RenderState,
    Tracing,
    error_of,
    monotonic,
    status,
)
from service.server.renders.store.record import ENDED, End, Order, Outcome, State
from service.server.renders.viewer import ASK_AGAIN_S, KeepsPictures, PictureViewer
from service.server.requests.request_parser import patched
from service.system.background import Background, reported
from service.system.executors import packing
from service.system.memory import MemoryBudget

GIVING_WAY_S = 10.0  # for the checkpoint of a render that gives its slot to another one

log = logging.getLogger(__name__)


@runtime_checkable
class InBatch(Protocol):
    """A batch, as its renders and their queue see it: it is kept, and makes room, as a whole."""

    id: str
    owner: str
    client: str  # whose share of the disk its document counts towards
    bytes: int  # of that document
    number: int  # of its row in the store
    ended_at: float  # by the monotonic clock
    counts_as: int  # of the renders of its owner that are kept
    gone: bool  # whether it made room for others, or was deleted
    jobs: dict[int, Any]  # by step: those that are under way, or not on the disk
    shown: WeakValueDictionary[int, Any]  # by step: those on the disk that somebody looks at

    @property
    def size(self) -> int: ...

    @property
    def ids(self) -> Iterator[str]: ...

    def add(self, step: int, render: Any) -> None: ...

    def add_ended(self, step: int, state: End, ended_at: float, size: int) -> None: ...

    def ended(self, render: Any) -> None: ...

    def move_to_row(self, render: Any) -> None: ...

    def job(self, step: int) -> Any: ...


class Render(Listener):
    """A render, on the event loop. `load`, `trace`, `requeue` and `end` are the arrows of the diagram in
    docs/house.md; `outcome` is what is known of it, and what callers see.

    With a `recorder` it outlives the server, and its picture comes back from the disk when somebody looks at it.
    Without one it keeps its picture in the renderer until `release`. `finished` is set when it has ended, `over` then
    and when the server ends, `left` whenever it needs no slot.
    """

    recorder: Recorder | None = None
    number = 0  # rises in the order of arrival
    place = 0  # among those of its owner that wait
    counts_as = 1  # of the renders of its owner that are kept
    waits = False  # for memory, the disk or a renderer, which was logged
    batch: InBatch | None = None  # which has the document, and learns of the end
    loaded_pictures: KeepsPictures | None = None  # None: the caller releases it
    task: int | None = None  # which renders it, and shows it when it has ended; None: no renderer has it
    ended_at = 0.0  # by the monotonic clock, once it has ended
    _has_slot = False
    _least_samples = 0  # of the checkpoint that it goes on from: the renderer may report fewer before that
    _gives_way = False  # its checkpoint is being stored for that; it may go on
    _started = False  # this server began it, which is stored
    _ending: Writing | None = None  # writes how it ended
    _saves_picture = False  # so does that, and the renderer need not have it any more

    def __init__(
        self,
        renderers: Renderers,
        order: Order,
        load: Load,
        document: bytes | None = None,
        packed: Packed | None = None,
        outcome: Outcome | None = None,
        budget: MemoryBudget | None = None,
        waiting: PackedScenes | None = None,
        patch: bytes | None = None,
        base: int | None = None,
    ) -> None:
        """The folded `document`, and the `patch` to it, may be left out where there is a recorder; for the others see
        RenderScene. One that was running when the server ended waits, and goes on before others begin. Raises
        TooLarge for a render that never fits into the `budget`."""
        self.renderers, self.order = renderers, order
        self.scene = RenderScene(order.settings, load, document, packed, budget, waiting, patch, base)
        self.id, self.owner, self.priority = order.id, order.owner, order.priority
        self.client = (
            order.owner or order.id
        )  # that shares the slots with others: without keys each is its own client
        self.finished, self.over, self.left = asyncio.Event(), asyncio.Event(), asyncio.Event()
        self.changes = Changes[Any]()
        self.viewer = PictureViewer(self)
        self._tasks = Background()
        outcome = outcome or Outcome()
        # It was running when the server ended, or gave way: it goes on before its owner's others begin.
        self.began = outcome.state == "running"
        if outcome.state in ENDED:
            self.end(outcome)
        else:
            self.outcome = replace(outcome, state="queued")
        if outcome.error is not None:
            self.viewer.refuse(outcome.error)

    # The states, and what leads from one to the next.

    @property
    def at(self) -> RenderState:
        match self.outcome.state:
            case "queued":
                return Loading() if self._has_slot else Queued()
            case "running":
                return Tracing()
            case how:
                return Ended(how)

    @property
    def state(self) -> State:
        """As callers see it."""
        return self.outcome.state

    def load(self) -> None:
        """It gets a slot: Queued -> Loading."""
        self._has_slot = True
        self.left.clear()
        if self.outcome.started_at is None:
            self.outcome = replace(self.outcome, started_at=time.time())

    def trace(self, loaded: Loaded) -> None:
        """A renderer has its scene: Loading -> Tracing. One that was cancelled meanwhile stays Ended."""
        self.outcome = self.outcome.loaded(loaded)

    def requeue(self) -> None:
        """It gives its slot back: Loading or Tracing -> Queued."""
        self._has_slot = False
        self.outcome = replace(self.outcome, state="queued")
        self.left.set()
        self.wake()

    def end(self, outcome: Outcome) -> None:
        """Any state -> Ended, where it stays."""
        self.outcome = outcome
        self.ended_at = monotonic(outcome.ended_at)
        self.finished.set()
        self._leave()

    def _leave(self) -> None:
        self.over.set()
        self.left.set()

    def wake(self) -> None:
        """Its status has changed."""
        self.changes.tell(self)

    async def changed(self) -> bool:
        """Return at the next change of the status: True; or when the server ends, which leaves it as it is."""
        await self.changes.next()
        return self.finished.is_set() or not self.over.is_set()

    def snapshot(self, kernel: bool = False) -> Callable[[], dict[str, Any]]:
        """A function that makes its status as it is now, for any thread."""
        return partial(status, self.order, self.outcome, self.renderers.tracing(self.task), kernel)

    def status(self, kernel: bool = False) -> dict[str, Any]:
        return self.snapshot(kernel)()

    # What it takes, and its beginning.

    @property
    def elapsed_s(self) -> float:
        """For how long it has been rendered."""
        return self.outcome.progress.elapsed_s

    @property
    def lasting(self) -> bool:
        """True if it is stored: it outlives the server, and may be interrupted."""
        return self.recorder is not None

    @property
    def lacks(self) -> int:
        """The bytes of memory that are missing for it to begin."""
        return self.scene.lacks

    @property
    def memory_share(self) -> float:
        """The part of SUNBOX_MEMORY that it takes while it runs."""
        return self.scene.memory.share

    @property
    def resident_bytes(self) -> int:
        """About the memory that its scene and its picture take while a renderer has them; 0 otherwise."""
        return self.scene.memory.bytes if PictureAt.RENDERER in self.picture_at else 0

    @property
    def size(self) -> int:
        """The bytes that it keeps: on the disk, or in memory where it is not stored."""
        if self.recorder is not None and self.recorder.whole:
            return self.recorder.store.size(self.order)
        return self.resident_bytes + self.order.bytes

    async def document(self) -> bytes:
        """The folded document. Raises Unavailable, Internal."""
        document, patch = self.scene.document, self.scene.patch
        if document is not None:
            return document if patch is None else await packing(partial(patched, document, patch))
        assert self.recorder is not None
        return await self.recorder.store.document(self.recorder.number)

    def reserve(self) -> bool:
        """Count the memory that it is known to need, before it runs. False where it has to wait for memory or for a
        renderer; one that is not stored does not wait, and says so to its client when it runs."""
        try:
            if self.renderers.hopeless:
                raise Unavailable("There is no renderer.")
            self.scene.reserve()
        except Unavailable as error:
            if self.recorder is not None:
                self.wait(error)
                return False
        return True

    def wait(self, reason: ServiceError) -> None:
        """Note that something is missing for it to begin. It is tried again every few seconds, and logged once."""
        if not self.waits:
            log.warning("a render has to wait", {"id": self.id[:6], "reason": reason})
        self.waits = True

    async def run(self) -> None:
        """Render until it has ended, however it ends, or until the server ends.

        A stored one returns unfinished as well, without its memory, where it has to go back in line: it gave way to
        another render, or it `waits` for memory, for the disk, or for a renderer. An error of the server ends the
        first attempt, of which nothing stays: perhaps it was of that moment.
        """
        for died in (lambda error: self._drop_task(), self.died):
            with reported("beginning of a render", died):
                try:
                    await self._begin()
                    self.waits = self.waits and self.left.is_set()
                except ServiceError as error:
                    self._could_not_begin(error)
                break
        await self.left.wait()

    def died(self, error: Exception) -> None:
        """An error of the server ended both attempts to begin it, or the task that runs it."""
        if not self.finished.is_set():
            self._could_not_begin(Internal(MISTAKE))

    def _could_not_begin(self, error: ServiceError) -> None:
        if self.over.is_set():
            return  # it was cancelled meanwhile, or the next server tries again
        if isinstance(error, Unavailable) and self.recorder is not None:
            self._drop_task()
            self.wait(error)
            self.requeue()
        else:
            self._fail(error)

    async def _begin(self) -> None:
        """Raises what loading the scene raises, and Unavailable where nothing renders."""
        if self.over.is_set():
            return
        self.load()
        if self.recorder is not None and not self._started:
            starts = await self.recorder.start(self.outcome)
            self._started, self.outcome = True, replace(self.outcome, starts=starts)  # it may be cancelled by now
        async with self.viewer.loading:
            try:
                packed = None if self.over.is_set() else await self.scene.load(self.document)
                if packed is None or self.over.is_set():
                    return
                self.scene.memory.hold()
                self.viewer.close()
                self.task = task = self.renderers.open(self, "render", self.owner)
            finally:
                self._free_memory()
            restore = await self._checkpoint(task)
            await self.renderers.send_scene(self.scene.update(task, packed), restore)
            self.viewer.follow(task)
        if self.finished.is_set():  # cancelled meanwhile: that message went ahead of the scene
            self.renderers.send(Stop(task))

    async def _checkpoint(self, task: int) -> Restore | None:
        """The picture it goes on from, of which the progress counts from now on."""
        restore = None
        if self.recorder is not None and self.recorder.store.has(self.id, "checkpoint"):
            restore = await self.recorder.store.read(self.id, "checkpoint", task)
        progress = Progress() if restore is None else restore.progress
        self._least_samples = progress.samples
        self.outcome = replace(self.outcome, progress=progress)
        return restore

    # Its task with a renderer.

    def heard(self, message: FromRenderer) -> None:
        """A message about its picture, from whichever task shows it."""
        if isinstance(message, Image) or (isinstance(message, Failed) and message.serial is not None):
            self.viewer.heard(message)
        elif isinstance(message, Loaded):
            self.trace(message)
        elif isinstance(message, Progressed):
            if message.progress.samples >= self._least_samples and not self._gives_way:
                self._progressed(message.progress)
        elif isinstance(message, Checkpoint):
            if self.recorder is not None and not self.finished.is_set():
                self.recorder.checkpoint(message)
        elif isinstance(message, Done):
            self._done(message)
        elif isinstance(message, Failed):
            self._fail(error_of(message))
        self.wake()

    def _progressed(self, progress: Progress) -> None:
        self.outcome = replace(self.outcome, progress=progress)
        if progress.samples:
            self.viewer.sampled()

    def again(self) -> None:
        """Another renderer begins the render again; a cancelled one has no image until that has samples."""
        self._least_samples = 0
        if self.outcome.progress.samples:
            self.viewer.sampled(there=False)
        if not self.finished.is_set():
            self.outcome = replace(self.outcome, progress=Progress())

    def lost(self, detail: str) -> None:
        self.task = None
        self.scene.memory.release()
        if self._saves_picture or (self.recorder is not None and (self.recorder.whole or self.over.is_set())):
            self.viewer.interrupt(Unavailable("The renderer was lost: ask again.", ASK_AGAIN_S))
        elif self.finished.is_set():
            self._forget(Gone(detail))
        elif self.recorder is not None and self.renderers.hopeless:
            # Which was not its fault: it goes on when something renders again.
            self.wait(Unavailable("No renderer could be started."))
            self.requeue()
        else:
            self._fail(Internal(detail))

    @property
    def can_give_way(self) -> bool:
        """True if another render may have its slot: it has got on since it began, and its samples can be stored."""
        runs = self.task is not None and not (self.ends or self._gives_way or self.over.is_set())
        got_on = isinstance(self.at, Tracing) and self.outcome.progress.samples > self._least_samples
        return self.recorder is not None and runs and got_on

    async def give_way(self) -> bool:
        """Store the samples so far and have `run` return, to go on later to the same bits. Whether it does: not where
        the render ends meanwhile, or the disk fails."""
        recorder, asked = self.recorder, self.outcome.progress
        if recorder is None or self.task is None:
            return False
        self._gives_way = True
        stored = await recorder.store_now(self._take(self.task), asked.samples, GIVING_WAY_S)
        self._gives_way = False
        if not stored or self.task is None or self.ends or self.over.is_set():
            return False
        self._drop_task()
        self.viewer.interrupt(Unavailable("The render has just given way to another one: ask again.", 1))
        self.began = True
        self.outcome = replace(self.outcome, progress=recorder.reached)
        self.requeue()
        return True

    def _take(self, task: int) -> Callable[[], None]:
        return partial(self.renderers.send, TakeCheckpoint(task))

    def _drop_task(self) -> None:
        """Have the renderer forget what it renders."""
        if self.task is not None:
            self.renderers.drop(self.task)
            self.task = None
        self._free_memory()

    def _free_memory(self) -> None:
        """Its memory counts while a renderer has its picture."""
        if self.task is None and self.viewer.task is None:
            self.scene.memory.release()

    # Its end.

    @property
    def ends(self) -> bool:
        """True if it has ended, or is known to end as soon as that is stored."""
        return self.finished.is_set() or self._ending is not None

    def cancel(self) -> None:
        """Stop at once; the image so far stays."""
        if self.ends:
            return
        self.scene.forget()
        if self.task is not None:
            self.renderers.send(Stop(self.task))
        self._end(replace(self.outcome, state="cancelled", ended_at=time.time()))
        if self.recorder is not None:
            self._ending = self._tasks.start("note of a render's end", self.recorder.note(self.outcome))
            self.recorder.whole = self.task is None

    def _done(self, done: Done) -> None:
        self._progressed(done.progress)
        self.viewer.sampled()
        self.outcome = replace(self.outcome, reason=done.reason).warned(done.warnings)
        if not self.finished.is_set():
            how: End = "cancelled" if done.reason == "stopped" else "done"
            self._end_when_stored(replace(self.outcome, state=how, ended_at=time.time()), done)
        elif self.recorder is not None:  # it was cancelled; now its picture has come
            self._end_when_stored(self.outcome, done)

    def _fail(self, error: ServiceError) -> None:
        self.renderers.statistics.errors[answer(error).type] += 1
        self._forget(error)
        self._end_when_stored(self.outcome.failed(error, time.time()))

    def _forget(self, error: ServiceError) -> None:
        """There is no picture: not because the render failed, or not any more."""
        self.scene.forget()
        self.scene.memory.release()
        self.viewer.refuse(error)

    def _end_when_stored(self, outcome: Outcome, done: Done | None = None) -> None:
        if self.recorder is None:
            self._end(outcome)
            return
        self._saves_picture = done is not None
        record = self._record_end(self.recorder, self._ending, outcome, done)
        self._ending = self._tasks.start("record of a render's end", record, lambda _: self._recorded_end(outcome))

    async def _record_end(self, to: Recorder, before: Writing | None, outcome: Outcome, done: Done | None) -> None:
        if before is not None:
            await before
        await to.end(outcome, done)
        self._recorded_end(outcome)

    def _recorded_end(self, outcome: Outcome) -> None:
        self._saves_picture = False
        if not self.finished.is_set():
            self._end(outcome)

    def _end(self, outcome: Outcome) -> None:
        self.end(outcome)
        self._free_memory()
        self.wake()

    async def recorded(self) -> None:
        """Return when its end is on the disk."""
        if self._ending is not None:
            await asyncio.shield(self._ending)

    async def close(self) -> None:
        """The server ends: have the last samples stored, and leave the render for the next start."""
        self._leave()
        self.wake()
        if self.recorder is not None and isinstance(self.at, Tracing) and self.task is not None:
            await self.recorder.store_now(self._take(self.task))
        await self.recorded()

    # Its picture.

    async def image(self, view: View) -> tuple[np.ndarray, Progress]:
        """The picture so far. Raises Conflict before the first sample, and the render's own error where it failed."""
        return await self.viewer.image(view)

    @property
    def picture_at(self) -> PictureAt:
        """Where its newest samples are, if it has any."""
        if self.viewer.task is not None:
            return PictureAt.BOTH
        if self.task is not None:
            whole = self.finished.is_set() and self.recorder is not None and self.recorder.whole
            return PictureAt.BOTH if whole else PictureAt.RENDERER
        stored = self.recorder is not None and self.recorder.store.latest(self.id) is not None
        return PictureAt.DISK if stored else PictureAt.NOWHERE

    def release(self) -> None:
        """Have the renderer forget it."""
        self.viewer.close()
        self._drop_task()
        self.scene.forget_document()

    def unload(self) -> bool:
        """Release what can be brought back from the disk, if nobody waits for it; whether that was possible."""
        possible = self.picture_at is PictureAt.BOTH and not self.viewer.busy
        if possible:
            self.release()
        return possible
