"""A render with a renderer: its task is opened, reports its progress, and ends, is lost, or gives way."""

from __future__ import annotations

import asyncio
import logging
import time
from dataclasses import replace
from functools import partial

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
)
from service.ipc.task_control import Stop, TakeCheckpoint
from service.problems import MISTAKE, Gone, Internal, ServiceError, Unavailable, answer
from service.renderers.protocol import Listener
from service.server.renders.life import Tracing
from service.server.renders.ordered import Ordered
from service.server.renders.recorder import Recorder, Writing
from service.server.renders.status import error_of
from service.server.renders.store.record import End, Outcome
from service.server.renders.viewer import ASK_AGAIN_S, PictureViewer
from service.system.background import Background, reported

GIVING_WAY_S = 10.0  # for the checkpoint of a render that gives its slot to another one

log = logging.getLogger(__name__)


class Rendering(Listener):
    """For the event loop. It moves the render from one state to the next."""

    def __init__(self, render: Ordered, viewer: PictureViewer) -> None:
        self._render, self._viewer, self._tasks = render, viewer, Background()
        self._least_samples = 0  # of the checkpoint that it goes on from: the renderer may report fewer before that
        self._gives_way = False  # its checkpoint is being stored for that; it may go on
        self._started = False  # this server began it, which is stored
        self._ending: Writing | None = None  # writes how it ended
        self._saves_picture = False  # so does that, and the renderer need not have it any more

    @property
    def ends(self) -> bool:
        """Whether it has ended, or is known to end as soon as that is stored."""
        return self._render.finished.is_set() or self._ending is not None

    async def run(self) -> None:
        """See Job."""
        render = self._render
        for died in (self._again, self.died):
            with reported("beginning of a render", died):
                try:
                    await self._begin()
                    render.waits = render.waits and render.life.left.is_set()
                except ServiceError as error:
                    self._could_not_begin(error)
                break
        await render.life.left.wait()

    def _again(self, error: Exception) -> None:
        """An error of the server ended the first attempt, of which nothing stays; perhaps it was of that moment."""
        self.release()

    def died(self, error: Exception) -> None:
        """An error of the server ended both attempts to begin it, or the task that runs it."""
        if not self._render.finished.is_set():
            self._could_not_begin(Internal(MISTAKE))

    def _could_not_begin(self, error: ServiceError) -> None:
        render = self._render
        if render.life.over.is_set():
            return  # it was cancelled meanwhile, or the next server tries again
        if isinstance(error, Unavailable) and render.recorder is not None:
            self.release()
            self._requeue(error)
        else:
            self._fail(error)

    def _requeue(self, lacks: ServiceError | None = None) -> None:
        """Back in line: it lacks something, or gave way."""
        if lacks is not None:
            self._render.wait(lacks)
        self._render.life.requeue()
        self._render.wake()

    async def _begin(self) -> None:
        """Raises what loading the scene raises, and Unavailable where nothing renders."""
        render, life, memory = self._render, self._render.life, self._render.scene.memory
        if life.over.is_set():
            return
        life.load()
        if render.recorder is not None and not self._started:
            starts = await render.recorder.start(life.outcome)
            self._started, life.outcome = True, replace(life.outcome, starts=starts)  # it may be cancelled by now
        async with self._viewer.loading:
            try:
                packed = None if life.over.is_set() else await render.scene.load(render.document)
                if packed is None or life.over.is_set():
                    return
                memory.hold()
                self._viewer.close()
                render.task = task = render.renderers.open(self, "render", render.owner)
            finally:
                if render.task is None and self._viewer.task is None:
                    memory.release()
            restore = await self._checkpoint(task)
            await render.renderers.send_scene(render.scene.update(task, packed), restore)
            self._viewer.follow(task)
        if life.finished.is_set():  # cancelled meanwhile: that message went ahead of the scene
            render.renderers.send(Stop(task))

    async def _checkpoint(self, task: int) -> Restore | None:
        """What it goes on from, of which the progress counts from now on."""
        recorder, restore = self._render.recorder, None
        if recorder is not None and recorder.store.has(self._render.id, "checkpoint"):
            restore = await recorder.store.read(self._render.id, "checkpoint", task)
        progress = Progress() if restore is None else restore.progress
        self._least_samples = progress.samples
        self._render.life.progressed(progress)
        return restore

    @property
    def can_give_way(self) -> bool:
        """Whether another render may have its slot: it has got on since it began, and its samples can be stored."""
        render = self._render
        runs = render.task is not None and not (self.ends or self._gives_way or render.life.over.is_set())
        got_on = isinstance(render.life.state, Tracing) and render.outcome.progress.samples > self._least_samples
        return render.recorder is not None and runs and got_on

    async def give_way(self) -> bool:
        """Store the samples so far and give the slot back; it goes on later to the same bits. Whether it does: not
        where the render ends meanwhile, or the disk fails."""
        render, recorder, asked = self._render, self._render.recorder, self._render.outcome.progress
        if recorder is None or render.task is None:
            return False
        self._gives_way = True
        stored = await recorder.store_now(self._take(render.task), asked.samples, GIVING_WAY_S)
        self._gives_way = False
        if not stored or render.task is None or self.ends or render.life.over.is_set():
            return False
        self.release()
        self._viewer.interrupt(Unavailable("The render has just given way to another one: ask again.", 1))
        render.life.began = True
        render.life.progressed(recorder.reached)
        self._requeue()
        return True

    async def store_samples(self) -> None:
        """Have the last samples on the disk, as the server ends."""
        render = self._render
        if render.recorder is not None and isinstance(render.life.state, Tracing) and render.task is not None:
            await render.recorder.store_now(self._take(render.task))

    def cancel(self) -> None:
        """Stop at once; the image so far stays."""
        render, recorder = self._render, self._render.recorder
        if render.task is not None:
            render.renderers.send(Stop(render.task))
        self._end(replace(render.outcome, state="cancelled", ended_at=time.time()))
        if recorder is not None:
            self._ending = self._tasks.start("note of a render's end", recorder.note(render.outcome))
            recorder.whole = render.task is None

    async def recorded(self) -> None:
        """Return when its end is on the disk."""
        if self._ending is not None:
            await asyncio.shield(self._ending)

    def release(self) -> None:
        """Have the renderer forget it."""
        if self._render.task is not None:
            self._render.renderers.drop(self._render.task)
            self._render.task = None
        if self._viewer.task is None:
            self._render.scene.memory.release()

    def heard(self, message: FromRenderer) -> None:
        life, recorder = self._render.life, self._render.recorder
        if isinstance(message, Image) or (isinstance(message, Failed) and message.serial is not None):
            self._viewer.heard(message)
        elif isinstance(message, Loaded):
            life.trace(message)
        elif isinstance(message, Progressed):
            if message.progress.samples >= self._least_samples and not self._gives_way:
                self._progressed(message.progress)
        elif isinstance(message, Checkpoint):
            if recorder is not None and not life.finished.is_set():
                recorder.checkpoint(message)
        elif isinstance(message, Done):
            self._done(message)
        elif isinstance(message, Failed):
            self._fail(error_of(message))
        self._render.wake()

    def again(self) -> None:
        """Another renderer begins the render again; a cancelled one has no image until that has samples."""
        self._least_samples = 0
        if self._render.outcome.progress.samples:
            self._viewer.sampled(there=False)
        if not self._render.finished.is_set():
            self._render.life.progressed(Progress())

    def lost(self, detail: str) -> None:
        render, recorder, life = self._render, self._render.recorder, self._render.life
        render.task = None
        render.scene.memory.release()
        if self._saves_picture or (recorder is not None and (recorder.whole or life.over.is_set())):
            self._viewer.interrupt(Unavailable("The renderer was lost: ask again.", ASK_AGAIN_S))
        elif life.finished.is_set():
            self._forget(Gone(detail))
        elif recorder is not None and render.renderers.hopeless:
            # Which was not its fault: it goes on when something renders again.
            self._requeue(Unavailable("No renderer could be started."))
        else:
            self._fail(Internal(detail))

    def _fail(self, error: ServiceError) -> None:
        render = self._render
        render.renderers.statistics.errors[answer(error).type] += 1
        self._forget(error)
        self._end_when_stored(render.outcome.failed(error, time.time()))

    def _take(self, task: int) -> partial[None]:
        return partial(self._render.renderers.send, TakeCheckpoint(task))

    def _progressed(self, progress: Progress) -> None:
        self._render.life.progressed(progress)
        if progress.samples:
            self._viewer.sampled()

    def _done(self, done: Done) -> None:
        render = self._render
        self._progressed(done.progress)
        self._viewer.sampled()
        render.outcome = replace(render.outcome, reason=done.reason).warned(done.warnings)
        if not render.finished.is_set():
            how: End = "cancelled" if done.reason == "stopped" else "done"
            self._end_when_stored(replace(render.outcome, state=how, ended_at=time.time()), done)
        elif render.recorder is not None:  # it was cancelled; now its picture has come
            self._end_when_stored(render.outcome, done)

    def _end_when_stored(self, outcome: Outcome, done: Done | None = None) -> None:
        recorder = self._render.recorder
        if recorder is None:
            self._end(outcome)
        else:
            self._saves_picture = done is not None
            record = self._record_end(recorder, self._ending, outcome, done)
            self._ending = self._tasks.start(
                "record of a render's end", record, lambda _: self._recorded_end(outcome)
            )

    async def _record_end(self, to: Recorder, before: Writing | None, outcome: Outcome, done: Done | None) -> None:
        if before is not None:
            await before
        await to.end(outcome, done)
        self._recorded_end(outcome)

    def _recorded_end(self, outcome: Outcome) -> None:
        self._saves_picture = False
        if not self._render.finished.is_set():
            self._end(outcome)

    def _end(self, outcome: Outcome) -> None:
        self._render.life.end(outcome)
        if self._render.task is None and self._viewer.task is None:
            self._render.scene.memory.release()
        self._render.wake()

    def _forget(self, error: ServiceError) -> None:
        """There is no picture: not because the render failed, or not any more."""
        self._render.scene.forget()
        self._render.scene.memory.release()
        self._viewer.refuse(error)
