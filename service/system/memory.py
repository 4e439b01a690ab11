"""One budget of memory (SUNBOX_MEMORY) for all that is kept for callers: bodies, scenes, pictures, caches.

What the processes take when idle, and what one piece of work takes in passing, is not in it.
"""

from __future__ import annotations

import os
import threading
import weakref
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from service.problems import TooLarge, Unavailable

Owner = Literal["bodies", "documents", "scenes", "pictures", "assets"]

SHARE = 0.5  # of the machine's memory: the rest is for the processes themselves, the system's caches and others
RETRY_S = 5
MIB = 2**20
CGROUP = Path("/sys/fs/cgroup")
OWN_GROUPS = Path("/proc/self/cgroup")


@dataclass(frozen=True)
class _Cache:
    owner: Owner
    bytes: Callable[[], int]
    shrink: Callable[[int], None]


class MemoryBudget:
    """Counts bytes by what they are for. For any thread.

    Work that is refused can be asked for again; a cache gives way to work.
    """

    def __init__(self, limit: int | None = None) -> None:
        """`limit` in bytes; by default half of the machine's memory, or of the control group's."""
        self.limit = int(SHARE * machine_memory()) if limit is None else limit
        self._held: weakref.WeakKeyDictionary[object, dict[Owner, int]] = weakref.WeakKeyDictionary()
        self._caches: list[_Cache] = []
        self._lock = threading.Lock()

    def cache(self, owner: Owner, bytes: Callable[[], int], shrink: Callable[[int], None]) -> None:
        """Count a cache: `bytes` gives what it holds, `shrink` frees as many bytes where it can."""
        self._caches.append(_Cache(owner, bytes, shrink))

    def hold(self, owner: Owner, holder: object, size: int) -> None:
        """Count `holder` with that many bytes from now on, until it is released or gone.

        As before where it raises TooLarge, for what could never be, or Unavailable.
        """
        self.hold_all(holder, {owner: size})

    def hold_all(self, holder: object, sizes: Mapping[Owner, int]) -> None:
        """As `hold`, for several kinds of bytes: all of them are counted, or none."""
        self.check(sum(sizes.values()))
        over = self._take(holder, sizes)
        if over > 0:
            for cache in self._caches:
                cache.shrink(over)
            over = self._take(holder, sizes)
        if over > 0:
            raise Unavailable("There is no memory for this just now (SUNBOX_MEMORY).", RETRY_S)

    def lacks(self, size: int) -> int:
        """The bytes that are missing for so many more, once caches have given way; 0 where there is room."""
        if (over := self._over(size)) > 0:
            for cache in self._caches:
                cache.shrink(over)
        return max(0, self._over(size))

    def _over(self, size: int) -> int:
        with self._lock:
            return self._used().total() + size - self.limit

    def check(self, size: int) -> None:
        """Raises TooLarge for what could never be held, however much others give back."""
        if size > self.limit:
            needed, most = -(-size // MIB), self.limit // MIB
            raise TooLarge(f"This takes {needed} MiB of memory; {most} MiB are allowed (SUNBOX_MEMORY).")

    def release(self, holder: object) -> None:
        with self._lock:
            self._held.pop(holder, None)

    @contextmanager
    def held(self, owner: Owner, size: int) -> Iterator[None]:
        """Count that many bytes while it lasts. Raises TooLarge, Unavailable."""
        holder = _Holder()
        self.hold(owner, holder, size)
        try:
            yield
        finally:
            self.release(holder)

    def used(self) -> dict[str, int]:
        """Bytes by owner."""
        with self._lock:
            return dict(self._used())

    def _take(self, holder: object, sizes: Mapping[Owner, int]) -> int:
        """The bytes that are too many: where there are any, nothing has changed. Less than before is always fine."""
        with self._lock:
            mine = self._held.setdefault(holder, {})
            more = sum(size - mine.get(owner, 0) for owner, size in sizes.items())
            over = self._used().total() + more - self.limit
            if more > 0 and over > 0:
                return over
            mine.update(sizes)
            return 0

    def _used(self) -> Counter[str]:
        used: Counter[str] = Counter({"bodies": 0, "documents": 0, "scenes": 0, "pictures": 0, "assets": 0})
        for sizes in self._held.values():
            used.update(sizes)
        for cache in self._caches:
            used[cache.owner] += cache.bytes()
        return used


class _Holder:
    """Something to count bytes for."""


def machine_memory() -> int:
    """The bytes of the machine, or of the control group that this process is in, where these are fewer."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for file in _limits():
        with suppress(OSError, ValueError):  # no such file, or "max"
            total = min(total, int(file.read_text()))
    return total


def _limits() -> Iterator[Path]:
    """Where limits of this process's control groups may stand [cgroups(7)]: its own, and those that it is within."""
    try:
        lines = OWN_GROUPS.read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, path = (*line.split(":", 2), "", "")[:3]
        if path and controllers in ("", "memory"):  # of version 2, and of version 1
            root, name = (CGROUP, "memory.max") if not controllers else (CGROUP / "memory", "memory.limit_in_bytes")
            own = root / path.lstrip("/")
            yield from (folder / name for folder in (own, *own.parents) if folder.is_relative_to(root))
            yield root / name  # in a container the group's path may be that of the machine
