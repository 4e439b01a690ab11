"""Decides whose turn it is: clients share the GPU equally, and a picture that nobody has seen yet goes first."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable
from typing import Protocol, TypeVar

# How much more than the least served a client may have had and still be preferred for its first frame (s). Without a
# bound, a slider that never rests starves the others; below some frames' worth, every drag stutters beside a render.
FIRST_FRAME_LEAD_S = 0.25


class Turn(Protocol):
    used_s: float  # virtual, within its client
    client: str

    @property
    def ready(self) -> bool:
        """Whether it has something to do."""

    @property
    def unseen(self) -> bool:
        """Whether somebody waits for its first frame."""


T = TypeVar("T", bound=Turn)


class Scheduler:
    """Virtual time: the client served least goes next, and of its tasks the one served least.

    A client that was idle starts level with the others and gets no credit for its rest; time beyond its share is
    remembered until the others have caught up.
    """

    def __init__(self) -> None:
        self._used_s: dict[str, float] = defaultdict(float)
        self._now_s = 0.0
        self._waiting: set[Hashable] = set()
        self._ready: dict[str, int] = {}  # tasks, by client, at the last choice

    def choose(self, tasks: Collection[T]) -> T | None:
        ready: dict[str, list[T]] = defaultdict(list)
        for task in tasks:
            if task.ready:
                ready[task.client].append(task)
        self._level(ready)
        self._ready = {client: len(tasks) for client, tasks in ready.items()}
        if not ready:
            return None
        self._now_s = min(self._used_s[client] for client in ready)
        within = self._now_s + FIRST_FRAME_LEAD_S
        first = [task for tasks in ready.values() for task in tasks if task.unseen]
        eager = {task.client for task in first if self._used_s[task.client] <= within}
        client = min(eager or ready, key=lambda name: self._used_s[name])
        candidates = [task for task in ready[client] if task.unseen] if eager else ready[client]
        return min(candidates, key=lambda task: task.used_s)

    def sharers(self, client: str) -> int:
        """The number of equal shares into which the last choice parted the device, for a task of this client."""
        return max(1, len(self._ready) * self._ready.get(client, 1))

    def charge(self, task: Turn, seconds: float) -> None:
        task.used_s += seconds
        self._used_s[task.client] += seconds

    def _level(self, ready: dict[str, list[T]]) -> None:
        """Raise the virtual time of clients that have just become ready to that of the others."""
        waiting: set[Hashable] = set()
        for client, tasks in ready.items():
            waiting |= {client, *map(id, tasks)}
            if client not in self._waiting:
                self._used_s[client] = max(self._used_s[client], self._now_s)
            old = [task.used_s for task in tasks if id(task) in self._waiting]
            for task in tasks:
                if old and id(task) not in self._waiting:
                    task.used_s = max(task.used_s, min(old))
        self._waiting = waiting
        for client in [name for name, used_s in self._used_s.items() if name not in ready and used_s <= self._now_s]:
            del self._used_s[client]
