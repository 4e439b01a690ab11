"""One client's picture: loaded, edited, traced slice by slice, shown when wanted, ended when it has had enough."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gpu import RenderSettings
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
from service.rendering.worker.ladder import FULL_S, Ladder
from service.rendering.worker.stopping import MAX_SAMPLES, Clock, eta_s, late, reached

if TYPE_CHECKING:
    from gpu import Picture, Renderer, Scene

SLICE_S = 0.015  # how long a message may have to wait, and how finely the GPU is shared
GUIDES = ("albedo", "normal", "depth", "shape_id", "material_id")
PROGRESS_S = 0.1  # between two reports of how far it is
NOISE_PAUSE = 20  # times what reading the noise meter took until the next reading, which so costs 5 % at most


class Task:
    def __init__(self, renderer: Renderer, number: int, send: Callable[[FromRenderer], None]) -> None:
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
        self._reported = 0.0
        self._scale = 1.0  # of what is traced
        self._shown: float | None = None  # the scale of what there is to see
        self._restart()

    @property
    def ready(self) -> bool:
        if self._ladder is None:
            return False
        return self._guided is not None or (self._reason is None and (self.unseen or not self._paused))

    @property
    def unseen(self) -> bool:
        return self._shown is None and self._interactive

    def update(self, update: Update) -> None:
        began = time.monotonic()
        self.generation = update.generation
        self._stop = update.stop or self._stop
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
        self._reason = None
        if update.restarts:
            self._restart()
        if update.scene is not None or update.settings is not None:
            setup_s, warnings = time.monotonic() - began, list(self._full.warnings)
            self._send(Loaded(self.number, self.generation, setup_s, self._full.compile_ms, warnings))

    def step(self) -> None:
        """Traces a slice, and ends the render when that was the last."""
        if self._ladder is None or self._trace_guides() or self._end_if_reached():
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
        content = (self.generation, shown, picture.samples, self._reason)
        if content == self._served and not want.anyway:
            return False
        pixels = _pixels_of(picture, want.view)
        progress = self.progress(scale=shown)
        last = self._reason is not None
        self._served, self.want = content, None
        self._send(Frame(self.number, want.serial, self.generation, pixels, progress, shown, last))
        return True

    def read(self, read: Read) -> None:
        full = self._full if self._ladder and self._full.samples else None
        if full is not None and self._needs_guides(full, read.view):
            self._reads.append(read)
            return
        pixels = _pixels_of(full, read.view) if full else None
        self._send(Image(self.number, read.serial, pixels, self.progress()))

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
        reads, self._reads = self._reads, []
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
        warnings: list[str] = []
        if self._ladder is not None:
            self._measured_noise(fresh=True)
            warnings = list(self._full.warnings)
        self.answer()
        self._send(Done(self.number, self.generation, reason, self.progress(), warnings))

    def _report(self) -> None:
        now = time.monotonic()
        if not self._interactive and now - self._reported >= PROGRESS_S:
            self._reported = now
            self._send(Progressed(self.number, self.generation, self.progress()))


def _pixels_of(picture: Picture, view: View) -> np.ndarray:
    if view.encoding == "linear":
        return picture.read(view.aov)
    return picture.display(view.aov, view.exposure, view.tone_map, view.encoding)
