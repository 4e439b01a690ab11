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

    def set(self, samples: int, noise: float | None) -> None:
        self.at, self.noise = samples, noise

    def read(self, picture: Picture, fresh: bool = False) -> float | None:
        """`Picture.noise`, not the newest unless `fresh`."""
        samples, began = picture.samples, time.monotonic()
        if samples >= 2 and samples > self.at and (fresh or began >= self._due):
            self.noise, self.at = picture.noise(), samples
            now = time.monotonic()
            self._due = now + PAUSE * (now - began)
        return self.noise
