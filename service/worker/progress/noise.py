"""A picture's noise, read now and then: reading it takes time from tracing."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gpu import Picture

PAUSE = 20  # times the duration of a reading until the next one: readings cost 5 % at most


class NoiseReading:
    def __init__(self) -> None:
        self.noise: float | None = None  # as it was last read
        self.at = 0  # samples at the last reading
        self._due = 0.0  # the time of the next
        self._own = False  # whether it was read here, from these samples

    def set(self, samples: int, noise: float | None) -> None:
        """Take over what was reported of a picture with that many samples, and may have been read of fewer."""
        self.at, self.noise, self._own = samples, noise, False

    def read(self, picture: Picture, fresh: bool = False) -> float | None:
        """`Picture.noise`, not the newest unless `fresh`."""
        samples, began = picture.samples, time.monotonic()
        newer = samples > self.at or (fresh and not self._own)
        if samples >= 2 and newer and (fresh or began >= self._due):
            self.noise, self.at, self._own = picture.noise(), samples, True
            now = time.monotonic()
            self._due = now + PAUSE * (now - began)
        return self.noise
