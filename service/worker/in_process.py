"""A renderer without a process of its own, as the command line uses it: one render, questions, measurements."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from gpu import BsdfAlbedo, BsdfTerms, BsdfValues, GpuError, Renderer, SceneArrays, Steps
from gpu.analysis.kernel_cost import KernelCost, kernel_cost
from service.ipc.messages import Failed, FromRenderer, Image, Read, StopRule, Update, View
from service.worker.context import WorkerContext
from service.worker.helpers.denoise_client import DenoiseClient
from service.worker.task import Task

if TYPE_CHECKING:
    from service.document.quality import ResolvedSettings

NUMBER = 1  # of the only task
SIGNAL_S = 0.1  # how long a signal may go unnoticed while the denoiser works


class InProcessRenderer:
    """A context manager. All of its methods raise GpuError."""

    def __init__(self, device: int | None) -> None:
        self._renderer = Renderer(device)
        self.info = self._renderer.info
        self._gpu = None if self.info["software"] else device or 0  # EGL's number

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *given: object) -> None:
        self._renderer.close()

    def render(
        self, arrays: SceneArrays, settings: ResolvedSettings, listener: Callable[[FromRenderer], None]
    ) -> InProcessRender:
        """Begin a render; `listener` gets the messages that a server would get."""
        return InProcessRender(self._renderer, arrays, settings, listener, self._gpu)

    def features(self, arrays: SceneArrays) -> tuple[str, ...]:
        """The features that the scene's kernel is compiled for; nothing is compiled."""
        scene = self._renderer.load(arrays)
        try:
            return scene.features
        finally:
            scene.release()

    def kernel_cost(self, arrays: SceneArrays) -> KernelCost:
        """Compile the scene's kernel and one with every feature, and measure both."""
        return kernel_cost(self._renderer, arrays)

    def bsdf_values(
        self, material: SceneArrays, wo: np.ndarray, wi: np.ndarray, paired: bool = False, lobes: bool = False
    ) -> BsdfValues:
        return Steps(self._renderer.bsdf.values(material, wo, wi, paired=paired, lobes=lobes)).finish()

    def bsdf_albedo(self, material: SceneArrays, wo: np.ndarray, samples: int) -> BsdfAlbedo:
        return Steps(self._renderer.bsdf.albedo(material, wo, samples)).finish()

    def bsdf_terms(self, material: SceneArrays, wo: np.ndarray, wi: np.ndarray) -> BsdfTerms:
        return Steps(self._renderer.bsdf.terms(material, wo, wi)).finish()


class InProcessRender:
    """One render: the renderer's own task. `step` until the listener gets Done. All methods raise GpuError."""

    def __init__(
        self,
        renderer: Renderer,
        arrays: SceneArrays,
        settings: ResolvedSettings,
        listener: Callable[[FromRenderer], None],
        gpu: int | None,
    ) -> None:
        """`gpu`: EGL's number of the device, where that is no processor."""
        self._listener = listener
        self._image: Image | None = None
        self._denoiser = DenoiseClient(gpu)
        self._task = Task(WorkerContext(renderer, self._receive, self._denoiser), NUMBER)
        stop = StopRule(settings.max_samples, settings.time_limit, settings.target_noise)
        self._task.update(Update(NUMBER, 1, arrays, settings.for_gpu(), stop, denoise=settings.denoise))

    def step(self) -> None:
        """Advance the render, or wait a moment for the denoiser."""
        if self._task.ready:
            self._task.turn()
        else:
            self._denoiser.sleep(timeout_s=SIGNAL_S)
        self._denoiser.hear()

    def stop(self) -> None:
        """End the render at the next step."""
        self._task.picture.stop()

    def pixels(self, view: View) -> np.ndarray | None:
        """The picture so far; None before its first sample. The AOVs of the first hit are traced, and the picture is
        denoised, when they are asked for."""
        self._image = None
        self._task.picture.frames.read(Read(NUMBER, 1, view))
        while self._image is None:
            self.step()
        image: Image = self._image
        return image.pixels

    def close(self) -> None:
        """Free what it takes on the GPU."""
        self._task.release()
        self._denoiser.close()

    def _receive(self, message: Any) -> None:
        if isinstance(message, Image):
            self._image = message
        elif isinstance(message, Failed):
            raise GpuError(message.detail)
        else:
            self._listener(message)
