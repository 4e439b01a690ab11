"""The share of this scene's light that bounces beyond each preset's would add, measured beside the render."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from gpu import GpuError, Steps, bounced_paths, missing_light

if TYPE_CHECKING:
    from gpu import Picture, Renderer

LIMITS = (3, 5, 8, 16, 64)  # of the quality presets
WORTH = 50  # the estimate starts once the picture holds 50 times its paths: it costs 2 % of the render at most

log = logging.getLogger(__name__)


class TruncatedLight:
    def __init__(self, renderer: Renderer) -> None:
        self.shares: dict[int, float] | None = None  # by bounces; None: not known yet
        self._renderer = renderer
        self._steps: Steps[dict[int, float]] | None = None
        self._given_up = False

    def restart(self) -> None:
        """Forget the measurement: the picture is another one, or none."""
        self.cancel()
        self.shares, self._given_up = None, False

    def cancel(self) -> None:
        """Ends a measurement that is under way and frees its small picture while the context still exists."""
        if self._steps is not None:
            self._steps.close()
        self._steps = None

    def step(self, picture: Picture) -> bool:
        """Measure for a slice, where that is due."""
        if self.shares is not None or self._given_up:
            return False
        settings = picture.settings
        if self._steps is None:
            limits = {*LIMITS, settings.max_bounces}
            if picture.samples * settings.width * settings.height < WORTH * bounced_paths(limits):
                return False
            self._steps = Steps(missing_light(self._renderer, picture.scene, settings, limits))
        try:
            self.shares = self._steps.step()
            if self.shares is not None:
                self._steps = None
        except GpuError as error:
            log.warning("could not measure light beyond the bounces error=%s", error)
            self._given_up, self._steps = True, None
        return True
