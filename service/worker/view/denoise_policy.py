"""The denoised form of one task's picture: whether it is wanted, when it is due, and the newest one."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gpu.denoise import GUIDE_SAMPLES
from service.ipc.messages import Progress
from service.worker.helpers.denoise_client import DenoiseClient, DenoiseResult, denoise_request

if TYPE_CHECKING:
    from gpu import Picture

CLEAN = 0.005  # noise of the rendered picture below which denoising adds more error than it takes away
# While somebody watches: rest between two of them, in times of what one took; and as a share of the picture's age,
# so that one that changes slowly is denoised seldom, but at least every second.
REST, AGE_SHARE, LONGEST_REST_S = 2.0, 0.25, 1.0


@dataclass(frozen=True)
class Denoised:
    pixels: np.ndarray  # (height, width, 4), as Picture.read gives colour
    progress: Progress  # of the picture that was denoised
    fine: bool


class DenoisePolicy:
    def __init__(self, denoiser: DenoiseClient, yields: bool) -> None:
        """`yields`: renderer and denoiser share the processor, so that tracing pauses while a picture is denoised."""
        self.wanted = False
        self.latest: Denoised | None = None
        self.pending = False
        self._denoiser = denoiser
        self._yields = yields
        self._failed: str | None = None  # why this picture could not be denoised
        self._age = 0
        self._due_at = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin anew with another picture: forget the denoised one and any under way."""
        self.latest, self.pending, self._failed = None, False, None
        self._age += 1
        self._due_at = 0.0

    @property
    def warning(self) -> str | None:
        """Why nothing is denoised although it was asked for."""
        why = self._denoiser.missing or self._failed
        return f"denoise: the picture is as rendered, for {why}" if self.wanted and why else None

    @property
    def holds(self) -> bool:
        """Whether tracing pauses, as the denoiser needs the processor."""
        return self.pending and self._yields and not self._denoiser.late

    @property
    def under_way(self) -> bool:
        """Whether a denoised picture will be there soon."""
        return (self.pending or not self._denoiser.busy) and not self._denoiser.late

    def covers(self, aov: str, noise: float | None) -> bool:
        """Whether such a picture is shown denoised: not when it is clean, nor when nothing can denoise it."""
        return self.wanted and aov == "color" and self.warning is None and not (noise is not None and noise < CLEAN)

    def has(self, samples: int) -> Denoised | None:
        """The final denoised form of a picture with that many samples; None where there is none yet."""
        latest = self.latest
        return latest if latest is not None and latest.fine and latest.progress.samples == samples else None

    def due(self, samples: int, fine: bool) -> bool:
        if samples == 0 or self.pending or self._denoiser.busy:
            return False
        if fine or self.latest is None:
            return self.has(samples) is None
        return samples > self.latest.progress.samples and time.monotonic() >= self._due_at

    def begin(self, picture: Picture, progress: Progress, fine: bool, told: Callable[[], None]) -> None:
        """Have the picture denoised as it is now; `told` is called when that is done or has failed."""
        self.pending = True
        age, began = self._age, time.monotonic()

        def hear(delivery: DenoiseResult) -> None:
            if age != self._age:
                return
            self.pending, now = False, time.monotonic()
            self._due_at = now + max(REST * (now - began), min(LONGEST_REST_S, AGE_SHARE * progress.elapsed_s))
            if delivery.pixels is None:
                self._failed = delivery.detail
            else:
                self.latest = Denoised(delivery.pixels, progress, fine)
            told()

        self._denoiser.ask(denoise_request(picture.read(), picture.guides(GUIDE_SAMPLES), fine), hear)
