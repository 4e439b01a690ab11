"""The saving by a scene's own kernel beside one with every common flag on: measured, on the scene itself."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gpu.arrays import SceneArrays
from gpu.settings import RenderSettings

if TYPE_CHECKING:
    from gpu.renderer import Renderer

_SIZE = 128  # pixels a side: enough work for a dispatch, little enough for a large mesh
_TURNS = 5
_ENOUGH_S = 4.0  # seconds of tracing after which no further turn begins


@dataclass(frozen=True)
class KernelCost:
    """Seconds per sample and pixel (the best of several turns) and milliseconds of compiling, for the scene's own
    kernel and for the `full` one, which has every common flag on."""

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


def kernel_cost(renderer: Renderer, arrays: SceneArrays) -> KernelCost:
    """Compile both kernels and render small pictures with them in turns, so that both run under the same load."""
    settings = RenderSettings(_SIZE, _SIZE)
    scenes = [renderer.load(arrays), renderer.load(arrays, everything=True)]
    pictures = [renderer.picture(scene, settings) for scene in scenes]
    best, spent = [math.inf, math.inf], 0.0
    for _ in range(_TURNS):
        for i, picture in enumerate(pictures):
            seconds = picture.trace(math.inf, picture.samples + 1)
            best[i] = min(best[i], seconds / _SIZE**2)
            spent += seconds
        if spent >= _ENOUGH_S:
            break
    compile_ms = [picture.compile_ms for picture in pictures]
    for picture in pictures:
        picture.release()
    for scene in scenes:
        scene.release()
    return KernelCost(scenes[0].features, scenes[0].spared, *compile_ms, *best)
