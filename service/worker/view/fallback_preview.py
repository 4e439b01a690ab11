"""First looks at what waits for its kernel, by the superset kernel of the scene that was edited, where that is there
already (gpu/precompile/fallback.py)."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from gpu import GpuError, OutOfMemory
from gpu.precompile import fallback
from service.worker.view.first_look import FirstLook, serves

if TYPE_CHECKING:
    from collections.abc import Callable

    from gpu import KernelKey, Renderer, RenderSettings, SceneArrays
    from service.ipc.messages import FromRenderer, Want
    from service.worker.device.loaded_scene import KernelRequest
    from service.worker.helpers.compile_client import CompileClient

log = logging.getLogger(__name__)


class FallbackPreview:
    """Shows an update between `begin` and `release`, in the task's own turns."""

    def __init__(
        self, number: int, send: Callable[[FromRenderer], None], renderer: Renderer, compiler: CompileClient | None
    ) -> None:
        """Without a `compiler` there is never a preview."""
        self._look = FirstLook(number, send, renderer)
        self._renderer, self._compiler = renderer, compiler
        self._superset: frozenset[str] | None = None  # of the scene that is being edited
        self._raised: frozenset[str] | None = None  # flags of what is shown

    @property
    def generation(self) -> int:
        return self._look.generation

    @property
    def scale(self) -> float | None:
        """The scale of the picture that is shown."""
        return self._look.scale

    @property
    def bytes(self) -> int:
        return self._look.bytes

    @property
    def shows(self) -> bool:
        """True if there is something that it shows."""
        return self._look.shows

    @property
    def due(self) -> bool:
        """True if there is more to trace."""
        return self._look.due

    def prepare(self, arrays: SceneArrays, settings: RenderSettings) -> list[KernelKey]:
        """The keys of the superset kernels, which edits of these arrays may need soon."""
        self._superset = fallback.superset(arrays)
        return fallback.superset_keys(arrays, settings, self._superset)

    def can(self, wanted: KernelRequest) -> bool:
        """True if the update could be shown at once."""
        return serves(wanted) and self._compiled(wanted) is not None

    def _compiled(self, wanted: KernelRequest) -> KernelKey | None:
        """The superset kernel that shows such a picture, if it is compiled."""
        if self._superset is None or self._compiler is None:
            return None
        key = fallback.kernel_key(wanted.arrays, wanted.settings, self._superset)
        return key if key is not None and self._compiler.on_disk(key) else None

    def begin(self, wanted: KernelRequest, generation: int) -> None:
        """Begin to show what `can` be shown; where loading fails, nothing is shown."""
        settings, kernel = fallback.settings_for(wanted.settings), self._compiled(wanted)
        assert settings is not None and kernel is not None and self._compiler is not None
        assert self._superset is not None
        try:
            scene, same = self._look.scene, self._raised == self._superset
            if scene is not None and same and fallback.can_become(scene.arrays, wanted.arrays):
                scene.edit(wanted.arrays)
            else:
                self.release()
                scene = self._renderer.load_fallback(wanted.arrays, self._superset)
                self._raised = self._superset
            self._look.begin(scene, settings, generation)
            self._compiler.loaded(kernel)
        except GpuError as error:
            log.info("could not show a preview by the fallback kernel", {"error": error})
            self.release()

    def step(self) -> int:
        """Trace for a slice; how many samples of pixels that were."""
        try:
            return self._look.step()
        except OutOfMemory as error:
            log.info("could not show a preview by the fallback kernel", {"error": error})
            self.release()
            return 0

    def answer(self, want: Want | None) -> bool:
        """Send the frame that is wanted, if it would show something new."""
        return self._look.answer(want)

    def shown(self, generation: int) -> float:
        """The scale at which that generation was shown; 0 where it was not."""
        return self._look.shown(generation)

    def release(self) -> None:
        self._look.release()
