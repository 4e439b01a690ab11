"""A few numbers in memory shared with the server say whether the renderer lives, and whose work it does.

Messages could not tell: a renderer that hangs sends none, and one that has died tells nobody what it was doing.
"""

from __future__ import annotations

import mmap
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager

_NUMBERS = struct.Struct("<qqqdd")
SIZE = 64


class Heartbeat:
    """One writer. Torn reads do no harm: the server looks again, and judges by what stays."""

    def __init__(self, descriptor: int) -> None:
        self._memory = mmap.mmap(descriptor, SIZE)
        self.beats = 0  # counts each piece of work begun or ended, and each message taken
        self.taken = 0  # messages
        self.task = 0  # the task that is being worked on; 0: none
        self.turn_s = 0.0  # what the last piece of work took
        self.allowance_s = 0.0  # what this piece may take beyond the usual

    def read(self) -> None:
        self.beats, self.taken, self.task, self.turn_s, self.allowance_s = _NUMBERS.unpack_from(self._memory)

    def take(self) -> None:
        """Count a message as taken."""
        self.taken += 1
        self._beat()

    @contextmanager
    def working(self, task: int, allowance_s: float = 0.0) -> Iterator[None]:
        self.task, self.allowance_s = task, allowance_s
        self._beat()
        yield
        self.task, self.allowance_s = 0, 0.0
        self._beat()

    def lasted(self, seconds: float) -> None:
        self.turn_s = seconds

    def _beat(self) -> None:
        self.beats += 1
        _NUMBERS.pack_into(self._memory, 0, self.beats, self.taken, self.task, self.turn_s, self.allowance_s)

    def close(self) -> None:
        self._memory.close()


def memory() -> int:
    """The descriptor of memory for a heartbeat; the caller closes it."""
    descriptor = os.memfd_create("sunbox-heartbeat", os.MFD_CLOEXEC)
    os.ftruncate(descriptor, SIZE)
    return descriptor
