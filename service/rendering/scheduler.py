"""Whose turn it is: everyone gets the same time on the GPU, a picture that nobody has seen yet goes first."""

from __future__ import annotations

from collections.abc import Collection
from typing import Protocol, TypeVar

# How much more than the least served a task may have had and still be preferred for its first frame (s). Without a
# bound, a slider that never rests starves the others; below some frames' worth, every drag stutters beside a render.
FIRST_FRAME_LEAD_S = 0.25


class Turn(Protocol):
    used_s: float  # virtual: as much as everybody had when it joined, and what it used since

    @property
    def ready(self) -> bool:
        """Has something to trace."""

    @property
    def unseen(self) -> bool:
        """Has nothing to show yet."""


T = TypeVar("T", bound=Turn)


class Scheduler:
    """Virtual time: the least served goes next. Who was idle starts level with the others and saves nothing up."""

    def __init__(self) -> None:
        self._now_s = 0.0
        self._waiting: set[int] = set()

    def choose(self, tasks: Collection[T]) -> T | None:
        ready = [task for task in tasks if task.ready]
        for task in ready:
            if id(task) not in self._waiting:
                task.used_s = max(task.used_s, self._now_s)
        self._waiting = {id(task) for task in ready}
        if not ready:
            return None
        self._now_s = min(task.used_s for task in ready)
        unseen = [task for task in ready if task.unseen and task.used_s <= self._now_s + FIRST_FRAME_LEAD_S]
        return min(unseen or ready, key=lambda task: task.used_s)
