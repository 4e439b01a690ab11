"""A scene's picture at full size, and smaller ones that can be looked at sooner."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from gpu import picture_bytes

if TYPE_CHECKING:
    from gpu import Picture, Renderer, RenderSettings, Scene

SCALES = (1.0, 1 / 2, 1 / 4, 1 / 8, 1 / 16)
SMALLEST_SIDE = 16  # pixels; fewer show nothing, and a dispatch costs the same
# A person sees 100 ms as at once. Tracing gets 30 of them: a slice may be under way when the edit comes (15), and
# tone mapping, reading back, encoding and crossings between processes take 10 to 20 when both cores are busy.
FIRST_S = 0.030
FULL_S = 0.040  # ... or this when it is the full picture: no second look follows that would cost more
NEXT_S = 0.120  # how long a first look may stand before something sharper replaces it
UNMEASURED_S = 2e-6  # a sample of a pixel, before there was one; a large mesh takes 1e-6 on llvmpipe with 2 cores
UNMEASURED_GPU_S = 1.5e-8  # an H200 takes 1e-9 to 3e-8


class ResolutionLadder:
    """The pictures of one scene with the same settings. Rungs below 1 are made when first climbed."""

    def __init__(self, renderer: Renderer, scene: Scene, settings: RenderSettings, full: bool = True) -> None:
        """Without `full` the picture at full size, too, is made when first climbed."""
        self._renderer = renderer
        self._scene = scene
        self._settings = settings
        self._pictures = {1.0: renderer.picture(scene, settings)} if full else {}
        self._unmeasured_s = UNMEASURED_S if renderer.info["software"] else UNMEASURED_GPU_S

    @property
    def full(self) -> Picture:
        return self._pictures[1.0]

    @property
    def begun(self) -> dict[float, Picture]:
        """The pictures with samples, by scale."""
        return {scale: picture for scale, picture in self._pictures.items() if picture.samples}

    @property
    def bytes(self) -> int:
        """The bytes that the pictures take on the device."""
        taken = (
            picture_bytes(each.settings, each.guided, each.covered, each.traces_caustics)
            for each in self._pictures.values()
        )
        return sum(taken)

    def picture(self, scale: float) -> Picture:
        if scale not in self._pictures:
            self._pictures[scale] = self._renderer.picture(self._scene, self._sized(scale))
        made = self._pictures[scale]
        if not made.cost_s and self.begun:
            made.expect_costs(self.begun[max(self.begun)])
        return made

    def pixels(self, scale: float) -> int:
        sized = self._sized(scale)
        return sized.width * sized.height

    def first(self, pixel_s: float | None) -> float:
        """The scale to begin with, where a sample of a pixel takes `pixel_s` seconds."""
        pixel_s = pixel_s or self._unmeasured_s
        if self.pixels(1.0) * pixel_s <= FULL_S:
            return 1.0
        smaller = [s for s in SCALES[1:] if min(self._settings.width, self._settings.height) * s >= SMALLEST_SIDE]
        fitting = [s for s in smaller if self.pixels(s) * pixel_s <= FIRST_S]
        return (fitting or smaller[-1:] or [1.0])[0]

    def next(self, scale: float, pixel_s: float | None) -> float:
        """The scale that comes after: the sharpest that is there soon, and at least twice as sharp."""
        larger = [s for s in SCALES if s > scale]
        fitting = [s for s in larger if self.pixels(s) * (pixel_s or self._unmeasured_s) <= NEXT_S]
        return (fitting or larger[-1:])[0]

    def reset(self) -> None:
        for picture in self._pictures.values():
            picture.reset()

    def configure(self, settings: RenderSettings) -> None:
        """Change to other settings; accumulation starts again."""
        if (settings.width, settings.height) == (self._settings.width, self._settings.height):
            self._settings = settings
            for scale, picture in self._pictures.items():
                picture.configure(self._sized(scale))
        else:
            self.release()
            self._settings = settings
            self._pictures = {1.0: self._renderer.picture(self._scene, settings)}

    def release(self) -> None:
        for picture in self._pictures.values():
            picture.release()
        self._pictures.clear()

    def _sized(self, scale: float) -> RenderSettings:
        width, height = (max(1, round(side * scale)) for side in (self._settings.width, self._settings.height))
        return replace(self._settings, width=width, height=height)
