"""What a scene's own kernel saves beside the one with every feature on: measured, on the scene itself."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from gpu.arrays import SceneArrays
from gpu.device.scene import Everything, Scene
from gpu.picture.picture import Picture
from gpu.precompile import kernel_keys
from gpu.settings import RenderSettings
from gpu.steps import Steps

if TYPE_CHECKING:
    from gpu.precompile.kernel_keys import KernelKey
    from gpu.renderer import Renderer

SIZE = 128  # pixels a side at most: enough work for a dispatch, little enough for a large mesh
_TURNS = 5
_ENOUGH_S = 4.0  # seconds of tracing after which no further turn begins


@dataclass(frozen=True)
class KernelCost:
    """Seconds per sample and pixel (the best of several turns) and milliseconds of compiling, for the scene's own
    kernel and for the `full` one, which has every flag on."""

    raised: tuple[str, ...]
    spared: tuple[str, ...]
    compile_ms: float
    full_compile_ms: float
    sample_s: float
    full_sample_s: float

    @property
    def saving(self) -> float:
        """Share of the full kernel's time."""
        return 1 - self.sample_s / self.full_sample_s


def full_kernel(arrays: SceneArrays, settings: RenderSettings) -> KernelKey:
    """The kernel with everything on that `kernel_cost_steps` compares with."""
    return kernel_keys.full_key(arrays, _small(settings))


def kernel_cost(renderer: Renderer, arrays: SceneArrays, settings: RenderSettings | None = None) -> KernelCost:
    """Compiles both kernels and renders with them."""
    scene = renderer.load(arrays)
    try:
        return Steps(kernel_cost_steps(renderer, scene, settings or RenderSettings(SIZE, SIZE))).finish()
    finally:
        scene.release()


def kernel_cost_steps(
    renderer: Renderer, scene: Scene, settings: RenderSettings, slice_s: float = math.inf
) -> Generator[None, None, KernelCost]:
    """Render small pictures with both kernels in turns, so that both run under the same load. A step takes about
    `slice_s` seconds, except those that load a kernel."""
    full, pictures = Everything(scene), list[Picture]()
    try:
        for each in (scene, full):
            pictures.append(renderer.picture(each, _small(settings)))
            yield
        best, spent = [math.inf, math.inf], 0.0
        for _ in range(_TURNS):
            for i, picture in enumerate(pictures):
                seconds, wanted = 0.0, picture.samples + 1
                while picture.samples < wanted:
                    seconds += picture.trace(slice_s, wanted)
                    yield
                best[i] = min(best[i], seconds / (picture.settings.width * picture.settings.height))
                spent += seconds
            if spent >= _ENOUGH_S:
                break
        return KernelCost(scene.features, scene.spared, *(picture.compile_ms for picture in pictures), *best)
    finally:
        for picture in pictures:
            picture.release()
        full.release()


def _small(settings: RenderSettings) -> RenderSettings:
    return replace(settings, width=min(settings.width, SIZE), height=min(settings.height, SIZE), adaptive=False)
