"""Estimates the time left from how fast samples have come and noise has fallen of late."""

from __future__ import annotations

import math

from service.ipc.messages import TRUSTED_SAMPLES, StopRule
from service.worker.progress.stop_rules import judged_from

GROWTH = 1.05  # of samples from one mark to the next: some hundred marks to a million
# Of the samples before them, those to start from: at 8 the noise meter begins, which makes samples dearer in small
# pictures, and the passes before that are short.
SETTLED = TRUSTED_SAMPLES
LEAST_SHARE = 0.25  # of all samples that a rate is taken over: fewer are a matter of chance
# Noise falls with a power of the samples: 1/2 for independent ones, to 3/4 for Sobol', in leaps (at powers of two it
# is least). A line is laid through the logarithms of what was read, with as much trust in the usual power as if they
# had spread by that variance; and the picture's noise is taken to be halfway between it and the last reading.
USUAL, USUAL_WEIGHT, SLOWEST, FASTEST = 0.55, 0.04, 0.5, 0.85
LOOK_BACK = 8  # times fewer samples: as far as readings count
LEAST_LEFT = 1 / 16  # of the samples there are: so many more at least, while the target is not reached


class EtaEstimate:
    def __init__(self) -> None:
        self._marks: list[tuple[int, float]] = [(0, 0.0)]  # complete samples and the seconds to them
        self._latest = self._marks[0]
        self._noises: list[tuple[int, float]] = []
        self._noise: tuple[int, float] | None = None

    def passed(self, samples: int, elapsed_s: float) -> None:
        """Note how many samples are complete now."""
        if samples > self._latest[0]:
            self._latest = samples, elapsed_s
            if samples >= GROWTH * self._marks[-1][0]:
                self._marks.append(self._latest)

    def heard(self, samples: int, noise: float | None) -> None:
        """Note the noise at this number of samples."""
        if noise is None or (self._noise is not None and samples <= self._noise[0]):
            return
        self._noise = samples, noise
        if samples >= TRUSTED_SAMPLES and noise > 0 and samples >= GROWTH * (self._noises or [(0, 0.0)])[-1][0]:
            self._noises.append(self._noise)

    def eta_s(self, stop: StopRule, elapsed_s: float) -> float | None:
        """Seconds from `elapsed_s` to the first of the limits; None where there is too little to go by."""
        totals = [] if stop.time_limit is None else [stop.time_limit]
        if stop.max_samples is not None and self._latest[0]:
            totals.append(self._time_of(stop.max_samples))
        if stop.target_noise is not None and self._noise is not None and self._latest[0]:
            totals.append(self._time_of(judged_from(self._samples_to(stop.target_noise, *self._noise))))
        return max(0.0, min(totals) - elapsed_s) if totals else None

    def _time_of(self, samples: float) -> float:
        """The time of a sample count, by the rate over as many past samples as are still to come."""
        taken, seconds = self._latest
        more = max(samples - taken, LEAST_SHARE * taken)
        marks = [mark for mark in self._marks if mark[0] < taken and (mark[0] >= SETTLED or mark[0] == 0)]
        settled = [mark for mark in marks if mark[0]] or marks
        since = next((mark for mark in reversed(settled) if taken - mark[0] >= more), settled[0])
        if taken - since[0] < LEAST_SHARE * taken:
            since = marks[0]
        return seconds + (samples - taken) * (seconds - since[1]) / (taken - since[0])

    def _samples_to(self, target: float, samples: int, noise: float) -> float:
        if noise <= target:
            return float(max(samples, self._latest[0]))
        level, power = self._line(samples, noise)
        wanted = samples * math.exp((level - math.log(target)) / power)
        return max(wanted, (1 + LEAST_LEFT) * max(samples, self._latest[0]))

    def _line(self, samples: int, noise: float) -> tuple[float, float]:
        """The logarithm of the noise at a number of samples, and the power of these with which it falls."""
        marks = [(math.log(n), math.log(each)) for n, each in self._noises if n * LOOK_BACK >= samples]
        last = math.log(noise)
        if not marks:
            return last, USUAL
        x, y = (sum(values) / len(marks) for values in zip(*marks, strict=True))
        spread = sum((a - x) ** 2 for a, _ in marks) / len(marks)
        along = sum((a - x) * (b - y) for a, b in marks) / len(marks)
        power = min(FASTEST, max(SLOWEST, (USUAL * USUAL_WEIGHT - along) / (USUAL_WEIGHT + spread)))
        return 0.5 * (y - power * (math.log(samples) - x) + last), power
