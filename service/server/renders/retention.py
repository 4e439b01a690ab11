"""Which ended renders make room: those of an owner of too many, those of who keeps most bytes, and old ones."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


@dataclass(frozen=True)
class Retention:
    """Which of the ended renders are kept."""

    kept: int  # renders of each owner, of those of batches ten times as many
    kept_bytes: int  # of the pictures and documents of all of them
    kept_s: float  # after a render's end


@dataclass(frozen=True)
class QueueLimits:
    """How many renders run and wait at once, and which of the ended ones are kept."""

    running: int  # renders; the others wait, as each has its scene and its picture on the GPU
    waiting: int
    each: int  # running and waiting, of one owner
    retention: Retention
    disk_bytes: int | None  # of SUNBOX_DATA_QUOTA, of which the documents of what waits have a part


class Ended(Protocol):
    @property
    def owner(self) -> str: ...

    @property
    def ended_at(self) -> float:
        """By the monotonic clock, s."""

    @property
    def size(self) -> int: ...

    @property
    def counts_as(self) -> int:
        """Of the renders of its owner that are kept, how many it is."""


T = TypeVar("T", bound=Ended)


class KeptRenders(Generic[T]):
    """The ended renders within their bounds. What happens at an end does not grow with their number."""

    def __init__(self, bounds: Retention) -> None:
        self._bounds = bounds
        self._lines: dict[str, dict[T, int]] = {}  # sizes by owner, the oldest end first
        self._bytes: Counter[str] = Counter()
        self._renders: Counter[str] = Counter()
        self._count = 0
        self._newest: T | None = None

    def __len__(self) -> int:
        return self._count

    def add(self, render: T) -> None:
        """Keep one that has ended now; or count it by the size that it has by now. At a start they come in the order
        of their ends."""
        line = self._lines.setdefault(render.owner, {})
        if render not in line:
            self._newest = render
            self._count += 1
            self._renders[render.owner] += render.counts_as
        self._bytes[render.owner] += render.size - line.get(render, 0)
        line[render] = render.size

    def remove(self, render: T) -> None:
        line = self._lines.get(render.owner, {})
        if render in line:
            self._count -= 1
            self._newest = None if self._newest is render else self._newest
            self._bytes[render.owner] -= line.pop(render)
            self._renders[render.owner] -= render.counts_as
            if not line:
                del self._lines[render.owner], self._bytes[render.owner], self._renders[render.owner]

    def take_superfluous(self, now: float) -> list[T]:
        """Remove those to forget, by `now`. The newest one, and an owner's only one, stay until they are old, however
        large they are."""
        goes, bounds = list[T](), self._bounds
        for owner, line in list(self._lines.items()):
            while line and now - (first := next(iter(line))).ended_at >= bounds.kept_s:
                goes.append(self._take(first))
            while len(line) > 1 and self._renders[owner] > bounds.kept:
                goes.append(self._take(next(iter(line))))
        return goes + self._take_largest(self._bytes.total() - bounds.kept_bytes)

    def take_for(self, size: int) -> list[T]:
        """Remove as many as take so many bytes, but for the newest one."""
        return self._take_largest(size)

    def left_s(self, now: float) -> float | None:
        """Seconds until the next one is old; None where there is none."""
        ends = [next(iter(line)).ended_at for line in self._lines.values()]
        return max(0.0, min(ends) + self._bounds.kept_s - now) if ends else None

    def _take_largest(self, size: int) -> list[T]:
        """Of the owner of most bytes the oldest, and not those of another owner of few, until `size` is reached."""
        goes = list[T]()
        while size > 0 and self._count > 1:
            for owner, _ in self._bytes.most_common(2):
                first = next(iter(self._lines[owner]))
                if first is not self._newest:
                    break
            size -= self._lines[owner][first]
            goes.append(self._take(first))
        return goes

    def _take(self, render: T) -> T:
        self.remove(render)
        return render
