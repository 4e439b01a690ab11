"""A task's picture on its way to the server, which keeps it: the finished one, and long renders now and then."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from gpu import Steps, picture_bytes
from service import shared_memory

if TYPE_CHECKING:
    from gpu import Picture, Saved

REST = 100  # times the duration of a checkpoint pass until the next one: they cost 1 % at most
MOST_BYTES = 256 << 20  # of a picture under way: the server keeps one for each render


class Checkpointer:
    """Saves pictures in steps, between which other tasks have their turns."""

    def __init__(self, every_s: float) -> None:
        """`every_s`: between two of a picture under way, at least."""
        self._every_s = every_s
        self._steps: Steps[Saved] | None = None
        self._took_s = 0.0
        self._due_at = 0.0
        self.restart()

    def restart(self) -> None:
        """Begin anew: the picture is another one, or no longer wanted."""
        self._steps, self._took_s = None, 0.0
        self._due_at = time.monotonic() + self._every_s

    @property
    def under_way(self) -> bool:
        return self._steps is not None

    def due(self, picture: Picture) -> bool:
        """Whether the picture under way is to be kept as it is now."""
        late = time.monotonic() >= self._due_at
        return late and picture.samples > 0 and picture_bytes(picture.settings) <= MOST_BYTES

    def begin(self, picture: Picture) -> None:
        # One descriptor goes with the picture.
        arena = shared_memory.SharedArena(*(buffer.size for buffer in picture.state))
        self._steps = Steps(picture.save(lambda size: arena.room((size,), np.dtype(np.uint8))))
        self._took_s = 0.0

    def step(self) -> Saved | None:
        """Do a step; the saved picture with the last one, else None."""
        assert self._steps is not None
        began = time.monotonic()
        saved = self._steps.step()
        if saved is not None:
            self._steps = None
        now = time.monotonic()
        self._took_s += now - began
        self._due_at = now + max(self._every_s, REST * self._took_s)
        return saved
