"""Tracks one task's progress: samples, time and noise, when the render should end, and what is reported."""

from __future__ import annotations

from service.ipc.messages import Progress, Reason, StopRule
from service.worker.device.residency import Residency
from service.worker.progress.eta import EtaEstimate
from service.worker.progress.noise import NoiseReading
from service.worker.progress.stop_rules import (
    MAX_SAMPLES,
    Clock,
    judged_after,
    judged_from,
    late,
    reached,
)


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
