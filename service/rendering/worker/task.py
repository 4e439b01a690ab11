"""One client's picture: loaded, edited, traced slice by slice, shown when wanted, ended when it has had enough."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

import numpy as np

from gpu import GpuError, OutOfMemory, RenderSettings, picture_bytes, save
from gpu.denoise import GUIDE_SAMPLES
from service.rendering.messages import (
    Done,
    Failed,
    Frame,
    FromRenderer,
    Image,
    Loaded,
    Progress,
    Progressed,
    Read,
    Reason,
    Restore,
    StopRule,
    Update,
    View,
    Want,
)
from service.rendering.worker.beyond import Beyond
from service.rendering.worker.compiler import Compiler
from service.rendering.worker.denoiser import Denoiser
from service.rendering.worker.holding import Aside, Holding, kernel_of, needed
from service.rendering.worker.ladder import FULL_S, Ladder
from service.rendering.worker.memory import UNLIMITED, Memory
from service.rendering.worker.meter import Meter
from service.rendering.worker.smoothing import Smooth, Smoothing
from service.rendering.worker.stopping import MAX_SAMPLES, Clock, eta_s, late, reached

if TYPE_CHECKING:
    from gpu import Picture, Renderer, Saved

SLICE_S = 0.015  # how long a message may have to wait, and how finely the GPU is shared
GUIDES = ("albedo", "normal", "depth", "shape_id", "material_id")
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
    ) -> None:
        """With `compiler`, others need not wait for its kernels.

        With `forget`, Done brings the picture of a render to the server; what is forgotten it can bring back."""
        self.number, self.client = number, client
        self.generation = self.attempted = 0  # of what is there, and of the last update
        self.used_s = 0.0
        self.want: Want | None = None
        self.traced = 0  # samples of pixels
        self.rested_since = 0.0
        self._renderer, self._send, self._forget = renderer, send, forget
        self._memory = memory or Memory(UNLIMITED, list)
        self._shown: float | None = None  # the scale of what there is to see
        self._scale = 1.0  # of what is traced
        self._pending: Update | None = None  # not applied yet
        self._stopping = False  # when that was applied
        self._compiler = compiler
        self._compiling = False  # what waits to be applied waits for its kernel
        self._compiled_ms = 0.0  # what that took elsewhere
        self._holding: Holding | None = None  # None: nothing loaded, or it failed, or it was put aside
        self._aside: Aside | None = None
        self._settings: RenderSettings | None = None
        self._stop = StopRule()
        self._interactive = False
        self._paused = self._away = False
        self._reason: Reason | None = None  # why it ended
        self._beyond = Beyond(renderer)
        self._saving: Generator[None, None, Saved] | None = None  # a finished picture, for the server to keep
        self._pixel_s: float | None = None  # what a sample of a pixel took lately
        self._served: tuple[object, ...] = ()
        self._reads: list[Read] = []  # waiting for AOVs of the first hit, which are traced when asked for
        self._guided: Picture | None = None  # whose they are, while some are missing
        self._smoothing = Smoothing(denoiser, yields=bool(renderer.info["software"]))
        self._smooth_reads: list[Read] = []  # waiting for the denoised picture
        self._smoothed = False  # the denoiser has spoken, and who waits for that is to be told
        self._owes_done = False  # ended, and to be said when the denoised picture is there
        self._reported = 0.0
        self._restart()

    @property
    def ready(self) -> bool:
        if self._away:
            return False
        if self._pending is not None:
            return not self._compiling
        if self._holding is None and self._aside is None:
            return False
        if self._guided is not None or self._saving is not None or self._smoothed or self._smooth_due:
            return True
        return self._reason is None and (self.unseen or not (self._paused or self._smoothing.holds))

    @property
    def unseen(self) -> bool:
        pending = self._pending
        if pending is not None and (pending.restarts or self._holding is None):
            return pending.interactive or self._interactive
        return self._shown is None and self._interactive

    @property
    def loads(self) -> bool:
        """Its next turn may take as long as a compilation does."""
        return self._pending is not None

    @property
    def awaited(self) -> bool:
        """Somebody would notice if the loop stood still: there is work, or a person who may edit at any moment."""
        if self._pending is not None:
            return True
        there = self._holding is not None or self._aside is not None
        return there and not self._away and (self._interactive or self.ready)

    @property
    def idle(self) -> bool:
        return self._holding is not None and not self.ready and not self._smoothing.pending

    @property
    def bytes(self) -> int:
        return 0 if self._holding is None else self._holding.bytes

    def update(self, update: Update) -> None:
        """To be applied in the next turn, joined with what else waits for it."""
        if update.base is not None and update.base != (self._pending or self).generation:
            return  # it changes what failed, which the server will hear, and say what it wants now
        self._pending = self._pending.then(update) if self._pending is not None else update
        self._stopping = self._compiling = False

    def turn(self) -> None:
        """Applies what has changed, traces a slice, and ends the render when that was the last."""
        if self._pending is not None:
            self._compile_and_apply(self._pending)
            if self._compiling:
                return
        if self._stopping:
            self.stop()
        self._wake()
        if self._holding is None or self._smooth() or self._trace_guides() or self._save():
            return
        if self._reason is not None:
            return
        if not (self._end_if_reached() or self._beyond.step(self._full)):
            self._trace()
        self.rested_since = time.monotonic()

    def _trace(self) -> None:
        ladder, scale = self._ladder, self._scale
        picture = ladder.picture(scale)
        cap = 1 if self.unseen or scale < 1.0 else self._cap()
        self._clock.start()
        before = picture.samples
        picture.trace(FULL_S if self.unseen else SLICE_S, cap)
        self._clock.lap()
        self.traced += (picture.samples - before) * picture.settings.width * picture.settings.height
        self._pixel_s = picture.cost_s or self._pixel_s
        if picture.samples:
            self._shown = scale
            if scale < 1.0:
                self._scale = ladder.next(scale, self._pixel_s)
        if self._paused and not self.unseen:
            self._clock.pause()
        if scale == 1.0:
            self._even = picture.samples >= cap
            if not self._end_if_reached():
                self._report()

    def _compile_and_apply(self, update: Update) -> None:
        """Applies the update, or has its kernel compiled first: then this turn was for nothing more."""
        self.attempted = update.generation
        kernel = None
        if self._compiler is not None:
            kernel = kernel_of(update, self._settings, self._holding, self._aside)
            self._compiling = kernel is not None and self._compiler.waits(kernel, self._hear_compiled)
            if self._compiling:
                return
        self._apply(update)
        if kernel is not None and self._compiler is not None and self.generation == update.generation:
            self._compiler.met(kernel)

    def _hear_compiled(self, milliseconds: float) -> None:
        self._compiling, self._compiled_ms = False, milliseconds

    def _apply(self, update: Update) -> None:
        """Makes the update true, or says that it failed and leaves everything as it was."""
        began = time.monotonic()
        self._pending, self.attempted = None, update.generation
        if update.scene is None and self._holding is None and self._aside is None:
            return  # its first one failed, which was said; only a whole scene helps
        settings = RenderSettings(**update.settings) if update.settings is not None else self._settings
        assert settings is not None  # a task's first update has them
        try:
            self._hold(update, settings)
        except GpuError as error:
            fallback = None if self._holding is None and self._aside is None else self.generation
            refused = isinstance(error, OutOfMemory) or type(error).__name__ == "SceneTooLarge"
            self._stopping = False
            self._send(Failed(self.number, update.generation, str(error), refused, fallback=fallback))
            return
        self.generation = update.generation
        self._settings, self._stop = settings, update.stop or self._stop
        if update.denoise is not None:
            self._smoothing.wanted = update.denoise
        if update.scene is not None:
            self._interactive = update.interactive
        self._reason, self._saving, self._owes_done = None, None, False
        if update.restarts:
            self._restart()
        if update.scene is not None or update.settings is not None:
            setup_s, warnings = time.monotonic() - began, self._warnings()
            compile_ms, self._compiled_ms = self._full.compile_ms + self._compiled_ms, 0.0
            kernel = compile_ms, self._full.scene.features, self._full.scene.spared
            self._send(Loaded(self.number, self.generation, setup_s, *kernel, warnings))

    def _hold(self, update: Update, settings: RenderSettings) -> None:
        """Has on the device what the update asks for; what was there goes only when that has come."""
        if update.scene is None:
            self._wake()
            assert self._holding is not None
            if update.edits:
                self._holding.scene.edit(**update.edits)
            if update.settings is None:
                if update.edits:
                    self._ladder.reset()
                return
            old = self._ladder.full.settings
            if (old.width, old.height) == (settings.width, settings.height):
                self._ladder.configure(settings)
                return

        def make() -> Holding | None:
            if update.scene is None:
                assert self._holding is not None
                self._holding.resize(settings)
                return None
            return Holding(self._renderer, update.scene, settings, update.interactive, update.edits)

        made = self._with_room(needed(update.scene, settings), make, update.scene is not None)
        if made is not None:
            self.release()
            self._holding = made

    def _with_room(self, size: int, make: Callable[[], Holding | None], whole: bool) -> Holding | None:
        """What `make` makes, where need be at the expense of who rests, and of the task's own picture."""
        try:
            self._memory.make_room(size, self)
            return self._insist(make)
        except OutOfMemory:
            if self._holding is None or not whole:
                raise
            self._guided = None
            self._beyond.restart()
            self._aside, self._holding = self._holding.aside(), None
            self._memory.make_room(size, self)
            return self._insist(make)

    def _insist(self, make: Callable[[], Holding | None]) -> Holding | None:
        """The driver may have less than is allowed."""
        while True:
            try:
                return make()
            except OutOfMemory:
                if not self._memory.evict_one(self):
                    raise

    def _wake(self) -> None:
        """Has back on the device what was put aside."""
        if self._aside is not None and self._holding is None:
            aside = self._aside
            self._memory.make_room(needed(aside.arrays, aside.settings), self)
            self._holding = self._insist(lambda: Holding.back(self._renderer, aside))
            self._aside = None

    def evict(self) -> None:
        """Leaves the device: to the machine's memory, or where the server has it already, altogether."""
        assert self._holding is not None
        self._guided = None
        self._beyond.restart()
        if not self._interactive and self._forget is not None:
            self._forget(self)
        else:
            self._aside, self._holding = self._holding.aside(), None

    def restore(self, restore: Restore) -> None:
        if self._pending is not None:
            self._apply(self._pending)
        if self._holding is None:
            return
        self._full.restore(restore.saved)
        self._reason, self._saving, self._shown = restore.reason, None, 1.0
        self._clock.set(restore.progress.elapsed_s)
        self._meter.set(restore.progress.samples, restore.progress.noise)

    def answer(self) -> bool:
        """Sends the frame that is wanted if there is something new to see in it."""
        want, shown = self.want, self._shown
        if want is None or shown is None or self._pending is not None:
            return False
        if self._aside is not None:  # at rest: there is nothing new in it
            if self._served and self._served[3] == self._reason and not want.anyway:
                return False
            self._wake()
        if self._holding is None:
            return False
        picture = self._ladder.picture(shown)
        if self._needs_guides(picture, want.view):
            return False
        smooth = None
        if shown == 1.0 and self._smoothing.covers(want.view.aov, self._meter.noise):
            smooth = self._smooth_frame()
            if smooth is None and self._holds_frame(want):
                return False
        progress = smooth.progress if smooth else self.progress(scale=shown)
        whole = smooth is None or smooth is self._smoothing.has(picture.samples)
        content = (self.generation, shown, progress.samples, self._reason, smooth is not None and smooth.fine)
        if content == self._served and not want.anyway:
            return False
        pixels = _pixels_of(picture, want.view, smooth)
        last = self._reason is not None and whole
        self._served, self.want = content, None
        denoised = smooth is not None
        self._send(Frame(self.number, want.serial, self.generation, pixels, progress, shown, last, denoised))
        return True

    def _smooth_frame(self) -> Smooth | None:
        """The newest denoised picture, unless the client has seen more, or as much and waits no longer."""
        latest = self._smoothing.latest
        if latest is None or self._served[:2] != (self.generation, 1.0):
            return latest
        samples, seen = latest.progress.samples, int(str(self._served[2]))
        stale = samples == seen < self._full.samples and not self._smoothing.under_way
        return None if samples < seen or stale else latest

    def _holds_frame(self, want: Want) -> bool:
        """Whether the client has something to look at until the denoised picture comes, which can't be long."""
        return self._smoothing.under_way and self._served[:1] == (self.generation,) and not want.anyway

    def read(self, read: Read) -> None:
        self._wake()
        full = self._full if self._holding and self._full.samples else None
        if full is not None and self._needs_guides(full, read.view):
            self._reads.append(read)
            return
        smooth = None
        if full is not None and self._smoothing.covers(read.view.aov, self._meter.read(full, fresh=True)):
            smooth = self._smoothing.has(full.samples)
            if smooth is None:
                self._smooth_reads.append(read)
                return
        self._give(read, full, smooth)

    def _give(self, read: Read, full: Picture | None, smooth: Smooth | None) -> None:
        pixels = _pixels_of(full, read.view, smooth) if full else None
        progress = smooth.progress if smooth else self.progress()
        self.rested_since = time.monotonic()
        self._send(Image(self.number, read.serial, pixels, progress, smooth is not None))

    @property
    def _smooth_due(self) -> bool:
        """Whether somebody waits for the picture to be denoised, and it can be."""
        if self._holding is None or self._shown != 1.0 or not self._smoothing.wanted:
            return False
        want = self.want if self._interactive else None
        watched = want is not None and self._smoothing.covers(want.view.aov, self._meter.noise)
        if not (watched or self._owes_done or self._smooth_reads):
            return False
        return self._smoothing.due(self._full.samples, fine=self._smooth_finely)

    @property
    def _smooth_finely(self) -> bool:
        return self._reason is not None or bool(self._smooth_reads)

    def _smooth(self) -> bool:
        """A slice of what denoising needs on this side, where any is due."""
        if self._smoothed:
            self._smoothed = False
            reads, self._smooth_reads = self._smooth_reads, []
            for read in reads:
                self._give(read, self._full, None if self._smoothing.warning else self._smoothing.latest)
            if self._owes_done:
                self._finish()
            return True
        if not self._smooth_due:
            return False
        if self._full.trace_guides(SLICE_S, GUIDE_SAMPLES):
            self._meter.read(self._full, fresh=True)
            self._smoothing.begin(self._full, self.progress(), self._smooth_finely, self._hear_smoothed)
        return True

    def _hear_smoothed(self) -> None:
        self._smoothed = True

    def _needs_guides(self, picture: Picture, view: View) -> bool:
        if view.aov not in GUIDES:
            return False
        if not picture.guided:
            more = picture_bytes(picture.settings, guided=True) - picture_bytes(picture.settings)
            self._memory.make_room(more, self)
        if picture.trace_guides(0.0):
            return False
        self._guided = picture
        return True

    def _trace_guides(self) -> bool:
        """A slice of them, where somebody waits for them; then the readings that they held up."""
        if self._guided is None:
            return False
        if self._guided.trace_guides(SLICE_S):
            self._guided = None
            reads, self._reads = self._reads, []
            for read in reads:
                self.read(read)
        return True

    def _save(self) -> bool:
        """A step of saving the finished picture; the render is done when it is safe."""
        if self._saving is None:
            return False
        try:
            next(self._saving)
        except StopIteration as end:
            self._saving = None
            self._say_done(end.value)
        return True

    def pause(self, away: bool = False) -> None:
        self._paused, self._away = True, away
        self._clock.pause()

    def resume(self) -> None:
        self._paused = self._away = False

    def stop(self) -> None:
        pending = self._pending
        if pending is not None and not pending.interactive and self._holding is None:  # not even begun
            self._pending, self.generation = None, pending.generation
            self._end("stopped")
        elif pending is not None:
            self._stopping = True
        else:
            self._stopping = False
            if self._saving is None:
                self._end("stopped")

    def release(self) -> None:
        """Gives the GPU's memory back; the task can be loaded again."""
        holding, self._holding = self._holding, None
        self._guided = self._aside = self._saving = None
        self._beyond.restart()
        self._shown = None
        reads = self._reads + self._smooth_reads
        self._reads, self._smooth_reads = [], []
        self._smoothing.restart()
        self._owes_done = self._smoothed = False
        if self._compiler is not None:
            self._compiler.forget(self._hear_compiled)
        for read in reads:
            self.read(read)
        if holding is not None:
            holding.release()

    def fail(self) -> None:
        """Nothing of it can be relied on any more; a whole scene revives it."""
        self._pending, self._stopping = None, False
        self.release()

    def progress(self, scale: float = 1.0) -> Progress:
        if self._holding is None:
            return Progress()
        samples, elapsed_s = self._ladder.picture(scale).samples, self._clock.elapsed_s
        noise = self._meter.read(self._full) if scale == 1.0 else None
        done = self._reason is not None and self._reason != "stopped"
        eta = 0.0 if done else eta_s(self._stop, self._full.samples, noise, elapsed_s)
        missing = self._beyond.shares
        return Progress(samples, noise, elapsed_s, None if self._reason == "stopped" else eta, missing)

    @property
    def _ladder(self) -> Ladder:
        assert self._holding is not None
        return self._holding.ladder

    @property
    def _full(self) -> Picture:
        return self._ladder.full

    def _restart(self) -> None:
        self._guided = None
        self._beyond.restart()
        self._smoothing.restart()
        self._smoothed = False
        self._clock = Clock()
        self._shown = None
        first = self._holding is not None and self._interactive
        self._scale = self._ladder.first(self._pixel_s) if first else 1.0
        self._meter = Meter()
        self._even = True  # as many samples in every pixel, as far as is known

    def _cap(self) -> int:
        """How many samples to trace for: all, or what fits into the time, so that every pixel ends with as many."""
        samples, limit = self._full.samples, self._stop.max_samples or MAX_SAMPLES
        if self._stop.time_limit is None:
            return limit
        left_s = self._stop.time_limit - self._clock.now_s
        return min(limit, samples + max(1, int(left_s / self._sample_s) if self._sample_s else 1))

    @property
    def _sample_s(self) -> float:
        return (self._pixel_s or 0.0) * self._full.settings.width * self._full.settings.height

    def _end_if_reached(self) -> bool:
        noise = self._meter.read(self._full) if self._stop.target_noise is not None else None
        reason = reached(self._stop, self._full.samples, noise)
        if reason is None and late(self._stop, self._clock.now_s, self._sample_s, self._even):
            reason = "time_limit"
        if reason is not None:
            self._end(reason)
        return reason is not None

    def _end(self, reason: Reason) -> None:
        self._wake()
        self._clock.pause()
        self._reason = reason
        self.rested_since = time.monotonic()
        if self._holding is not None:
            noise = self._meter.read(self._full, fresh=True)
            wanted = self._smoothing.covers("color", noise) and self._shown == 1.0 and reason != "stopped"
            self._owes_done = wanted and self._smoothing.has(self._full.samples) is None
        if not self._owes_done:
            self._finish()

    def _finish(self) -> None:
        """Says that it has ended; where the server keeps such pictures, not before it has this one."""
        self._owes_done = False
        keep = self._forget is not None and not self._interactive
        if keep and self._holding is not None and self._full.samples:
            self._saving = save(self._full)
        else:
            self._say_done(None)

    def _say_done(self, saved: Saved | None) -> None:
        assert self._reason is not None
        self.answer()
        self._send(Done(self.number, self.generation, self._reason, self.progress(), self._warnings(), saved))

    def _warnings(self) -> list[str]:
        warnings = list(self._full.warnings) if self._holding is not None else []
        return warnings + ([self._smoothing.warning] if self._smoothing.warning else [])

    def _report(self) -> None:
        now = time.monotonic()
        if not self._interactive and self._full.samples and now - self._reported >= PROGRESS_S:
            self._reported = now
            self._send(Progressed(self.number, self.generation, self.progress()))


def _pixels_of(picture: Picture, view: View, smooth: Smooth | None) -> np.ndarray:
    color = smooth.pixels if smooth else None
    if view.encoding == "linear":
        return picture.read(view.aov) if color is None else color
    return picture.display(view.aov, view.exposure, view.tone_map, view.encoding, color)
