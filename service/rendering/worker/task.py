"""One client's picture: loaded, edited, traced slice by slice, shown when wanted, ended when it has had enough."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gpu import RenderSettings
from gpu.denoise import GUIDE_SAMPLES
from service.rendering.messages import (
    Done,
    Frame,
    FromRenderer,
    Image,
    Loaded,
    Progress,
    Progressed,
    Read,
    Reason,
    StopRule,
    Update,
    View,
    Want,
)
from service.rendering.worker.denoiser import Denoiser
from service.rendering.worker.ladder import FULL_S, Ladder
from service.rendering.worker.smoothing import Smooth, Smoothing
from service.rendering.worker.stopping import MAX_SAMPLES, Clock, eta_s, late, reached

if TYPE_CHECKING:
    from gpu import Picture, Renderer, Scene

SLICE_S = 0.015  # how long a message may have to wait, and how finely the GPU is shared
GUIDES = ("albedo", "normal", "depth", "shape_id", "material_id")
PROGRESS_S = 0.1  # between two reports of how far it is
NOISE_PAUSE = 20  # times what reading the noise meter took until the next reading, which so costs 5 % at most


class Task:
    def __init__(
        self, renderer: Renderer, number: int, send: Callable[[FromRenderer], None], denoiser: Denoiser
    ) -> None:
        self.number = number
        self.generation = 0
        self.used_s = 0.0
        self.want: Want | None = None
        self.traced = 0  # samples of pixels
        self._renderer = renderer
        self._send = send
        self._scene: Scene | None = None
        self._ladder: Ladder | None = None  # None: nothing loaded, or it failed
        self._settings: RenderSettings | None = None
        self._stop = StopRule()
        self._interactive = False
        self._paused = False
        self._reason: Reason | None = None  # why it ended
        self._pixel_s: float | None = None  # what a sample of a pixel took lately
        self._served: tuple[object, ...] = ()
        self._reads: list[Read] = []  # waiting for AOVs of the first hit, which are traced when asked for
        self._guided: Picture | None = None  # whose they are, while some are missing
        self._smoothing = Smoothing(denoiser, yields=bool(renderer.info["software"]))
        self._smooth_reads: list[Read] = []  # waiting for the denoised picture
        self._smoothed = False  # the denoiser has spoken, and who waits for that is to be told
        self._owes_done = False  # ended, and to be said when the denoised picture is there
        self._reported = 0.0
        self._scale = 1.0  # of what is traced
        self._shown: float | None = None  # the scale of what there is to see
        self._restart()

    @property
    def ready(self) -> bool:
        if self._ladder is None:
            return False
        if self._guided is not None or self._smoothed or self._smooth_due:
            return True
        return self._reason is None and (self.unseen or not (self._paused or self._smoothing.holds))

    @property
    def unseen(self) -> bool:
        return self._shown is None and self._interactive

    def update(self, update: Update) -> None:
        began = time.monotonic()
        self.generation = update.generation
        self._stop = update.stop or self._stop
        if update.denoise is not None:
            self._smoothing.wanted = update.denoise
        if update.settings is not None:
            self._settings = RenderSettings(**update.settings)
        if update.scene is not None:
            self._interactive = update.interactive
            self._load(update)
        elif self._ladder is None or self._scene is None or self._settings is None:
            return  # it failed, which was said; only a whole scene helps
        else:
            if update.edits:
                self._scene.edit(**update.edits)
            if update.settings is not None:
                self._ladder.configure(self._settings)
            elif update.edits:
                self._ladder.reset()
        self._reason, self._owes_done = None, False
        if update.restarts:
            self._restart()
        if update.scene is not None or update.settings is not None:
            setup_s, warnings = time.monotonic() - began, self._warnings()
            self._send(Loaded(self.number, self.generation, setup_s, self._full.compile_ms, warnings))

    def step(self) -> None:
        """Traces a slice, and ends the render when that was the last."""
        if self._ladder is None or self._smooth() or self._trace_guides() or self._end_if_reached():
            return
        scale, picture = self._scale, self._ladder.picture(self._scale)
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
                self._scale = self._ladder.next(scale, self._pixel_s)
        if self._paused and not self.unseen:
            self._clock.pause()
        if scale == 1.0:
            self._even = picture.samples >= cap
            if not self._end_if_reached():
                self._report()

    def answer(self) -> bool:
        """Sends the frame that is wanted if there is something new to see in it."""
        want, shown = self.want, self._shown
        if want is None or shown is None or self._ladder is None:
            return False
        picture = self._ladder.picture(shown)
        if self._needs_guides(picture, want.view):
            return False
        smooth = None
        if shown == 1.0 and self._smoothing.covers(want.view.aov, self._noise):
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
        """The newest denoised picture, unless the client has seen more samples than are in it."""
        latest, seen = self._smoothing.latest, self._served[:2] == (self.generation, 1.0)
        if latest is None or (seen and latest.progress.samples < int(str(self._served[2]))):
            return None
        return latest

    def _holds_frame(self, want: Want) -> bool:
        """Whether the client has something to look at until the denoised picture comes, which can't be long."""
        return self._smoothing.under_way and self._served[:1] == (self.generation,) and not want.anyway

    def read(self, read: Read) -> None:
        full = self._full if self._ladder and self._full.samples else None
        if full is not None and self._needs_guides(full, read.view):
            self._reads.append(read)
            return
        smooth = None
        if full is not None and self._smoothing.covers(read.view.aov, self._measured_noise(fresh=True)):
            smooth = self._smoothing.has(full.samples)
            if smooth is None:
                self._smooth_reads.append(read)
                return
        self._give(read, full, smooth)

    def _give(self, read: Read, full: Picture | None, smooth: Smooth | None) -> None:
        pixels = _pixels_of(full, read.view, smooth) if full else None
        progress = smooth.progress if smooth else self.progress()
        self._send(Image(self.number, read.serial, pixels, progress, smooth is not None))

    @property
    def _smooth_due(self) -> bool:
        """Whether somebody waits for the picture to be denoised, and it can be."""
        if self._ladder is None or self._shown != 1.0 or not self._smoothing.wanted:
            return False
        want = self.want if self._interactive else None
        watched = want is not None and self._smoothing.covers(want.view.aov, self._noise)
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
            self._measured_noise(fresh=True)
            self._smoothing.begin(self._full, self.progress(), self._smooth_finely, self._hear_smoothed)
        return True

    def _hear_smoothed(self) -> None:
        self._smoothed = True

    def _needs_guides(self, picture: Picture, view: View) -> bool:
        if view.aov not in GUIDES or picture.trace_guides(0.0):
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

    def pause(self) -> None:
        self._paused = True
        self._clock.pause()

    def resume(self) -> None:
        self._paused = False

    def stop(self) -> None:
        self._end("stopped")

    def release(self) -> None:
        """Gives the GPU's memory back; the task can be loaded again."""
        ladder, scene = self._ladder, self._scene
        self._ladder = self._scene = self._guided = None
        self._shown = None
        reads = self._reads + self._smooth_reads
        self._reads, self._smooth_reads = [], []
        self._smoothing.restart()
        self._owes_done = self._smoothed = False
        for read in reads:
            self.read(read)
        if ladder is not None:
            ladder.release()
        if scene is not None:
            scene.release()

    def progress(self, scale: float = 1.0) -> Progress:
        if self._ladder is None:
            return Progress()
        samples, elapsed_s = self._ladder.picture(scale).samples, self._clock.elapsed_s
        noise = self._measured_noise() if scale == 1.0 else None
        done = self._reason is not None and self._reason != "stopped"
        eta = 0.0 if done else eta_s(self._stop, self._full.samples, noise, elapsed_s)
        return Progress(samples, noise, elapsed_s, None if self._reason == "stopped" else eta)

    @property
    def _full(self) -> Picture:
        assert self._ladder is not None
        return self._ladder.full

    def _load(self, update: Update) -> None:
        self.release()
        assert self._settings is not None  # an update with a scene is a task's first, or the settings are known
        self._scene = self._renderer.load(update.scene, editing=self._interactive)
        if update.edits:
            self._scene.edit(**update.edits)
        self._ladder = Ladder(self._renderer, self._scene, self._settings)

    def _restart(self) -> None:
        self._guided = None
        self._smoothing.restart()
        self._smoothed = False
        self._clock = Clock()
        self._shown = None
        self._scale = self._ladder.first(self._pixel_s) if self._ladder and self._interactive else 1.0
        self._noise: float | None = None
        self._noise_at, self._noise_due = 0, 0.0  # samples at the last reading; the time of the next
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

    def _measured_noise(self, fresh: bool = False) -> float | None:
        samples, began = self._full.samples, time.monotonic()
        if samples >= 2 and samples > self._noise_at and (fresh or began >= self._noise_due):
            self._noise, self._noise_at = self._full.noise(), samples
            now = time.monotonic()
            self._noise_due = now + NOISE_PAUSE * (now - began)
        return self._noise

    def _end_if_reached(self) -> bool:
        noise = self._measured_noise() if self._stop.target_noise is not None else None
        reason = reached(self._stop, self._full.samples, noise)
        if reason is None and late(self._stop, self._clock.now_s, self._sample_s, self._even):
            reason = "time_limit"
        if reason is not None:
            self._end(reason)
        return reason is not None

    def _end(self, reason: Reason) -> None:
        self._clock.pause()
        self._reason = reason
        if self._ladder is not None:
            self._measured_noise(fresh=True)
            wanted = self._smoothing.covers("color", self._noise) and self._shown == 1.0 and reason != "stopped"
            self._owes_done = wanted and self._smoothing.has(self._full.samples) is None
        if not self._owes_done:
            self._finish()

    def _finish(self) -> None:
        """Says that it has ended, after the last frame."""
        self._owes_done = False
        self.answer()
        assert self._reason is not None
        self._send(Done(self.number, self.generation, self._reason, self.progress(), self._warnings()))

    def _warnings(self) -> list[str]:
        warnings = list(self._full.warnings) if self._ladder is not None else []
        return warnings + ([self._smoothing.warning] if self._smoothing.warning else [])

    def _report(self) -> None:
        now = time.monotonic()
        if not self._interactive and now - self._reported >= PROGRESS_S:
            self._reported = now
            self._send(Progressed(self.number, self.generation, self.progress()))


def _pixels_of(picture: Picture, view: View, smooth: Smooth | None) -> np.ndarray:
    color = smooth.pixels if smooth else None
    if view.encoding == "linear":
        return picture.read(view.aov) if color is None else color
    return picture.display(view.aov, view.exposure, view.tone_map, view.encoding, color)
