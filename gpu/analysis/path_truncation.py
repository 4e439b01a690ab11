"""The light that ends with the bounces: measured on the scene at hand."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gpu.tables.alias_table import LUMINANCE

if TYPE_CHECKING:
    from gpu.device.scene import Scene
    from gpu.renderer import Renderer
    from gpu.settings import RenderSettings

DEEPEST = 64  # bounces that stand for all: a white room of albedo 0.95 has 4 % of its light beyond, others less
_PIXELS, _SAMPLES = 1 << 12, 16
_SLICE_S = 0.015  # seconds of tracing in a step


def bounced_paths(limits: Iterable[int]) -> int:
    """The number of paths that are traced for that many limits, the deepest included."""
    return len({*limits, DEEPEST}) * _PIXELS * _SAMPLES


def missing_light(
    renderer: Renderer, scene: Scene, settings: RenderSettings, limits: Iterable[int]
) -> Generator[None, None, dict[int, float]]:
    """For each number of bounces, the share (0 to 1) of the picture's light (its mean luminance) that is lost where
    paths end after it; all the light is what `DEEPEST` bounces find, or the greatest limit where that is more.

    The shares are measured on a small picture with the kernel and the seed of the large one. Two limits see the same
    paths, one of them cut short, so that their difference has little noise of its own. A step of the generator takes
    about _SLICE_S seconds. Raises what `Renderer.picture` raises."""
    side = (_PIXELS / (settings.width * settings.height)) ** 0.5
    width, height = (max(1, round(side * pixels)) for pixels in (settings.width, settings.height))
    small = replace(settings, width=width, height=height, adaptive=False)  # or limits would see other paths
    light: dict[int, float] = {}
    for bounces in sorted({*limits, DEEPEST}):
        picture = renderer.picture(scene, replace(small, max_bounces=bounces))
        try:
            while picture.samples < _SAMPLES:
                picture.trace(_SLICE_S, _SAMPLES)
                yield
            light[bounces] = float((picture.read()[..., :3].astype(np.float64) @ LUMINANCE).mean())
        finally:
            picture.release()
    whole = light[max(light)]
    return {limit: max(0.0, 1 - light[limit] / whole) if whole > 0 else 0.0 for limit in limits}
