"""One client's picture: loaded, edited, traced slice by slice, shown when wanted, ended when it has had enough."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING

from gpu import GpuError, OutOfMemory, RenderSettings
from gpu.precompile import kernel_keys
from service.rendering.ipc.messages import (
    Checkpoint,
    Done,
    Failed,
    FromRenderer,
    Loaded,
    Progress,
    Progressed,
    Read,
    Reason,
    Restore,
    Update,
    Want,
)
from service.rendering.worker.appraising import Appraising
from service.rendering.worker.compiler import Compiler
from service.rendering.worker.course import Course
from service.rendering.worker.denoiser import Denoiser
from service.rendering.worker.held import Held
from service.rendering.worker.holding import Wanted, wanted_of
from service.rendering.worker.keeping import Keeping
from service.rendering.worker.ladder import FULL_S
from service.rendering.worker.memory import UNLIMITED, Memory
from service.rendering.worker.showing import SLICE_S, Showing
from service.rendering.worker.smoothing import Smoothing
from service.rendering.worker.stopgap import Stopgap

if TYPE_CHECKING:
    from gpu import Renderer, Saved

PROGRESS_S = 0.1  # between two reports of how far it is


class Task:
    """What it was told is done in its turns: `turn` while it is `ready`, and `answer` when a frame is wanted."""

    def __init__(
        self,
        renderer: Renderer,
        number: int,
        send: Callable[[FromRenderer], None],
        denoiser: Denoiser,
        client: str = "",
        memory: Memory | None = None,
        forget: Callable[[Task], None] | None = None,
        compiler: Compiler | None = None,
        checkpoint_s: float = inf,
        spare: Compiler | None = None,
    ) -> None:
        """With `compiler`, others need not wait for its kernels; `spare` is the one of `appraising`, and of
        kernels that an edit may need.

        With `forget`, Done brings the picture of a render to the server; what is forgotten it can bring back;
        while it is under way, a Checkpoint does so every `checkpoint_s` seconds."""
        self.number, self.client = number, client
        self.attempted = 0  # the generation of the last update
        self.used_s = 0.0
        self.traced = 0  # samples of pixels
        self._send, self._forget = send, forget
        self._held = Held(renderer, memory or Memory(UNLIMITED, list), self, self._part)
        self._course = Course(renderer)
        smoothing = Smoothing(denoiser, yields=bool(renderer.info["software"]))
        self._showing = Showing(number, send, self._held, self._course, smoothing, self._finish, compiler)
        self.appraising = Appraising(number, send, renderer, spare)
        self._spare = spare
        self._stopgap = Stopgap(number, send, renderer, spare)
        self._scale = 1.0  # of what is traced
        self._pending: Update | None = None  # not applied yet
        self._stopping = False  # when that was applied
        self._compiler = compiler
        self._compiling = False  # what waits to be applied waits for its kernel
        self._compiled_ms = 0.0  # what that took elsewhere
        self._settings: RenderSettings | None = None
        self._paused = self._away = False
        self._keeping = Keeping(checkpoint_s)
        self._reported = 0.0

    @property
    def generation(self) -> int:
        return self._course.generation

    @property
    def wanted(self) -> bool:
        """A frame."""
        return self._showing.want is not None

    @property
    def ready(self) -> bool:
        if self._away:
            return False
        if self._pending is not None:
            return not self._compiling or (self._stopgap.due and not self._paused)
        if not self._held.there:
            return False
        if self._keeping.under_way or self._showing.due:
            return True
        return self._course.reason is None and (self.unseen or not (self._paused or self._showing.smoothing.holds))

    @property
    def unseen(self) -> bool:
        pending, interactive = self._pending, self._course.interactive
        if self._compiling and self._stopgap.due:
            return self._stopgap.scale is None
        if pending is not None and (pending.restarts or self._held.holding is None):
            return pending.interactive or interactive
        return self._showing.scale is None and interactive

    @property
    def loads(self) -> bool:
        """Its next turn may take as long as a compilation does."""
        return self._pending is not None

    @property
    def awaited(self) -> bool:
        """Somebody would notice if the loop stood still: there is work, or a person who may edit at any moment."""
        if self._pending is not None:
            return True
        return self._held.there and not self._away and (self._course.interactive or self.ready)

    @property
    def idle(self) -> bool:
        waited_for = self.ready or self._showing.awaited or self._showing.smoothing.pending
        return self._held.holding is not None and not waited_for

    @property
    def bytes(self) -> int:
        return self._held.bytes + self._stopgap.bytes

    @property
    def rested_since(self) -> float:
        return self._held.rested_since

    def update(self, update: Update) -> None:
        """To be applied in the next turn, joined with what else waits for it."""
        known = self.generation if self._pending is None else self._pending.generation
        if update.base is not None and update.base != known:
            return  # it changes what failed, which the server will hear, and say what it wants now
        self._pending = self._pending.then(update) if self._pending is not None else update
        self._stopping = self._compiling = False

    def turn(self) -> None:
        """Applies what has changed, traces a slice, and ends the render when that was the last."""
        if self._pending is not None:
            if self._compiling:
                self.traced += self._stopgap.step()
                return
            self._compile_and_apply(self._pending)
            if self._compiling:
                return
        if self._stopping:
            self.stop()
        held = self._held
        held.wake()
        if held.holding is None or self._showing.step() or self._keep():
            return
        if self._course.reason is not None:
            return
        if not (self._end_if_reached() or self._course.beyond.step(held.full)):
            self._trace()
        held.rests()

    def _trace(self) -> None:
        held, course, scale = self._held, self._course, self._scale
        picture = held.ladder.picture(scale)
        cap = 1 if self.unseen or scale < 1.0 else course.cap(held)
        course.clock.start()
        before = picture.samples
        picture.trace(FULL_S if self.unseen else SLICE_S, cap)
        course.clock.lap()
        self.traced += (picture.samples - before) * picture.settings.width * picture.settings.height
        course.pixel_s = picture.cost_s or course.pixel_s
        if picture.samples:
            self._showing.scale = scale
            if scale < 1.0:
                self._scale = held.ladder.next(scale, course.pixel_s)
        if self._paused and not self.unseen:
            course.clock.pause()
        if scale == 1.0:
            course.even = picture.samples >= cap
            course.pace.passed(picture.samples, course.clock.elapsed_s)
            if not self._end_if_reached():
                self._report()

    def _compile_and_apply(self, update: Update) -> None:
        """Applies the update, or has its kernel compiled first: then this turn was for nothing more."""
        self.attempted = update.generation
        wanted = None
        if self._compiler is not None:
            wanted = wanted_of(update, self._settings, self._held.holding, self._held.aside)
            self._compiling = wanted is not None and self._waits(wanted, update, self._compiler)
            if self._compiling:
                return
        self._apply(update)
        self._stopgap.release()
        if wanted is not None and self._compiler is not None and self.generation == update.generation:
            self._compiler.met(wanted.recipe)

    def _waits(self, wanted: Wanted, update: Update, compiler: Compiler) -> bool:
        """Whether its kernel is being compiled; who looks on sees it with another one meanwhile."""
        looks_on = (update.interactive or self._course.interactive) and not self._paused
        shows = looks_on and not compiler.knows(wanted.recipe) and self._stopgap.can(wanted)
        if not compiler.waits(wanted.recipe, self._hear_compiled, shows):
            return False
        if shows:
            self._stopgap.begin(wanted, update.generation)
        else:
            self._stopgap.release()
        return True

    def _hear_compiled(self, milliseconds: float) -> None:
        self._compiling, self._compiled_ms = False, milliseconds

    def _apply(self, update: Update) -> None:
        """Makes the update true, or says that it failed and leaves everything as it was."""
        began, course, held = time.monotonic(), self._course, self._held
        self._pending, self.attempted = None, update.generation
        if update.scene is None and not held.there:
            return  # its first one failed, which was said; only a whole scene helps
        settings = RenderSettings(**update.settings) if update.settings is not None else self._settings
        assert settings is not None  # a task's first update has them
        try:
            made = held.change(update, settings)
        except GpuError as error:
            fallback = self.generation if held.there else None
            refused = isinstance(error, OutOfMemory) or type(error).__name__ == "SceneTooLarge"
            self._stopping = False
            self._send(Failed(self.number, update.generation, str(error), refused, fallback=fallback))
            return
        if made is not None:
            self.release()
            held.holding = made
        course.generation = update.generation
        self._settings, course.stop = settings, update.stop or course.stop
        if update.denoise is not None:
            self._showing.smoothing.wanted = update.denoise
        if update.scene is not None:
            course.interactive = update.interactive
        course.reason, self._showing.owes_done = None, False
        self._keeping.restart()
        if update.restarts:
            self._restart()
        if update.scene is not None or update.settings is not None:
            setup_s, warnings = time.monotonic() - began, self._warnings()
            compile_ms, self._compiled_ms = held.full.compile_ms + self._compiled_ms, 0.0
            kernel = compile_ms, held.full.scene.features, held.full.scene.spared
            self._send(Loaded(self.number, self.generation, setup_s, *kernel, warnings))
            self._foresee(settings)

    def _foresee(self, settings: RenderSettings) -> None:
        """Has compiled, in spare time, what moving a large mesh would need, and the first touch of some sliders."""
        if self._spare is not None and self._course.interactive:
            arrays = self._held.full.scene.arrays
            moved = kernel_keys.key_after_move(arrays, settings)
            self._spare.prepare([*([moved] if moved else []), *kernel_keys.keys_after_edit(arrays, settings)])
            self._stopgap.prepare(arrays, settings)

    def evict(self) -> None:
        """Leaves the device: to the machine's memory, or where the server has it already, altogether."""
        if self._forget is not None and self._kept:
            self._part()
            self._forget(self)
        else:
            self._held.put_aside()

    def settle(self) -> None:
        """Applies what waits to be, for what comes next to fall back to."""
        if self._pending is not None:
            self._apply(self._pending)
            self._stopgap.release()

    def restore(self, restore: Restore) -> None:
        self.settle()
        if self._held.holding is None:
            return
        course = self._course
        self._held.full.restore(restore.saved)
        course.reason, self._showing.scale = restore.reason, 1.0
        course.clock.set(restore.progress.elapsed_s)
        course.meter.set(restore.progress.samples, restore.progress.noise)
        course.pace.passed(restore.saved.samples, restore.progress.elapsed_s)
        course.even = not restore.saved.under_way[0]
        self._keeping.restart()

    def look(self, want: Want) -> None:
        self._showing.want = want

    def answer(self) -> bool:
        """Sends the frame that is wanted if there is something new to see in it."""
        if self._pending is None:
            return self._showing.answer()
        seen = self._compiling and self._stopgap.answer(self._showing.want)
        if seen:
            self._showing.want = None
        return seen

    def read(self, read: Read) -> None:
        self._showing.read(read)

    @property
    def _kept(self) -> bool:
        """The server keeps its picture."""
        return self._forget is not None and not self._course.interactive

    def _keep(self) -> bool:
        """A step of saving the picture, where that is due; a finished render is done when it is safe."""
        full, keeping = self._held.full, self._keeping
        if not keeping.under_way:
            if not self._kept or self._course.reason is not None or not keeping.due(full):
                return False
            keeping.begin(full)
        saved = keeping.step()
        if saved is not None and self._course.reason is not None:
            self._say_done(saved)
        elif saved is not None:
            self._send(Checkpoint(self.number, self.generation, self.progress(), saved))
        return True

    def appraise(self) -> None:
        """A step of `appraising`."""
        self._held.wake()
        self.appraising.step(self._held.full if self._held.holding is not None else None)

    def pause(self, away: bool = False) -> None:
        self._paused, self._away = True, away
        self._course.clock.pause()

    def resume(self) -> None:
        self._paused = self._away = False

    def stop(self) -> None:
        pending = self._pending
        if pending is not None and not pending.interactive and self._held.holding is None:  # not even begun
            self._pending, self._course.generation = None, pending.generation
            self._end("stopped")
        elif pending is not None:
            self._stopping = True
        else:
            self._stopping = False
            if self._course.reason is None or not self._keeping.under_way:
                self._keeping.restart()
                self._end("stopped")

    def release(self) -> None:
        """Gives the GPU's memory back; the task can be loaded again."""
        self._keeping.restart()
        if self._compiler is not None:
            self._compiler.forget(self._hear_compiled)
        self._stopgap.release()
        self._held.release()
        self._showing.forget()

    def fail(self) -> None:
        """Nothing of it can be relied on any more; a whole scene revives it."""
        self._pending, self._stopping = None, False
        self.release()

    def progress(self) -> Progress:
        return self._course.progress(self._held)

    def _part(self) -> None:
        """What is on the device leaves it, and who works on that must let it go."""
        self._showing.part()
        self._course.beyond.restart()
        self.appraising.part()

    def _restart(self) -> None:
        self._showing.restart()
        self._course.restart()
        first = self._held.holding is not None and self._course.interactive
        self._scale = self._held.ladder.first(self._course.pixel_s) if first else 1.0
        seen = self._stopgap.shown(self.generation)
        if self._scale <= seen:
            self._scale = self._held.ladder.next(seen, self._course.pixel_s)

    def _end_if_reached(self) -> bool:
        reason = self._course.enough(self._held)
        if reason is not None:
            self._end(reason)
        return reason is not None

    def _end(self, reason: Reason) -> None:
        held, course, showing = self._held, self._course, self._showing
        held.wake()
        course.clock.pause()
        course.reason = reason
        held.rests()
        if held.holding is not None:
            noise = course.meter.read(held.full, fresh=True)
            wanted = showing.smoothing.covers("color", noise) and showing.scale == 1.0 and reason != "stopped"
            showing.owes_done = wanted and showing.smoothing.has(held.full.samples) is None
        if not showing.owes_done:
            self._finish()

    def _finish(self) -> None:
        """Says that it has ended; where the server keeps such pictures, not before it has this one."""
        self._showing.owes_done = False
        if self._kept and self._held.holding is not None and self._held.full.samples:
            self._keeping.begin(self._held.full)
        else:
            self._say_done(None)

    def _say_done(self, saved: Saved | None) -> None:
        assert self._course.reason is not None
        self.answer()
        ended = self.generation, self._course.reason, self.progress(), self._warnings()
        self._send(Done(self.number, *ended, saved))

    def _warnings(self) -> list[str]:
        warnings = list(self._held.full.warnings) if self._held.holding is not None else []
        why = self._showing.smoothing.warning
        return warnings + ([why] if why else [])

    def _report(self) -> None:
        now = time.monotonic()
        due = not self._course.interactive and now - self._reported >= PROGRESS_S
        if due and self._held.full.samples:
            self._reported = now
            self._send(Progressed(self.number, self.generation, self.progress()))
