"""First looks at a scene that waits for its own kernel, traced by another one.

They are small, so that the picture by its own kernel, which begins anew, is larger whenever it comes.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gpu import FIRST_HIT_AOVS, scene_bytes
from gpu.precompile import fallback
from service.ipc.messages import Frame, FromRenderer, Progress, Want
from service.worker.device.loaded_scene import KernelRequest
from service.worker.device.resolution_ladder import FIRST_S, SCALES, SMALLEST_SIDE, ResolutionLadder
from service.worker.helpers.first_look_client import Look
from service.worker.progress import NoiseReading
from service.worker.view.denoise_policy import Denoised, is_for_the_eye
from service.worker.view.frames import SLICE_S, pixels_of

if TYPE_CHECKING:
    from gpu import Renderer, RenderSettings, Scene
    from service.worker.helpers.first_look_client import FirstLookClient


MOST_BYTES = 1 << 28  # of a scene: it is on the device twice, and of this size it loads in 0.1 s
ENOUGH_S = 0.25  # of tracing: on llvmpipe it takes from the compiler what it is there to bridge
LARGEST = 1 / 2  # of the scales
BEGIN_S = 4e-6  # a sample of a pixel, before there was one (llvmpipe with 2 cores)


class _Content(NamedTuple):
    """The content of a frame: one with equal content would show nothing new."""

    generation: int
    scale: float
    samples: int


def is_large(settings: RenderSettings) -> bool:
    """True if a picture can be shown smaller than it is."""
    return min(settings.width, settings.height) * LARGEST >= SMALLEST_SIDE


def serves(wanted: KernelRequest) -> bool:
    """True if the update is worth a first look: its picture is large enough, and its scene no burden."""
    return is_large(wanted.settings) and scene_bytes(wanted.arrays) <= MOST_BYTES


class FirstLook:
    """The first looks of one task. Its methods raise what the renderer raises."""

    def __init__(
        self,
        number: int,
        send: Callable[[FromRenderer], None],
        renderer: Renderer,
        denoise: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> None:
        """`denoise` takes colour, as Picture.read gives it, where this process may be kept waiting by that."""
        self.generation = 0
        self.scale: float | None = None  # of what there is to see
        self._number, self._send, self._renderer, self._denoise = number, send, renderer, denoise
        self._scene: Scene | None = None
        self._ladder: ResolutionLadder | None = None
        self._next = 1.0  # the scale that is traced
        self._pixel_s = BEGIN_S
        self._spent_s = 0.0
        self._meter = NoiseReading()  # of the picture that is shown
        self._served: _Content | None = None  # of the last frame that was sent
        self._shown = (0, 0.0)
        self._began = 0.0

    @property
    def scene(self) -> Scene | None:
        """The scene that it shows, or showed last."""
        return self._scene

    @property
    def bytes(self) -> int:
        if self._scene is None or self._ladder is None:
            return 0
        return self._scene.bytes + self._ladder.bytes

    @property
    def shows(self) -> bool:
        """True if there is something that it shows."""
        return self._ladder is not None

    @property
    def due(self) -> bool:
        """True if there is more to trace."""
        return self._ladder is not None and (self.scale != self._next or self._spent_s < ENOUGH_S)

    def begin(self, scene: Scene, settings: RenderSettings, generation: int) -> None:
        """Begin to show a scene, which is released with this object or in favour of the next one."""
        self.generation, self.scale, self._began, self._spent_s = generation, None, time.monotonic(), 0.0
        self._meter = NoiseReading()
        if self._ladder is not None:
            self._ladder.release()
        if self._scene is not None and self._scene is not scene:
            self._scene.release()
        self._scene, self._ladder = scene, None
        ladder = ResolutionLadder(self._renderer, scene, settings, full=False)
        self._next = self._fitting(ladder, FIRST_S)
        ladder.picture(self._next)
        self._ladder = ladder

    def step(self) -> int:
        """Trace for a slice; how many samples of pixels that were."""
        ladder = self._ladder
        if ladder is None:
            return 0
        picture = ladder.picture(self._next)
        before = picture.samples
        self._spent_s += picture.trace(SLICE_S, before + 1)
        self._pixel_s = picture.cost_s or self._pixel_s
        if picture.samples:
            if self.scale != self._next:
                self._meter = NoiseReading()
            self.scale = self._next
            if self._spent_s < ENOUGH_S:
                self._next = max(self._next, self._fitting(ladder, ENOUGH_S - self._spent_s))
        return (picture.samples - before) * picture.settings.width * picture.settings.height

    def _fitting(self, ladder: ResolutionLadder, seconds: float) -> float:
        """The largest scale at which a sample takes no longer, or the smallest one there is."""
        scales = [scale for scale in SCALES if scale <= LARGEST]
        return next((s for s in scales if ladder.pixels(s) * self._pixel_s <= seconds), scales[-1])

    def answer(self, want: Want | None) -> bool:
        """Send the frame that is wanted, if it would show something new."""
        if want is None or self.scale is None or self._ladder is None or want.view.aov in FIRST_HIT_AOVS:
            return False
        picture = self._ladder.picture(self.scale)
        content = _Content(self.generation, self.scale, picture.samples)
        if content == self._served and not want.anyway:
            return False
        self._served, self._shown = content, (self.generation, self.scale)
        progress = Progress(picture.samples, self._meter.read(picture), time.monotonic() - self._began)
        clean = None
        if self._denoise is not None and is_for_the_eye(want.view):
            clean = Denoised(self._denoise(picture.read()), progress, False, self.scale)
        what = want.serial, self.generation, pixels_of(picture, want.view, clean), progress, self.scale
        self._send(Frame(self._number, *what, last=False, denoised=clean is not None, provisional=True))
        return True

    def shown(self, generation: int) -> float:
        """The scale at which that generation was shown; 0 where it was not."""
        return self._shown[1] if self._shown[0] == generation else 0.0

    def release(self) -> None:
        for thing in (self._ladder, self._scene):
            if thing is not None:
                thing.release()
        self._ladder = self._scene = None
        self.scale = None


class UnoptimisedLook:
    """Shows an update between `begin` and `release`, by a small kernel without optimisation, in a process beside the
    renderer."""

    def __init__(self, number: int, send: Callable[[FromRenderer], None], client: FirstLookClient | None) -> None:
        """Without a `client` there is never a first look."""
        self.generation = 0
        self.scale: float | None = None  # of what was shown
        self.shows = False
        self.bytes = 0  # of the machine's memory, which is the device's
        self._number, self._send, self._client = number, send, client
        self._want: Want | None = None  # what the process was asked for
        self._frame: Frame | None = None  # what it answered
        self._shown = (0, 0.0)

    def can(self, wanted: KernelRequest) -> bool:
        """True if the update could be shown before its kernel is there."""
        able = self._client is not None and self._client.able
        return able and serves(wanted) and fallback.settings_for(wanted.settings) is not None

    def begin(self, wanted: KernelRequest, generation: int) -> None:
        """Begin to show what `can` be shown."""
        settings = fallback.settings_for(wanted.settings)
        assert self._client is not None and settings is not None
        self.generation, self.scale, self._want, self._frame = generation, None, None, None
        self.shows, self.bytes = True, scene_bytes(wanted.arrays)
        look = Look(self._number, generation, wanted.arrays, settings)
        self._client.begin(look, self._hear)

    def answer(self, want: Want | None) -> bool:
        """Send the frame that is wanted, if it has come; else ask for it once. Whether it was sent."""
        if want is None or not self.shows or want.view.aov in FIRST_HIT_AOVS:
            return False
        frame, self._frame = self._frame, None
        if frame is not None and frame.serial == want.serial:
            self.scale, self._shown = frame.scale, (frame.generation, frame.scale)
            self._send(frame)
            return True
        if want != self._want:
            assert self._client is not None
            self._want = want
            self._client.want(self._number, want)
        return False

    def shown(self, generation: int) -> float:
        """The scale at which that generation was shown; 0 where it was not."""
        return self._shown[1] if self._shown[0] == generation else 0.0

    def release(self) -> None:
        if self.shows and self._client is not None:
            self._client.leave(self._number)
        self.shows, self.bytes, self.scale, self._frame = False, 0, None, None

    def _hear(self, frame: Frame) -> None:
        self._frame = frame
