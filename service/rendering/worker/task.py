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
from service.rendering.worker.device.checkpoints import Checkpointer
from service.rendering.worker.device.loaded_scene import KernelRequest, kernel_request
from service.rendering.worker.device.memory import UNLIMITED, Memory
from service.rendering.worker.device.residency import Residency
from service.rendering.worker.device.resolution_ladder import FULL_S
from service.rendering.worker.helpers.compile_client import CompileClient
from service.rendering.worker.helpers.denoise_client import DenoiseClient
from service.rendering.worker.kernel_savings import KernelSavings
from service.rendering.worker.progress.progress import ProgressTracker
from service.rendering.worker.view.denoise_policy import DenoisePolicy
from service.rendering.worker.view.fallback_preview import FallbackPreview
from service.rendering.worker.view.frames import SLICE_S, FrameSource

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
        denoiser: DenoiseClient,
        client: str = "",
        memory: Memory | None = None,
        forget: Callable[[Task], None] | None = None,
        compiler: CompileClient | None = None,
        checkpoint_s: float = inf,
        spare: CompileClient | None = None,
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
        self._residency = Residency(renderer, memory or Memory(UNLIMITED, list), self, self._part)
        self._tracker = ProgressTracker(renderer)
        denoising = DenoisePolicy(denoiser, yields=bool(renderer.info["software"]))
        self._frames = FrameSource(number, send, self._residency, self._tracker, denoising, self._finish, compiler)
        self.savings = KernelSavings(number, send, renderer, spare)
        self._spare = spare
        self._preview = FallbackPreview(number, send, renderer, spare)
        self._scale = 1.0  # of what is traced
        self._pending: Update | None = None  # not applied yet
        self._stopping = False  # when that was applied
        self._compiler = compiler
        self._compiling = False  # what waits to be applied waits for its kernel
        self._compiled_ms = 0.0  # what that took elsewhere
        self._settings: RenderSettings | None = None
        self._paused = self._away = False
        self._checkpoints = Checkpointer(checkpoint_s)
        self._reported = 0.0

    @property
    def generation(self) -> int:
        return self._tracker.generation

    @property
    def wanted(self) -> bool:
        """A frame."""
        return self._frames.want is not None

    @property
    def ready(self) -> bool:
        if self._away:
            return False
        if self._pending is not None:
            return not self._compiling or (self._preview.due and not self._paused)
        if not self._residency.there:
            return False
        if self._checkpoints.under_way or self._frames.due:
            return True
        return self._tracker.reason is None and (self.unseen or not (self._paused or self._frames.denoising.holds))

    @property
    def unseen(self) -> bool:
        pending, interactive = self._pending, self._tracker.interactive
        if self._compiling and self._preview.due:
            return self._preview.scale is None
        if pending is not None and (pending.restarts or self._residency.loaded is None):
            return pending.interactive or interactive
        return self._frames.scale is None and interactive

    @property
    def loads(self) -> bool:
        """Its next turn may take as long as a compilation does."""
        return self._pending is not None

    @property
    def awaited(self) -> bool:
        """Somebody would notice if the loop stood still: there is work, or a person who may edit at any moment."""
        if self._pending is not None:
            return True
        return self._residency.there and not self._away and (self._tracker.interactive or self.ready)

    @property
    def idle(self) -> bool:
        waited_for = self.ready or self._frames.awaited or self._frames.denoising.pending
        return self._residency.loaded is not None and not waited_for

    @property
    def bytes(self) -> int:
        return self._residency.bytes + self._preview.bytes

    @property
    def rested_since(self) -> float:
        return self._residency.rested_since

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
                self.traced += self._preview.step()
                return
            self._compile_and_apply(self._pending)
            if self._compiling:
                return
        if self._stopping:
            self.stop()
        residency = self._residency
        residency.wake()
        if residency.loaded is None or self._frames.step() or self._keep():
            return
        if self._tracker.reason is not None:
            return
        if not (self._end_if_reached() or self._tracker.truncated.step(residency.full)):
            self._trace()
        residency.rests()

    def _trace(self) -> None:
        residency, tracker, scale = self._residency, self._tracker, self._scale
        picture = residency.ladder.picture(scale)
        cap = 1 if self.unseen or scale < 1.0 else tracker.cap(residency)
        tracker.clock.start()
        before = picture.samples
        picture.trace(FULL_S if self.unseen else SLICE_S, cap)
        tracker.clock.lap()
        self.traced += (picture.samples - before) * picture.settings.width * picture.settings.height
        tracker.pixel_s = picture.cost_s or tracker.pixel_s
        if picture.samples:
            self._frames.scale = scale
            if scale < 1.0:
                self._scale = residency.ladder.next(scale, tracker.pixel_s)
        if self._paused and not self.unseen:
            tracker.clock.pause()
        if scale == 1.0:
            tracker.even = picture.samples >= cap
            tracker.eta.passed(picture.samples, tracker.clock.elapsed_s)
            if not self._end_if_reached():
                self._report()

    def _compile_and_apply(self, update: Update) -> None:
        """Applies the update, or has its kernel compiled first: then this turn was for nothing more."""
        self.attempted = update.generation
        wanted = None
        if self._compiler is not None:
            wanted = kernel_request(update, self._settings, self._residency.loaded, self._residency.offloaded)
            self._compiling = wanted is not None and self._waits(wanted, update, self._compiler)
            if self._compiling:
                return
        self._apply(update)
        self._preview.release()
        if wanted is not None and self._compiler is not None and self.generation == update.generation:
            self._compiler.met(wanted.key)

    def _waits(self, wanted: KernelRequest, update: Update, compiler: CompileClient) -> bool:
        """Whether its kernel is being compiled; who looks on sees it with another one meanwhile."""
        looks_on = (update.interactive or self._tracker.interactive) and not self._paused
        shows = looks_on and not compiler.knows(wanted.key) and self._preview.can(wanted)
        if not compiler.waits(wanted.key, self._hear_compiled, shows):
            return False
        if shows:
            self._preview.begin(wanted, update.generation)
        else:
            self._preview.release()
        return True

    def _hear_compiled(self, milliseconds: float) -> None:
        self._compiling, self._compiled_ms = False, milliseconds

    def _apply(self, update: Update) -> None:
        """Makes the update true, or says that it failed and leaves everything as it was."""
        began, tracker, residency = time.monotonic(), self._tracker, self._residency
        self._pending, self.attempted = None, update.generation
        if update.scene is None and not residency.there:
            return  # its first one failed, which was said; only a whole scene helps
        settings = RenderSettings(**update.settings) if update.settings is not None else self._settings
        assert settings is not None  # a task's first update has them
        try:
            made = residency.change(update, settings)
        except GpuError as error:
            fallback = self.generation if residency.there else None
            refused = isinstance(error, OutOfMemory) or type(error).__name__ == "SceneTooLarge"
            self._stopping = False
            self._send(Failed(self.number, update.generation, str(error), refused, fallback=fallback))
            return
        if made is not None:
            self.release()
            residency.loaded = made
        tracker.generation = update.generation
        self._settings, tracker.stop = settings, update.stop or tracker.stop
        if update.denoise is not None:
            self._frames.denoising.wanted = update.denoise
        if update.scene is not None:
            tracker.interactive = update.interactive
        tracker.reason, self._frames.owes_done = None, False
        self._checkpoints.restart()
        if update.restarts:
            self._restart()
        if update.scene is not None or update.settings is not None:
            setup_s, warnings = time.monotonic() - began, self._warnings()
            compile_ms, self._compiled_ms = residency.full.compile_ms + self._compiled_ms, 0.0
            kernel = compile_ms, residency.full.scene.features, residency.full.scene.spared
            self._send(Loaded(self.number, self.generation, setup_s, *kernel, warnings))
            self._foresee(settings)

    def _foresee(self, settings: RenderSettings) -> None:
        """Has compiled, in spare time, what moving a large mesh would need, and the first touch of some sliders."""
        if self._spare is not None and self._tracker.interactive:
            arrays = self._residency.full.scene.arrays
            moved = kernel_keys.key_after_move(arrays, settings)
            self._spare.prepare([*([moved] if moved else []), *kernel_keys.keys_after_edit(arrays, settings)])
            self._preview.prepare(arrays, settings)

    def evict(self) -> None:
        """Leaves the device: to the machine's memory, or where the server has it already, altogether."""
        if self._forget is not None and self._kept:
            self._part()
            self._forget(self)
        else:
            self._residency.offload()

    def settle(self) -> None:
        """Applies what waits to be, for what comes next to fall back to."""
        if self._pending is not None:
            self._apply(self._pending)
            self._preview.release()

    def restore(self, restore: Restore) -> None:
        self.settle()
        if self._residency.loaded is None:
            return
        tracker = self._tracker
        self._residency.full.restore(restore.saved)
        tracker.reason, self._frames.scale = restore.reason, 1.0
        tracker.clock.set(restore.progress.elapsed_s)
        tracker.meter.set(restore.progress.samples, restore.progress.noise)
        tracker.eta.passed(restore.saved.samples, restore.progress.elapsed_s)
        tracker.even = not restore.saved.under_way[0]
        self._checkpoints.restart()

    def look(self, want: Want) -> None:
        self._frames.want = want

    def answer(self) -> bool:
        """Sends the frame that is wanted if there is something new to see in it."""
        if self._pending is None:
            return self._frames.answer()
        seen = self._compiling and self._preview.answer(self._frames.want)
        if seen:
            self._frames.want = None
        return seen

    def read(self, read: Read) -> None:
        self._frames.read(read)

    @property
    def _kept(self) -> bool:
        """The server keeps its picture."""
        return self._forget is not None and not self._tracker.interactive

    def _keep(self) -> bool:
        """A step of saving the picture, where that is due; a finished render is done when it is safe."""
        full, checkpoints = self._residency.full, self._checkpoints
        if not checkpoints.under_way:
            if not self._kept or self._tracker.reason is not None or not checkpoints.due(full):
                return False
            checkpoints.begin(full)
        saved = checkpoints.step()
        if saved is not None and self._tracker.reason is not None:
            self._say_done(saved)
        elif saved is not None:
            self._send(Checkpoint(self.number, self.generation, self.progress(), saved))
        return True

    def appraise(self) -> None:
        """A step of `appraising`."""
        self._residency.wake()
        self.savings.step(self._residency.full if self._residency.loaded is not None else None)

    def pause(self, away: bool = False) -> None:
        self._paused, self._away = True, away
        self._tracker.clock.pause()

    def resume(self) -> None:
        self._paused = self._away = False

    def stop(self) -> None:
        pending = self._pending
        if pending is not None and not pending.interactive and self._residency.loaded is None:  # not even begun
            self._pending, self._tracker.generation = None, pending.generation
            self._end("stopped")
        elif pending is not None:
            self._stopping = True
        else:
            self._stopping = False
            if self._tracker.reason is None or not self._checkpoints.under_way:
                self._checkpoints.restart()
                self._end("stopped")

    def release(self) -> None:
        """Gives the GPU's memory back; the task can be loaded again."""
        self._checkpoints.restart()
        if self._compiler is not None:
            self._compiler.forget(self._hear_compiled)
        self._preview.release()
        self._residency.release()
        self._frames.forget()

    def fail(self) -> None:
        """Nothing of it can be relied on any more; a whole scene revives it."""
        self._pending, self._stopping = None, False
        self.release()

    def progress(self) -> Progress:
        return self._tracker.progress(self._residency)

    def _part(self) -> None:
        """What is on the device leaves it, and who works on that must let it go."""
        self._frames.part()
        self._tracker.truncated.restart()
        self.savings.part()

    def _restart(self) -> None:
        self._frames.restart()
        self._tracker.restart()
        first = self._residency.loaded is not None and self._tracker.interactive
        self._scale = self._residency.ladder.first(self._tracker.pixel_s) if first else 1.0
        seen = self._preview.shown(self.generation)
        if self._scale <= seen:
            self._scale = self._residency.ladder.next(seen, self._tracker.pixel_s)

    def _end_if_reached(self) -> bool:
        reason = self._tracker.enough(self._residency)
        if reason is not None:
            self._end(reason)
        return reason is not None

    def _end(self, reason: Reason) -> None:
        residency, tracker, frames = self._residency, self._tracker, self._frames
        residency.wake()
        tracker.clock.pause()
        tracker.reason = reason
        residency.rests()
        if residency.loaded is not None:
            noise = tracker.meter.read(residency.full, fresh=True)
            wanted = frames.denoising.covers("color", noise) and frames.scale == 1.0 and reason != "stopped"
            frames.owes_done = wanted and frames.denoising.has(residency.full.samples) is None
        if not frames.owes_done:
            self._finish()

    def _finish(self) -> None:
        """Says that it has ended; where the server keeps such pictures, not before it has this one."""
        self._frames.owes_done = False
        if self._kept and self._residency.loaded is not None and self._residency.full.samples:
            self._checkpoints.begin(self._residency.full)
        else:
            self._say_done(None)

    def _say_done(self, saved: Saved | None) -> None:
        assert self._tracker.reason is not None
        self.answer()
        ended = self.generation, self._tracker.reason, self.progress(), self._warnings()
        self._send(Done(self.number, *ended, saved))

    def _warnings(self) -> list[str]:
        warnings = list(self._residency.full.warnings) if self._residency.loaded is not None else []
        why = self._frames.denoising.warning
        return warnings + ([why] if why else [])

    def _report(self) -> None:
        now = time.monotonic()
        due = not self._tracker.interactive and now - self._reported >= PROGRESS_S
        if due and self._residency.full.samples:
            self._reported = now
            self._send(Progressed(self.number, self.generation, self.progress()))
