"""Which ended renders make room: those of an owner of too many, those of who keeps most bytes, and old ones."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar


@dataclass(frozen=True)
class Retention:
    """Which of the ended renders are kept."""

    kept: int = 64  # of one owner ...
    kept_bytes: int = 1 << 30  # ... what the pictures and documents of all of them may take ...
    kept_s: float = 3600.0  # ... and for how long


class Ended(Protocol):
    @property
    def owner(self) -> str: ...

    @property
    def ended_at(self) -> float:
        """By the monotonic clock, s."""

    @property
    def size(self) -> int: ...


T = TypeVar("T", bound=Ended)


def superfluous(ended: Iterable[T], bounds: Retention, now: float) -> list[T]:
    """Those to forget, by `now`. The newest one stays, however large it is, until it is old."""
    goes, stays, left = list[T](), list[T](), list[T]()
    for render in sorted(ended, key=lambda render: render.ended_at):
        (goes if now - render.ended_at >= bounds.kept_s else stays).append(render)
    counts = Counter(render.owner for render in stays)
    for render in stays:
        if counts[render.owner] > bounds.kept:
            counts[render.owner] -= 1
            goes.append(render)
        else:
            left.append(render)
    sizes = Counter[str]()
    for render in left:
        sizes[render.owner] += render.size
    while left[1:] and sizes.total() > bounds.kept_bytes:
        most = sizes.most_common(1)[0][0]  # the owner of most bytes loses a render, and not another owner of few
        first = next(render for render in left if render.owner == most)
        left.remove(first)
        sizes[most] -= first.size
        goes.append(first)
    return goes
