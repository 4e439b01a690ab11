"""Work that is counted, and time that is simulated: a claim about speed then holds on every machine, or on none."""

from __future__ import annotations

import asyncio
import gc
import selectors
import sys
from collections.abc import Callable, Coroutine
from types import FrameType
from typing import Any


def python_lines(work: Callable[[], object]) -> int:
    """How many lines of Python `work` runs in this thread, those of the libraries included; what runs in C counts as
    one line."""
    count, before = 0, sys.gettrace()

    def trace(frame: FrameType, event: str, _: object) -> Any:
        nonlocal count
        count += event == "line"
        return trace

    gc.collect()
    gc.disable()  # else finalizers of others' objects would count
    sys.settrace(trace)
    try:
        work()
    finally:
        sys.settrace(before)
        gc.enable()
    return count


class _Skipping(selectors.DefaultSelector):
    """Waits for no timer: the time of the loop goes on by as much at once."""

    now_s = 0.0

    def select(self, timeout: float | None = None) -> Any:
        ready = super().select(None if timeout is None else 0)
        if not ready and timeout is not None:
            self.now_s += max(timeout, 0.0)
        return ready


class _SimulatedLoop(asyncio.SelectorEventLoop):
    def __init__(self) -> None:
        self._clock = _Skipping()
        super().__init__(self._clock)

    def time(self) -> float:
        return self._clock.now_s


def in_simulated_time(test: Coroutine[Any, Any, None]) -> None:
    """Run `test` on a loop whose timers take no time, and whose clock says what they would have taken.

    For work without threads and processes: what these do takes none of that time.
    """
    with asyncio.Runner(loop_factory=_SimulatedLoop) as runner:
        runner.run(test)
