"""Whose turn it is at something that all callers use: one order of callers, a queue in that order, and units that
threads take in it. The service has no other order but for a renderer's time (`worker/scheduler.py`), which is divided
by measured seconds.
"""

from __future__ import annotations

import itertools
import threading
from bisect import bisect_left, insort
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from service.system.shares import CALLER

REMEMBERED = 1000  # callers whose last turn counts

T = TypeVar("T")


class Turns:
    """The order of callers: the one that has least goes first, then the one whose last turn is the longest ago.

    Callers that are equal in both keep the order in which they are asked about, which is that of arrival.
    """

    def __init__(self) -> None:
        self._numbers = itertools.count(1)
        self._last: dict[str, int] = {}  # the number of each caller's last turn, the longest ago first

    def last(self, caller: str) -> int:
        """A number that rises with the turns; 0 for a caller that had none, or none for long."""
        return self._last.get(caller, 0)

    def order(self, callers: Iterable[str], has: Callable[[str], Any]) -> list[str]:
        """`callers` in the order of their turns; `has` tells how much each of them has just now."""
        return sorted(callers, key=lambda caller: (has(caller), self.last(caller)))

    def had(self, *callers: str) -> None:
        """These callers have their turn now, all of them the same one."""
        number = next(self._numbers)
        for caller in callers:
            self._last.pop(caller, None)
            self._last[caller] = number
        for _ in range(len(self._last) - REMEMBERED):
            del self._last[next(iter(self._last))]


class FairQueue(Generic[T]):
    """What waits for a turn, by caller. Among one caller's own the least `place` goes first, then the first."""

    def __init__(self, caller: Callable[[T], str], place: Callable[[T], Any] = lambda item: 0) -> None:
        self._caller, self._place = caller, place
        self._items: dict[str, list[T]] = {}  # by caller, in the order of `place`
        self._turns = Turns()

    def __len__(self) -> int:
        return sum(map(len, self._items.values()))

    def __iter__(self) -> Iterator[T]:
        return itertools.chain.from_iterable(list(self._items.values()))

    def __contains__(self, item: T) -> bool:
        return self._find(item) is not None

    @property
    def callers(self) -> Collection[str]:
        """The callers that wait."""
        return self._items.keys()

    def line(self, caller: str) -> Sequence[T]:
        """A caller's items, in the order of their turns."""
        return self._items.get(caller, [])

    def add(self, item: T) -> None:
        """Have an item wait for its turn."""
        insort(self._items.setdefault(self._caller(item), []), item, key=self._place)

    def remove(self, item: T) -> bool:
        """True if it was waiting."""
        index = self._find(item)
        if index is not None:
            caller = self._caller(item)
            del self._items[caller][index]
            if not self._items[caller]:
                del self._items[caller]
        return index is not None

    def first(
        self,
        has: Callable[[str], Any],
        fits: Callable[[T], bool] = lambda item: True,
        may: Callable[[str], bool] = lambda caller: True,
    ) -> T | None:
        """The next item that `fits`, of callers that `may` have a turn; `has` tells how much each has just now."""
        for caller in self._turns.order(filter(may, self._items), has):
            for item in self._items[caller]:
                if fits(item):
                    return item
        return None

    def take(self, item: T) -> None:
        """Let an item have its caller's turn, whoever was the next."""
        self.remove(item)
        self._turns.had(self._caller(item))

    def _find(self, item: T) -> int | None:
        items, place = self._items.get(self._caller(item), []), self._place(item)
        for index in range(bisect_left(items, place, key=self._place), len(items)):
            if items[index] is item:
                return index
            if self._place(items[index]) != place:
                break
        return None


@dataclass(frozen=True, eq=False)
class _Waiter:
    caller: str
    n: int


class FairRoom:
    """Units of something that threads share: `with room.taken(n):` waits for its caller's turn, and until there are
    `n` units.

    Nobody overtakes the one whose turn it is: small pieces of work would keep a large one waiting for ever. A caller
    that has `each` units or more gets no others; by default that is one unit less than all of them.
    """

    def __init__(self, size: int, each: int | None = None) -> None:
        self._left = size
        self._each = max(1, size - 1) if each is None else each
        self._changed = threading.Condition()
        self._waiting: FairQueue[_Waiter] = FairQueue(lambda waiter: waiter.caller)
        self._taken: Counter[str] = Counter()  # units, by caller

    @contextmanager
    def taken(self, n: int = 1) -> Iterator[None]:
        me = _Waiter(CALLER.get(), n)
        with self._changed:
            self._waiting.add(me)
            self._changed.wait_for(lambda: self._next() is me and self._left >= n)
            self._waiting.take(me)
            self._left -= n
            self._taken[me.caller] += n
            self._changed.notify_all()  # there may be room for the next one
        try:
            yield
        finally:
            with self._changed:
                self._left += n
                self._taken -= Counter({me.caller: n})  # which drops those that have none
                self._changed.notify_all()

    def _next(self) -> _Waiter | None:
        return self._waiting.first(self._taken.__getitem__, may=lambda caller: self._taken[caller] < self._each)
