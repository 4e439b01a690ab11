"""What a scene's own kernel saves beside the one with every feature on: measured, on the scene itself."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gpu.arrays import SceneArrays
from gpu.settings import RenderSettings

if TYPE_CHECKING:
    from gpu.renderer import Renderer

_SIZE = 128  # pixels a side: enough work for a dispatch, little enough for a large mesh
_TURNS = 5


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


def kernel_price(renderer: Renderer, arrays: SceneArrays, max_bounces: int = 8) -> KernelPrice:
    """Compiles both kernels and renders with them in turns, so that both meet the same machine."""
    settings = RenderSettings(_SIZE, _SIZE, max_bounces)
    scenes = [renderer.load(arrays, everything=everything) for everything in (False, True)]
    pictures = [renderer.picture(scene, settings) for scene in scenes]
    best = [float("inf"), float("inf")]
    for _ in range(_TURNS):
        for i, picture in enumerate(pictures):
            start, samples = time.perf_counter(), picture.samples
            picture.trace(60.0, samples + 1)
            best[i] = min(best[i], (time.perf_counter() - start) / _SIZE**2)
    price = KernelPrice(
        scenes[0].features, scenes[0].spared, pictures[0].compile_ms, pictures[1].compile_ms, *best
    )
    for picture in pictures:
        picture.release()
        picture.scene.release()
    return price
