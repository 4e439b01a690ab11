"""When a renderer that was lost is started again: at once, a little later, or, if that seems hopeless, much later."""

from __future__ import annotations

from service.renderers.local.process import Cause, RendererProcess

TRIES = 3  # starts in a row that end before rendering; then there is no renderer, and the reason is given
# Causes from outside, which never count as a failure to start.
BY_OTHERS: tuple[Cause, ...] = ("killed", "stopped", "node lost", "drained", "released")
BETWEEN_TRIES_S = 0.5
AFTER_KILLS_S = 5.0  # between starts of renderers that others kill as soon as they begin, at most
HOPELESS_S = 15.0  # between tries after that, while nobody waits


class Restarts:
    """Counts starts in a row that came to nothing: those that failed, and those that others ended."""

    def __init__(self) -> None:
        self.failures = self.shots = 0

    @property
    def hopeless(self) -> bool:
        return self.failures >= TRIES

    def succeeded(self) -> None:
        self.failures = self.shots = 0

    def lost(self, process: RendererProcess, cause: Cause) -> None:
        if process.ready:
            return
        # A process that was dying slowly may be killed at last by others.
        by_others = cause in BY_OTHERS and not process.unable
        self.failures += not by_others
        self.shots += by_others

    def pause_s(self, lived_s: float) -> float:
        """Seconds before the next start: more after each failure to start, or after kills in quick succession."""
        if self.hopeless:
            return HOPELESS_S
        after_kill_s = min(BETWEEN_TRIES_S * self.shots, AFTER_KILLS_S) - lived_s
        return max(BETWEEN_TRIES_S * self.failures, after_kill_s, 0.0)
