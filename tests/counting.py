"""Work that is counted, and time that is simulated: a claim about speed then holds on every machine, or on none."""

from __future__ import annotations

import asyncio
import gc
import json
import selectors
import sys
import threading
import zlib
from collections import Counter
from collections.abc import Callable, Coroutine
from types import CodeType, FrameType
from typing import Any

import pytest


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


class LoopWork:
    """What the event loop does at a stretch within the context: lines of Python, and bytes of JSON that are written
    or read at once, which C does without letting the loop go on."""

    def __init__(self) -> None:
        self.lines, self.json_bytes = 0, 0  # the most of one stretch
        self.where = ""  # the function with most of its lines
        self._counts = Counter[CodeType]()
        self._patch = pytest.MonkeyPatch()

    def __enter__(self) -> LoopWork:
        thread, run = threading.get_ident(), asyncio.Handle._run

        def stretch(handle: asyncio.Handle) -> None:
            self._counts.clear()
            run(handle)
            if (lines := self._counts.total()) > self.lines:
                code = self._counts.most_common(1)[0][0]
                self.lines, self.where = lines, f"{code.co_filename}:{code.co_qualname}"

        def weighed(function: Callable[..., Any]) -> Callable[..., Any]:
            def call(value: Any, *rest: Any, **more: Any) -> Any:
                made = function(value, *rest, **more)
                if threading.get_ident() == thread:
                    text = made if isinstance(made, str) else value
                    self.json_bytes = max(self.json_bytes, len(text))
                return made

            return call

        self._patch.setattr(asyncio.Handle, "_run", stretch)
        for name in ("dumps", "loads"):
            self._patch.setattr(json, name, weighed(getattr(json, name)))
        self._patch.setattr(zlib, "compress", weighed(zlib.compress))
        self._before = sys.gettrace()
        sys.settrace(self._trace)
        return self

    def __exit__(self, *raised: object) -> None:
        sys.settrace(self._before)
        self._patch.undo()

    def _trace(self, frame: FrameType, event: str, _: object) -> Any:
        if event == "line":
            self._counts[frame.f_code] += 1
        return self._trace
