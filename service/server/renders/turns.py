"""The order in which renders start: the owners go round, and among one's own the higher priority goes first."""

from __future__ import annotations

import itertools
from bisect import bisect_left, insort
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Generic, Protocol, TypeVar

REMEMBERED = 1000  # owners whose last turn counts


class QueueItem(Protocol):
    place: int  # in the order of arrival; 0 before it came

    @property
    def owner(self) -> str: ...

    @property
    def priority(self) -> int: ...

    @property
    def began(self) -> bool:
        """True if it was running when the server ended, or gave way: it goes on before its owner's others begin."""


T = TypeVar("T", bound=QueueItem)


class FairQueue(Generic[T]):
    """Renders that wait. An owner of whose renders fewer run goes first, then the one whose turn is longer ago."""

    def __init__(self) -> None:
        self._queues: dict[str, list[T]] = {}  # by owner, in the order of `_key`
        self._arrivals, self._turns = itertools.count(1), itertools.count()
        self._last: dict[str, int] = {}  # the turn that each owner had last, the longest ago first

    def __len__(self) -> int:
        return sum(map(len, self._queues.values()))

    def __iter__(self) -> Iterator[T]:
        return itertools.chain.from_iterable(list(self._queues.values()))

    def __contains__(self, render: T) -> bool:
        return self._find(render) is not None

    def count(self, owner: str) -> int:
        return len(self._queues.get(owner, ()))

    @property
    def owners(self) -> Collection[str]:
        """The renders that wait."""
        return self._queues.keys()

    def line(self, owner: str) -> Sequence[T]:
        """An owner's renders that wait, in the order in which they begin."""
        return self._queues.get(owner, [])

    def add(self, render: T) -> None:
        """Have a render wait; one that has waited before has the same place again."""
        render.place = render.place or next(self._arrivals)
        insort(self._queues.setdefault(render.owner, []), render, key=_key)

    def remove(self, render: T) -> bool:
        """True if it was waiting."""
        index = self._find(render)
        if index is not None:
            queue = self._queues[render.owner]
            del queue[index]
            if not queue:
                del self._queues[render.owner]
        return index is not None

    def _find(self, render: T) -> int | None:
        queue = self._queues.get(render.owner, [])
        index = bisect_left(queue, _key(render), key=_key)
        return index if index < len(queue) and queue[index] is render else None

    def next(
        self,
        running: Counter[str],
        fits: Callable[[T], bool] = lambda render: True,
        may: Callable[[str], bool] = lambda owner: True,
    ) -> T | None:
        """Take the next one that `fits`, of owners that `may` have another; `running` counts the owners' renders that
        run."""
        for owner in sorted(filter(may, self._queues), key=lambda owner: self._turn(owner, running)):
            for render in self._queues[owner]:
                if fits(render):
                    self.take(render)
                    return render
        return None

    def take(self, render: T) -> None:
        """Let a render have its owner's turn."""
        self.remove(render)
        self._last.pop(render.owner, None)
        self._last[render.owner] = next(self._turns)
        if len(self._last) > REMEMBERED:
            del self._last[next(iter(self._last))]

    def _turn(self, owner: str, running: Counter[str]) -> tuple[int, bool, int, int]:
        first = self._queues[owner][0]
        return running[owner], not first.began, self._last.get(owner, -1), first.place


def _key(render: QueueItem) -> tuple[bool, int, int]:
    return not render.began, -render.priority, render.place
