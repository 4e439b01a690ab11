"""Whose render starts next: the owners go round, and among one's own the higher priority goes first."""

from __future__ import annotations

import heapq
import itertools
from collections import Counter, defaultdict
from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar

REMEMBERED = 1000  # owners whose last turn counts


class Waiting(Protocol):
    @property
    def owner(self) -> str: ...

    @property
    def priority(self) -> int: ...

    @property
    def began(self) -> bool:
        """Whether it was running when the server ended: it goes on before others begin."""


T = TypeVar("T", bound=Waiting)


class Turns(Generic[T]):
    """Renders that wait. An owner of whose renders fewer run goes first, then the one whose turn is longer ago."""

    def __init__(self) -> None:
        self._queues: dict[str, list[tuple[int, int, int, T]]] = defaultdict(list)  # heaps; the last number is unique
        self._counts: Counter[str] = Counter()
        self._left: set[int] = set()  # numbers of those that were removed, and are still in a heap
        self._numbers: dict[int, int] = {}  # by the identity of those that wait
        self._arrivals, self._turns = itertools.count(), itertools.count()
        self._last: dict[str, int] = {}  # the turn that each owner had last, the longest ago first

    def __len__(self) -> int:
        return self._counts.total()

    def __iter__(self) -> Iterator[T]:
        entries = [entry for queue in self._queues.values() for entry in queue]
        return (render for _, _, number, render in entries if number not in self._left)

    def count(self, owner: str) -> int:
        return self._counts[owner]

    @property
    def owners(self) -> int:
        """How many owners wait."""
        return len(self._queues)

    def add(self, render: T) -> None:
        number = next(self._arrivals)
        self._numbers[id(render)] = number
        heapq.heappush(self._queues[render.owner], (not render.began, -render.priority, number, render))
        self._counts[render.owner] += 1

    def remove(self, render: T) -> bool:
        """Whether it was waiting."""
        number = self._numbers.pop(id(render), None)
        if number is not None:
            self._left.add(number)
            self._subtract(render.owner)
        return number is not None

    def next(self, running: Counter[str]) -> T | None:
        """Take the next one; `running` counts the owners' renders that run."""
        heads = {owner: head for owner in list(self._queues) if (head := self._head(owner)) is not None}
        if not heads:
            return None
        # What was running goes on first, whoever's it is; of these the owners go round as well.
        owner = min(heads, key=lambda name: (heads[name][0], running[name], self._last.get(name, -1), heads[name][2]))
        _, _, _, render = heapq.heappop(self._queues[owner])
        del self._numbers[id(render)]
        self._subtract(owner)
        self._last.pop(owner, None)
        self._last[owner] = next(self._turns)
        if len(self._last) > REMEMBERED:
            del self._last[next(iter(self._last))]
        return render

    def _head(self, owner: str) -> tuple[int, int, int, T] | None:
        queue = self._queues[owner]
        while queue and queue[0][2] in self._left:
            self._left.discard(heapq.heappop(queue)[2])
        return queue[0] if queue else None

    def _subtract(self, owner: str) -> None:
        self._counts[owner] -= 1
        if not self._counts[owner]:
            del self._counts[owner]
            self._left.difference_update(number for _, _, number, _ in self._queues.pop(owner))
