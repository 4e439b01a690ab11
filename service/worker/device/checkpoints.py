"""A task's picture on its way to the server, which keeps it: the finished one, and long renders now and then."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from gpu import Steps, border_after
from service.system import shared_memory

if TYPE_CHECKING:
    from gpu import Picture, Saved

REST = 100  # times what a checkpoint costs until the next one: they cost 1 % at most, unless too much could be lost
# Seconds of a render, and a share of its time: the larger of them may be lost when all processes end. What is lost
# begins where the last checkpoint that is on the disk was read from the device.
MOST_LOST_S, MOST_LOST = 10.0, 0.01
MARGIN = 0.9  # of that; the next checkpoint may take longer than the last one did
SHARE = 0.004  # of the time that a render has taken, at least; of a long one so much may be lost, however small it is
EARLY = 0.75  # of the pause, after which a picture is saved that is at the border of a block: it has half the bytes


class Checkpointer:
    """Saves pictures in steps, between which other tasks have their turns."""

    def __init__(self, every_s: float) -> None:
        """`every_s`: between two of a picture under way, at least."""
        self._every_s = every_s
        self._steps: Steps[Saved] | None = None
        self._began_at = 0.0
        self._took_s = 0.0  # to read it from the device, without the turns of other tasks between
        self._stored_s = 0.0  # from then until it was on the disk, which also costs the machine something
        self._read_s = 0.0  # the same with them
        self._ended_at = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin anew: the picture is another one, or no longer wanted."""
        self._steps, self._took_s, self._read_s, self._stored_s = None, 0.0, 0.0, 0.0
        self._ended_at = time.monotonic()

    @property
    def under_way(self) -> bool:
        return self._steps is not None

    @property
    def hastened(self) -> bool:
        """True if the next checkpoint is due now, whatever else there is to do."""
        return self._ended_at == -math.inf

    def hasten(self) -> None:
        """Make the next checkpoint due now."""
        self._ended_at = -math.inf

    def due(self, picture: Picture, elapsed_s: float) -> bool:
        """True if the picture under way, which has taken that many seconds, is to be saved as it is now."""
        begun = picture.samples > 0 or picture.under_way[0] > 0  # the first sample of a large picture takes seconds
        pause_s = self._pause_s(elapsed_s) * (EARLY if _is_small(picture) else 1.0)
        return begun and time.monotonic() >= self._ended_at + pause_s

    def border(self, picture: Picture, elapsed_s: float) -> float:
        """The number of samples at which it will be saved, so that no more are traced before that; inf: at any."""
        if self.under_way or time.monotonic() < self._ended_at + EARLY * self._pause_s(elapsed_s):
            return math.inf
        return border_after(picture.samples)

    def _pause_s(self, elapsed_s: float) -> float:
        """Seconds between two of them at most."""
        # From when the last one began to be read until the next one is on the disk.
        beside_s = 2 * self._read_s + self._stored_s
        most_s = MARGIN * max(MOST_LOST_S, MOST_LOST * elapsed_s) - beside_s
        return max(self._every_s, SHARE * elapsed_s, min(REST * (self._took_s + self._stored_s), most_s))

    def stored(self, took_s: float) -> None:
        """The last one is on the disk, that many seconds after it was read."""
        self._stored_s = took_s

    def begin(self, picture: Picture) -> None:
        # One descriptor goes with the picture.
        arena = shared_memory.SharedArena(*picture.state_sizes)
        self._steps = Steps(picture.save(lambda size: arena.room((size,), np.dtype(np.uint8))))
        self._took_s, self._began_at = 0.0, time.monotonic()

    def step(self) -> Saved | None:
        """Do a step; the saved picture with the last one, else None."""
        assert self._steps is not None
        began = time.monotonic()
        saved = self._steps.step()
        if saved is not None:
            self._steps = None
        self._ended_at = time.monotonic()
        self._took_s += self._ended_at - began
        self._read_s = self._ended_at - self._began_at
        return saved


def _is_small(picture: Picture) -> bool:
    """True if no block of samples is under way, whose sums would be saved beside those of the whole blocks."""
    ended = picture.samples > 0 and border_after(picture.samples - 1) == picture.samples
    return ended and picture.at_border and not picture.settings.adaptive
