"""What a scene's own kernel saves beside the one with every feature on: measured, on the scene itself."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from gpu import ahead
from gpu.arrays import SceneArrays
from gpu.picture import Picture
from gpu.scene import Everything, Scene
from gpu.settings import RenderSettings

if TYPE_CHECKING:
    from gpu.ahead import Recipe
    from gpu.renderer import Renderer

SIZE = 128  # pixels a side at most: enough work for a dispatch, little enough for a large mesh
_TURNS = 5
_ENOUGH_S = 4.0  # of tracing: then it is not begun again

PriceSteps = Generator[None, None, "KernelPrice"]


@dataclass(frozen=True)
class KernelPrice:
    """Seconds per sample and pixel, the best of some turns, and milliseconds of compiling; `full`: every flag on."""

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


def full_kernel(arrays: SceneArrays, settings: RenderSettings) -> Recipe:
    """The kernel with everything on that `price_steps` compares with."""
    return ahead.full_recipe(arrays, _small(settings))


def kernel_price(renderer: Renderer, arrays: SceneArrays, settings: RenderSettings | None = None) -> KernelPrice:
    """Compiles both kernels and renders with them."""
    scene = renderer.load(arrays)
    try:
        steps = price_steps(renderer, scene, settings or RenderSettings(SIZE, SIZE))
        while True:
            next(steps)
    except StopIteration as end:
        price: KernelPrice = end.value
        return price
    finally:
        scene.release()


def price_steps(
    renderer: Renderer, scene: Scene, settings: RenderSettings, slice_s: float = math.inf
) -> PriceSteps:
    """Renders small pictures with both kernels in turns, so that both meet the same machine; between steps, of about
    `slice_s` seconds but for loading a kernel, others may have theirs."""
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
        return KernelPrice(scene.features, scene.spared, *(picture.compile_ms for picture in pictures), *best)
    finally:
        for picture in pictures:
            picture.release()
        full.release()


def _small(settings: RenderSettings) -> RenderSettings:
    return replace(settings, width=min(settings.width, SIZE), height=min(settings.height, SIZE), adaptive=False)
