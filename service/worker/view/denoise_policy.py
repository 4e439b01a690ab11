"""The denoised form of one task's picture: whether it is wanted, when it is due, and the newest one.

It is wanted by the settings, for what is kept, or by the view, for the eye alone: then it fades as the noise falls.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gpu.denoise import GUIDE_SAMPLES
from service.ipc.messages import Progress, View
from service.worker.helpers.denoise_client import DenoiseClient, DenoiseResult, denoise_request

if TYPE_CHECKING:
    from gpu import Picture

CLEAN = 0.005  # noise of the rendered picture below which denoising adds more error than it takes away
# Of a picture that is only shown denoised: it turns into the rendered one between these, so that nobody sees when.
FADES, FADED = 0.03, 0.015
# While somebody watches: rest between two of them, in times of what one took; and as a share of the picture's age,
# so that one that changes slowly is denoised seldom, but at least every second.
REST, AGE_SHARE, LONGEST_REST_S = 2.0, 0.25, 1.0


@dataclass(frozen=True)
class Denoised:
    pixels: np.ndarray  # (height, width, 4), as Picture.read gives colour
    progress: Progress  # of the picture that was denoised
    fine: bool
    scale: float = 1.0  # of the picture at full size


def is_for_the_eye(view: View) -> bool:
    """True if a picture is to be seen denoised, whatever is kept of it: numbers are what was rendered."""
    return view.denoise and view.aov == "color" and view.encoding != "linear"


class DenoisePolicy:
    def __init__(self, denoiser: DenoiseClient, yields: bool) -> None:
        """`yields`: renderer and denoiser share the processor, so that tracing pauses while a picture is denoised."""
        self.wanted = False  # by the settings
        self.live = False  # by the view
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

    def want(self, wanted: bool) -> None:
        """Take what the settings say; what was made for the eye is not what is kept."""
        if wanted != self.wanted:
            self.restart()
        self.wanted = wanted

    def set_view(self, view: View) -> None:
        """Take what the view says."""
        if is_for_the_eye(view) and not self.live:
            self._denoiser.start()
        self.live = is_for_the_eye(view)

    @property
    def warning(self) -> str | None:
        """Why nothing is denoised although it was asked for."""
        why = self._why_not
        return f"denoise: the picture is as rendered, for {why}" if self.wanted and why else None

    @property
    def able(self) -> bool:
        """True if the picture is denoised for anybody."""
        return (self.wanted or self.live) and self._why_not is None

    @property
    def _why_not(self) -> str | None:
        return self._denoiser.missing or self._failed

    @property
    def holds(self) -> bool:
        """True if tracing pauses, as the denoiser needs the processor."""
        return self.pending and self._yields and not self._denoiser.late

    @property
    def under_way(self) -> bool:
        """True if a denoised picture will be there soon."""
        return (self.pending or not self._denoiser.busy) and not self._denoiser.late

    @property
    def quick(self) -> bool:
        """True if it takes so little that even a first look may wait for it: the denoiser has started."""
        return self._denoiser.has_answered

    def covers(self, aov: str, noise: float | None, final: bool = False) -> bool:
        """True if such a picture is shown denoised, or is where it is `final`: not when it is clean, nor when nothing
        can denoise it."""
        if aov != "color" or not self.able or (final and not self.wanted):
            return False
        return noise is None or noise >= (CLEAN if self.wanted else FADED)

    def has(self, samples: int) -> Denoised | None:
        """The final denoised form of a picture with that many samples; None where there is none yet."""
        latest = self.latest
        if latest is None or not latest.fine or latest.scale != 1.0:
            return None
        return latest if latest.progress.samples == samples else None

    def due(self, samples: int, fine: bool, scale: float = 1.0) -> bool:
        if samples == 0 or self.pending or self._denoiser.busy:
            return False
        if self.latest is None or self.latest.scale != scale:
            return True
        if fine:
            return self.has(samples) is None
        return samples > self.latest.progress.samples and time.monotonic() >= self._due_at

    def begin(
        self,
        picture: Picture,
        progress: Progress,
        fine: bool,
        on_done: Callable[[], None],
        scale: float = 1.0,
        guided: bool = True,
    ) -> None:
        """Have the picture denoised as it is now; `on_done` is called when that is done or has failed. Without being
        `guided` by the first hits it is worse, and at hand before there is a kernel for those."""
        color, guides = picture.read(), picture.guides(GUIDE_SAMPLES) if guided else None
        weight = self._weight(progress.noise)
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
                shown = delivery.pixels if weight == 1.0 else color + np.float32(weight) * (delivery.pixels - color)
                self.latest = Denoised(shown, progress, fine, scale)
            on_done()

        self._denoiser.ask(denoise_request(color, guides, fine), hear)

    def _weight(self, noise: float | None) -> float:
        """How much of the denoised picture there is in what is shown."""
        if self.wanted or noise is None:
            return 1.0
        return min(max((noise - FADED) / (FADES - FADED), 0.0), 1.0)
