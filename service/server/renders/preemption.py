"""Which renders give way to one that waits: those of a client with more slots than its share, or the longest ones.

A render that gives way is stored and goes on later, so that it costs a checkpoint and loading its scene again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Protocol, TypeVar

WAIT_S = 10.0  # that a render waits before others give way to it
SOON_S = 1.0  # instead, where its client has nothing and had less than LITTLE_S within the last minute
# A client that comes again and again with a little interrupts others for that part of the time at most: each
# interruption costs them a checkpoint and a scene to load.
LITTLE_S = 1.0
TIMES = 2  # what a render must have had already of what the waiting one had, to give way to it


class Render(Protocol):
    @property
    def client(self) -> str:
        """Who has the slot: its owner, or where there are no owners the render alone."""

    @property
    def owner(self) -> str: ...

    @property
    def priority(self) -> int: ...

    @property
    def place(self) -> int:
        """It rises in the order of arrival."""

    @property
    def elapsed_s(self) -> float:
        """For how long it has been rendered."""

    @property
    def resident_bytes(self) -> int:
        """The memory that it gives back."""

    @property
    def can_give_way(self) -> bool: ...


T = TypeVar("T", bound=Render)


def giving_way(waiting: T, running: Sequence[T], free: int, lacks: int) -> list[T]:
    """Those of `running` that give way to a render that has waited for long; none where that would not be fair.

    `free`: slots; `lacks`: bytes of memory that are missing. A client that has at least two slots more than the
    waiting one gives back the render that it would have begun last. Where there are more clients than slots, slots
    go round by time [least attained service, Nuyens and Wierman 2008]: the render that has had most time gives way to
    one that has had at most half of that, so that it is interrupted a few times however long it is.
    """
    counts = Counter(each.client for each in running)
    left = [each for each in running if each.can_give_way]
    chosen: list[T] = []
    while lacks > 0 or not (free or chosen):
        own = counts[waiting.client]
        most = max((counts[each.client] for each in left), default=0)
        if most > own + 1:
            rich = [each for each in left if counts[each.client] == most]
            gives = max(rich, key=lambda each: (-each.priority, each.place))
        elif own == 0 and (long := [each for each in left if _had_enough(each, waiting)]):
            gives = max(long, key=lambda each: each.elapsed_s)
        else:
            return []
        left.remove(gives)
        chosen.append(gives)
        counts[gives.client] -= 1
        lacks -= gives.resident_bytes
    return chosen


def _had_enough(render: Render, waiting: Render) -> bool:
    if render.owner == waiting.owner and render.priority > waiting.priority:
        return False
    return render.elapsed_s >= max(WAIT_S, TIMES * waiting.elapsed_s)
