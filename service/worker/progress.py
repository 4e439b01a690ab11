"""Tracks one task's progress: samples, time and noise, when the render should end, and what is reported."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from gpu import stop_after
from service.ipc.messages import TRUSTED_SAMPLES, Progress, Reason, StopRule
from service.worker.device.residency import Residency

if TYPE_CHECKING:
    from gpu import Picture


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

NOISE_PAUSE = 20  # times the duration of a reading until the next one: readings cost 5 % at most

MAX_SAMPLES = 1 << 24  # of the contract: where float32 sums stop counting
# Numbers of samples in an octave at which `target_noise` is judged, at most, as reading the noise takes time. From
# 1024 samples on an octave has as many, and at most a sixteenth of a render's samples are more than it needs.
_JUDGED_AN_OCTAVE = 16


class ProgressTracker:
    def __init__(self) -> None:
        self.generation = 0  # the generation that is rendered
        self.interactive = False  # a person looks on, and may edit at any moment
        self.stop = StopRule()
        self.reason: Reason | None = None  # why it ended
        self.pixel_s: float | None = None  # what a sample of a pixel took lately
        self.restart()

    def restart(self) -> None:
        """Start again at zero samples; the measured cost of a sample stays."""
        self.clock, self.meter, self.eta = Clock(), NoiseReading(), EtaEstimate()
        self.even = True  # as many samples in every pixel, as far as is known

    def progress(self, residency: Residency, scale: float = 1.0) -> Progress:
        if residency.loaded is None:
            return Progress()
        samples, elapsed_s = residency.ladder.picture(scale).samples, self.clock.elapsed_s
        noise = self.noise(residency) if scale == 1.0 else None
        stopped = self.reason == "stopped"
        done = self.reason is not None and not stopped
        eta = 0.0 if done else self.eta.eta_s(self.stop, elapsed_s)
        return Progress(samples, noise, elapsed_s, None if stopped else eta)

    def noise(self, residency: Residency, fresh: bool = False) -> float | None:
        """The noise of the picture at full size, as last measured."""
        noise = self.meter.read(residency.full, fresh)
        self.eta.heard(self.meter.at, noise)
        return noise

    def cap(self, residency: Residency) -> int:
        """How many samples to aim at: all, or as many as fit into the time; every pixel ends with the same number."""
        limit, samples = self.stop.max_samples or MAX_SAMPLES, residency.full.samples
        if residency.full.under_way[0] and samples >= limit:
            return samples + residency.full.under_way[0]  # see `enough`
        if self.stop.target_noise is not None:
            limit = min(limit, judged_after(samples))
        if self.stop.time_limit is None:
            return limit
        left_s, sample_s = self.stop.time_limit - self.clock.now_s, self._sample_s(residency)
        # Half of what fits: passes shrink as the end draws near, and a machine that slows down halts none halfway.
        return min(limit, samples + max(1, int(0.5 * left_s / sample_s) if sample_s else 1))

    def enough(self, residency: Residency) -> Reason | None:
        """The reason to end now; None to go on."""
        full, noise = residency.full, None
        if self.stop.target_noise is not None and full.at_border and judged_from(full.samples) == full.samples:
            noise = self.noise(residency, fresh=True)  # nothing that depends on when it was read last
        reason = reached(self.stop, full.samples, noise)
        if full.under_way[0]:  # the pass is finished first, so that as many samples give the same picture
            reason = None
        if full.samples and reason is None:  # a picture has its first sample, whatever that takes
            is_late = late(self.stop, self.clock.now_s, self._sample_s(residency), self.even)
            reason = "time_limit" if is_late else None
        return reason

    def _sample_s(self, residency: Residency) -> float:
        return (self.pixel_s or 0.0) * residency.full.settings.width * residency.full.settings.height


class EtaEstimate:
    """Estimates the time left from how fast samples have come and noise has fallen of late."""

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


class NoiseReading:
    """A picture's noise, read now and then: reading it takes time from tracing."""

    def __init__(self) -> None:
        self.noise: float | None = None  # as it was last read
        self.at = 0  # samples at the last reading
        self._due = 0.0  # the time of the next
        self._is_measured = False  # whether it was read here, from these samples

    def set(self, samples: int, noise: float | None) -> None:
        """Take over what was reported of a picture with that many samples, and may have been read of fewer."""
        self.at, self.noise, self._is_measured = samples, noise, False

    def read(self, picture: Picture, fresh: bool = False) -> float | None:
        """`Picture.noise`, not the newest unless `fresh`."""
        samples, began = picture.samples, time.monotonic()
        newer = samples > self.at or (fresh and not self._is_measured)
        if samples >= 2 and newer and (fresh or began >= self._due):
            self.noise, self.at, self._is_measured = picture.noise(), samples, True
            now = time.monotonic()
            self._due = now + NOISE_PAUSE * (now - began)
        return self.noise


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
    """True if time is up. A pass under way (not `even`) may be finished, and one that nearly fits begun."""
    if stop.time_limit is None:
        return False
    overrun_s = 0.05 * stop.time_limit + 0.05  # half of what the contract allows: a slice is not to be halted
    if now_s >= stop.time_limit + overrun_s:
        return True
    return even and (now_s >= stop.time_limit or (now_s > 0 and now_s + sample_s > stop.time_limit + overrun_s))
