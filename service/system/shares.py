"""Shares of something that all callers use, so that nobody can take so much that others are refused; and the caller
whom the work at hand is for.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from service.problems import TooLarge, TooManyRequests, Unavailable

RETRY_S = 5
OWNER = re.compile(r"[0-9a-f]{16}")  # the name that a key's owner has (`server/http/guard.py`)
KEY_LETTERS = 8

# The name of the caller whose request is being worked on, "" for the service's own work. Tasks inherit it from the
# request that started them, and threads from the task that gave them their work.
CALLER: ContextVar[str] = ContextVar("CALLER", default="")


def key_label(caller: str) -> str:
    """The first letters of the hash of a caller's key, by which metrics and log lines name it; "" for a caller that
    has no key, which may be an address."""
    return caller[:KEY_LETTERS] if OWNER.fullmatch(caller) else ""


class Shares:
    """Divides `most` units, of bytes or of requests, among callers, who are told apart by name.

    The rule: a caller may take more as long as it then has no more than is left free, which is half of what others
    leave [Choudhury and Hahne 1998, dynamic queue length thresholds, alpha = 1]. So a caller that has nothing gets n
    units wherever 2 n are free; and as one caller alone leaves half of all free, another one's request for up to a
    quarter of `most` always succeeds beside it. When k callers take as much as they get, and take it again whenever
    some is released, each has `most` / (k + 1), and as much remains free. Where less is free, a caller that has
    nothing still gets a single unit: of few requests at a time the last one is for somebody who has none.

    `what` names the units in errors, as "uploads (SUNBOX_MAX_BODIES)". No caller gets more than `each` where it is
    given. For the event loop alone: there is no lock.
    """

    def __init__(self, most: int, what: str, each: int | None = None, retry_s: int = RETRY_S) -> None:
        self._most = most
        half = max(most // 2, min(1, most))
        self._each = half if each is None else min(each, half)
        self._what = what
        self._retry_s = retry_s
        self._taken: Counter[str] = Counter()
        self.total = 0  # units that are taken

    def check(self, caller: str, n: int = 1) -> None:
        """Raise what `take` would raise, and take nothing."""
        taken, share = self._taken[caller], self._share(caller)
        if taken + n <= share:
            return
        if n > self._each:
            raise TooLarge(f"This is more than one caller's share of {self._what}.")
        if n <= share or taken + n > self._each:
            raise TooManyRequests(
                f"Your own {self._what} take all that one caller may have just now. Wait until some of them end.",
                self._retry_s,
            )
        raise Unavailable(f"There is no room for more {self._what} just now.", self._retry_s)

    def has_room(self, caller: str, n: int = 1) -> bool:
        """True if `take` would take `n` units."""
        return self._taken[caller] + n <= self._share(caller)

    def _share(self, caller: str) -> int:
        taken, free = self._taken[caller], self._most - self.total
        return min(self._each, max((free + taken) // 2, min(1, free) if taken == 0 else 0))

    def take(self, caller: str, n: int = 1) -> None:
        """Give `caller` another `n` units, which it has until they are released.

        Raises TooManyRequests where the caller's own units are the cause: without them it would get these. Raises
        Unavailable where those of others are the cause, and TooLarge where no caller ever gets so many.
        """
        self.check(caller, n)
        self.count(caller, n)

    def count(self, caller: str, n: int = 1) -> None:
        """Count units that `caller` has anyway, beyond its share too: what a restart found on the disk."""
        self._taken[caller] += n
        self.total += n

    def release(self, caller: str, n: int = 1) -> None:
        """Take back units that `caller` has."""
        self._taken[caller] -= n
        self.total -= n
        if self._taken[caller] <= 0:
            del self._taken[caller]

    def of(self, caller: str) -> int:
        """The units that `caller` has."""
        return self._taken[caller]

    @contextmanager
    def growing(self, caller: str) -> Iterator[Callable[[int], None]]:
        """A context in which `caller` has as many units as the function was last called with: 0 at first.

        The function raises what `take` raises, and then changes nothing.
        """
        units = 0

        def have(n: int) -> None:
            nonlocal units
            if n > units:
                self.take(caller, n - units)
            else:
                self.release(caller, units - n)
            units = n

        try:
            yield have
        finally:
            self.release(caller, units)

    @contextmanager
    def taken(self, caller: str, n: int = 1) -> Iterator[None]:
        """A context in which `caller` has another `n` units. Raises what `take` raises."""
        self.take(caller, n)
        try:
            yield
        finally:
            self.release(caller, n)
