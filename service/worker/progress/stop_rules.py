"""When a render ends, by its limits and its own clock."""

from __future__ import annotations

import math
import time

from gpu import stop_after
from service.ipc.messages import TRUSTED_SAMPLES, Reason, StopRule

MAX_SAMPLES = 1 << 24  # of the contract: where float32 sums stop counting
# Numbers of samples in an octave at which `target_noise` is judged, at most, as reading the noise takes time. From
# 1024 samples on an octave has as many, and at most a sixteenth of a render's samples are more than it needs.
_JUDGED_AN_OCTAVE = 16


class Clock:
    """Wall time from the first dispatch to the end of the last one, pauses left out."""

    def __init__(self) -> None:
        self._banked_s = 0.0
        self._began: float | None = None
        self._ended = 0.0

    def start(self) -> None:
        if self._began is None:
            self._began = self._ended = time.monotonic()

    def lap(self) -> None:
        """Note that a dispatch has ended."""
        self._ended = time.monotonic()

    def set(self, elapsed_s: float) -> None:
        self._banked_s, self._began = elapsed_s, None

    def pause(self) -> None:
        self._banked_s = self.elapsed_s
        self._began = None

    @property
    def elapsed_s(self) -> float:
        return self._banked_s + (self._ended - self._began if self._began is not None else 0.0)

    @property
    def now_s(self) -> float:
        """Like `elapsed_s`, and the wait since the last dispatch."""
        return self._banked_s + (time.monotonic() - self._began if self._began is not None else 0.0)


def reached(stop: StopRule, samples: int, noise: float | None) -> Reason | None:
    if samples >= (stop.max_samples or MAX_SAMPLES):
        return "max_samples"
    if stop.target_noise is not None and noise is not None and samples >= TRUSTED_SAMPLES:
        return "target_noise" if noise <= stop.target_noise else None
    return None


def judged_after(samples: int) -> int:
    """The first number of samples above this one at which `target_noise` is judged: 16, 32, or a multiple of 64. It
    depends on nothing else, so that a render ends with the same samples however fast it goes."""
    judged = stop_after(max(samples, TRUSTED_SAMPLES - 1))
    octave = 1 << judged.bit_length() - 1
    step = octave // _JUDGED_AN_OCTAVE
    return -(-judged // step) * step


def judged_from(samples: float) -> int:
    """The same, but not below this number."""
    return judged_after(math.ceil(samples) - 1)


def late(stop: StopRule, now_s: float, sample_s: float, even: bool) -> bool:
    """Whether time is up. A pass under way (not `even`) may be finished, and one that nearly fits begun."""
    if stop.time_limit is None:
        return False
    overrun_s = 0.05 * stop.time_limit + 0.05  # half of what the contract allows: a slice is not to be halted
    if now_s >= stop.time_limit + overrun_s:
        return True
    return even and (now_s >= stop.time_limit or (now_s > 0 and now_s + sample_s > stop.time_limit + overrun_s))
