"""How far one task's picture is, when that is enough, and what there is to tell of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from service.rendering.ipc.messages import Progress, Reason, StopRule
from service.rendering.worker.beyond import Beyond
from service.rendering.worker.held import Held
from service.rendering.worker.meter import Meter
from service.rendering.worker.pace import Pace
from service.rendering.worker.stopping import MAX_SAMPLES, Clock, late, reached

if TYPE_CHECKING:
    from gpu import Renderer


class Course:
    def __init__(self, renderer: Renderer) -> None:
        self.generation = 0  # of what is there
        self.interactive = False  # a person looks on, and may edit at any moment
        self.stop = StopRule()
        self.reason: Reason | None = None  # why it ended
        self.pixel_s: float | None = None  # what a sample of a pixel took lately
        self.beyond = Beyond(renderer)
        self.restart()

    def restart(self) -> None:
        """At zero samples; what was learnt of their price stays."""
        self.beyond.restart()
        self.clock, self.meter, self.pace = Clock(), Meter(), Pace()
        self.even = True  # as many samples in every pixel, as far as is known

    def progress(self, held: Held, scale: float = 1.0) -> Progress:
        if held.holding is None:
            return Progress()
        samples, elapsed_s = held.ladder.picture(scale).samples, self.clock.elapsed_s
        noise = self.noise(held) if scale == 1.0 else None
        stopped = self.reason == "stopped"
        done = self.reason is not None and not stopped
        eta = 0.0 if done else self.pace.eta_s(self.stop, elapsed_s)
        return Progress(samples, noise, elapsed_s, None if stopped else eta, self.beyond.shares)

    def noise(self, held: Held, fresh: bool = False) -> float | None:
        """Of the picture at full size, as the meter has it."""
        noise = self.meter.read(held.full, fresh)
        self.pace.heard(self.meter.at, noise)
        return noise

    def cap(self, held: Held) -> int:
        """How many samples to trace for: all, or what fits into the time, so that every pixel ends with as many."""
        limit, samples = self.stop.max_samples or MAX_SAMPLES, held.full.samples
        if held.full.under_way[0] and reached(self.stop, samples, self.meter.noise) is not None:
            return samples + held.full.under_way[0]  # see `enough`
        if self.stop.time_limit is None:
            return limit
        left_s, sample_s = self.stop.time_limit - self.clock.now_s, self._sample_s(held)
        # Half of what fits: passes shrink as the end draws near, and a machine that slows down halts none halfway.
        return min(limit, samples + max(1, int(0.5 * left_s / sample_s) if sample_s else 1))

    def enough(self, held: Held) -> Reason | None:
        """Why it ends now, if it does."""
        noise = self.noise(held) if self.stop.target_noise is not None else None
        reason = reached(self.stop, held.full.samples, noise)
        if held.full.under_way[0]:  # is finished first: a picture of so many samples is to come out the same again
            reason = None
        if reason is None and late(self.stop, self.clock.now_s, self._sample_s(held), self.even):
            reason = "time_limit"
        return reason

    def _sample_s(self, held: Held) -> float:
        return (self.pixel_s or 0.0) * held.full.settings.width * held.full.settings.height
