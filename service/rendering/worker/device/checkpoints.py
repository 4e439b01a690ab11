"""A task's picture on its way to the server, which keeps it: the finished one, and long renders now and then."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from gpu import Steps
from service import shared_memory

if TYPE_CHECKING:
    from gpu import Picture, Saved

REST = 100  # times the duration of a checkpoint pass until the next one: they cost 1 % at most, up to LONGEST_S
# Seconds between two checkpoints, however long they take. When all processes end, at most 10 s of a render are to be
# lost, and until a checkpoint of a gigabyte is on the disk some of these have passed.
LONGEST_S = 4.0
SHARE = 0.004  # of the time that a render has taken, and so of what would be lost; 1 % may be


class Checkpointer:
    """Saves pictures in steps, between which other tasks have their turns."""

    def __init__(self, every_s: float) -> None:
        """`every_s`: between two of a picture under way, at least."""
        self._every_s = every_s
        self._steps: Steps[Saved] | None = None
        self._took_s = 0.0
        self._ended_at = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin anew: the picture is another one, or no longer wanted."""
        self._steps, self._took_s = None, 0.0
        self._ended_at = time.monotonic()

    @property
    def under_way(self) -> bool:
        return self._steps is not None

    @property
    def hastened(self) -> bool:
        """Whether the next checkpoint is due now, whatever else there is to do."""
        return self._ended_at == -math.inf

    def hasten(self) -> None:
        """Make the next checkpoint due now."""
        self._ended_at = -math.inf

    def due(self, picture: Picture, elapsed_s: float) -> bool:
        """Whether the picture under way, which has taken that many seconds, is to be saved as it is now."""
        pause_s = max(self._every_s, min(REST * self._took_s, LONGEST_S), SHARE * elapsed_s)
        begun = picture.samples > 0 or picture.under_way[0] > 0  # the first sample of a large picture takes seconds
        return begun and time.monotonic() >= self._ended_at + pause_s

    def begin(self, picture: Picture) -> None:
        # One descriptor goes with the picture.
        arena = shared_memory.SharedArena(*picture.state_sizes)
        self._steps = Steps(picture.save(lambda size: arena.room((size,), np.dtype(np.uint8))))
        self._took_s = 0.0

    def step(self) -> Saved | None:
        """Do a step; the saved picture with the last one, else None."""
        assert self._steps is not None
        began = time.monotonic()
        saved = self._steps.step()
        if saved is not None:
            self._steps = None
        self._ended_at = time.monotonic()
        self._took_s += self._ended_at - began
        return saved
