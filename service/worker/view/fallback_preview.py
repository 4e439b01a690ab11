"""First looks at what waits for its kernel, by one that is there already (gpu/precompile/fallback.py).

They are small, so that the picture by its own kernel, which begins anew, is larger whenever it comes.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from gpu import FIRST_HIT_AOVS, GpuError, OutOfMemory, scene_bytes
from gpu.precompile import fallback
from service.ipc.messages import Frame, FromRenderer, Progress, Want
from service.worker.device.loaded_scene import KernelRequest
from service.worker.device.resolution_ladder import FIRST_S, SCALES, SMALLEST_SIDE, ResolutionLadder
from service.worker.helpers.compile_client import CompileClient
from service.worker.progress.noise import NoiseReading
from service.worker.view.frames import SLICE_S, pixels_of

if TYPE_CHECKING:
    from gpu import KernelKey, Renderer, RenderSettings, Scene, SceneArrays

MOST_BYTES = 1 << 28  # of a scene: it is on the device twice, and of this size it loads in 0.1 s
ENOUGH_S = 0.25  # of tracing: on llvmpipe it takes from the compiler what it is there to bridge
LARGEST = 1 / 2  # of the scales
BEGIN_S = 4e-6  # a sample of a pixel, before there was one (llvmpipe with 2 cores)

log = logging.getLogger(__name__)


class _Content(NamedTuple):
    """What a frame shows: one with equal content would show nothing new."""

    generation: int
    scale: float
    samples: int


class _Compiled(NamedTuple):
    """A kernel of `fallback`: a superset kernel with the flags `raised`, or the one for many scenes."""

    key: KernelKey
    raised: frozenset[str] | None


class FallbackPreview:
    """Shows an update between `begin` and `release` with the superset kernel of the scene that was edited, or with
    the kernel for many scenes."""

    def __init__(
        self, number: int, send: Callable[[FromRenderer], None], renderer: Renderer, compiler: CompileClient | None
    ) -> None:
        """Without a `compiler` there is never a preview."""
        self.generation = 0
        self.scale: float | None = None  # of what there is to see
        self._number, self._send, self._renderer, self._compiler = number, send, renderer, compiler
        self._superset: frozenset[str] | None = None  # of the scene that is being edited
        self._scene: Scene | None = None
        self._raised: frozenset[str] | None = None  # flags of `_scene`; None: those of the kernel for many scenes
        self._ladder: ResolutionLadder | None = None
        self._next = 1.0  # the scale that is traced
        self._pixel_s = BEGIN_S
        self._spent_s = 0.0
        self._meter = NoiseReading()  # of the picture that is shown
        self._served: _Content | None = None  # of the last frame that was sent
        self._shown = (0, 0.0)
        self._began = 0.0

    @property
    def bytes(self) -> int:
        if self._scene is None or self._ladder is None:
            return 0
        return self._scene.bytes + self._ladder.bytes

    @property
    def shows(self) -> bool:
        """Whether there is something that it shows."""
        return self._ladder is not None

    @property
    def due(self) -> bool:
        """Whether there is more to trace."""
        return self._ladder is not None and (self.scale != self._next or self._spent_s < ENOUGH_S)

    def prepare(self, arrays: SceneArrays, settings: RenderSettings) -> list[KernelKey]:
        """The keys of the superset kernels, which edits of these arrays may need soon. Has the kernel for many scenes
        compiled in idle time."""
        general = fallback.kernel_key(arrays, settings)
        if general is not None and self._compiler is not None:
            self._compiler.prepare([general], "spare")
        self._superset = fallback.superset(arrays)
        return fallback.superset_keys(arrays, settings, self._superset)

    def can(self, wanted: KernelRequest) -> bool:
        """Whether the update could be shown at once."""
        if min(wanted.settings.width, wanted.settings.height) * LARGEST < SMALLEST_SIDE:
            return False
        return scene_bytes(wanted.arrays) <= MOST_BYTES and self._compiled(wanted) is not None

    def _compiled(self, wanted: KernelRequest) -> _Compiled | None:
        """The kernel that shows such a picture soonest, of those that are compiled."""
        for raised in (None,) if self._superset is None else (self._superset, None):
            key = fallback.kernel_key(wanted.arrays, wanted.settings, raised)
            if key is not None and self._compiler is not None and self._compiler.has(key):
                return _Compiled(key, raised)
        return None

    def begin(self, wanted: KernelRequest, generation: int) -> None:
        """Begin to show what `can` be shown; where loading fails, nothing is shown."""
        settings, kernel = fallback.settings_for(wanted.settings), self._compiled(wanted)
        assert settings is not None and kernel is not None and self._compiler is not None
        self.generation, self.scale, self._began, self._spent_s = generation, None, time.monotonic(), 0.0
        self._meter = NoiseReading()
        try:
            scene, same = self._scene, self._raised == kernel.raised
            if scene is not None and same and fallback.can_become(scene.arrays, wanted.arrays):
                scene.edit(wanted.arrays)
            else:
                self.release()
                self._scene = scene = self._renderer.load_fallback(wanted.arrays, kernel.raised)
                self._raised = kernel.raised
            if self._ladder is not None:
                self._ladder.release()
            self._ladder = ResolutionLadder(self._renderer, scene, settings, full=False)
            self._next = self._fitting(self._ladder, FIRST_S)
            self._ladder.picture(self._next)
            self._compiler.met(kernel.key)
        except GpuError as error:
            log.info("could not show a preview by the fallback kernel", {"error": error})
            self.release()

    def step(self) -> int:
        """Trace for a slice; how many samples of pixels that were."""
        try:
            return 0 if self._ladder is None else self._trace(self._ladder)
        except OutOfMemory as error:
            log.info("could not show a preview by the fallback kernel", {"error": error})
            self.release()
            return 0

    def _trace(self, ladder: ResolutionLadder) -> int:
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
        what = want.serial, self.generation, pixels_of(picture, want.view, None), progress, self.scale
        self._send(Frame(self._number, *what, last=False, provisional=True))
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
