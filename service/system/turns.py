"""Whom the work at hand is for, and turns at what few can use at a time, which go round these callers."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

# The name of the caller whose request is being worked on, "" for the service's own work. Tasks inherit it from the
# request that started them, and threads from the task that gave them their work.
CALLER: ContextVar[str] = ContextVar("CALLER", default="")


class Turns:
    """At most `most` threads at a time, all but one of them for the same caller: `with turns.one():` waits.

    The next turn is that of the caller with the fewest, then of the thread that has waited longest.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._each = max(1, most - 1)
        self._changed = threading.Condition()
        self._waiting: dict[object, str] = {}  # callers of the threads that wait, the first one first
        self._taken: Counter[str] = Counter()

    @contextmanager
    def one(self) -> Iterator[None]:
        caller, me = CALLER.get(), object()
        with self._changed:
            self._waiting[me] = caller
            self._changed.wait_for(lambda: self._next() is me)
            del self._waiting[me]
            self._taken[caller] += 1
            self._changed.notify_all()  # there may be a turn for another one
        try:
            yield
        finally:
            with self._changed:
                self._taken[caller] -= 1
                if not self._taken[caller]:
                    del self._taken[caller]
                self._changed.notify_all()

    def _next(self) -> object | None:
        if self._taken.total() >= self._most:
            return None
        able = [me for me, caller in self._waiting.items() if self._taken[caller] < self._each]
        return min(able, key=lambda me: self._taken[self._waiting[me]], default=None)
