"""One budget of memory (SUNBOX_MEMORY) for the bodies, scenes and pictures of all callers, and for caches.

It does not count what the processes take when idle. What a large piece of work takes while it is done counts where
that is known: `takes` says it.
"""

from __future__ import annotations

import os
import threading
import weakref
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from service.problems import TooLarge, Unavailable
from service.system.shares import CALLER, Shares

Category = Literal["bodies", "documents", "scenes", "pictures", "assets"]

SHARE = 0.5  # of the machine's memory: the rest is for the processes themselves, the system's caches and others
RETRY_S = 5
MIB = 2**20
CGROUP = Path("/sys/fs/cgroup")
PROCESS_CGROUP = Path("/proc/self/cgroup")


@dataclass(frozen=True, eq=False)
class Limit:
    """At most `most` bytes of a category, which callers share by the rule of `Shares`; `what` names it in errors."""

    category: Category
    most: int
    what: str


@dataclass(frozen=True)
class _Cache:
    category: Category
    bytes: Callable[[], int]
    shrink: Callable[[int], None]


@dataclass
class _Account:
    """The bytes of one holder, by category, and the caller whose work took them."""

    caller: str = field(default_factory=CALLER.get)
    sizes: dict[Category | Limit, int] = field(default_factory=dict)


class _Work:
    """The memory of a piece of work while it is done, as the sum of its parts."""

    def __init__(self, hold: Callable[[int], None]) -> None:
        self._hold = hold
        self._parts = dict[str, int]()

    def takes(self, part: str, size: int) -> None:
        self._parts[part] = size
        if (total := sum(self._parts.values())) >= MIB:
            self._hold(total)


_WORK: ContextVar[_Work | None] = ContextVar("WORK", default=None)


@contextmanager
def work(hold: Callable[[int], None]) -> Iterator[None]:
    """A context in which `takes` calls `hold` with the bytes that are taken in all, from a MiB on."""
    token = _WORK.set(_Work(hold))
    try:
        yield
    finally:
        _WORK.reset(token)


def takes(part: str, size: int) -> None:
    """Say that the work at hand is about to take `size` bytes for a part of it, in the place of what it said before.

    Raises what the `hold` of its context raises, which is TooLarge or Unavailable.
    """
    if (found := _WORK.get()) is not None:
        found.takes(part, size)


class Reservation:
    """An object that bytes can be counted for where nothing else has just their lifetime."""


class MemoryBudget:
    """Counts bytes by category. For any thread.

    Work that is refused can be asked for again; a cache gives way to work.
    """

    def __init__(self, limit: int | None = None) -> None:
        """`limit` in bytes; by default half of the machine's memory, or of the control group's."""
        self.limit = int(SHARE * machine_memory()) if limit is None else limit
        self._accounts: weakref.WeakKeyDictionary[object, _Account] = weakref.WeakKeyDictionary()
        self._caches: list[_Cache] = []
        self._lock = threading.Lock()

    def cache(self, category: Category, bytes: Callable[[], int], shrink: Callable[[int], None]) -> None:
        """Count a cache: `bytes` returns its size, `shrink` frees as many bytes as it is called with, if it can."""
        self._caches.append(_Cache(category, bytes, shrink))

    def hold(self, category: Category | Limit, holder: object, size: int) -> None:
        """Count `holder` with `size` bytes from now on, until it is released or garbage.

        Raises Unavailable, and TooLarge for more than the budget's limit; within a `Limit` also what `Shares.take`
        raises for the caller of the work at hand. The holder then counts as before.
        """
        self.hold_all(holder, {category: size})

    def hold_all(self, holder: object, sizes: Mapping[Category | Limit, int]) -> None:
        """As `hold`, for several categories: all of them are counted, or none."""
        over = self._take(holder, sizes)
        if over > 0:
            self.check(sum(sizes.values()))
            for cache in self._caches:
                cache.shrink(over)
            over = self._take(holder, sizes)
        if over > 0:
            raise Unavailable("There is no memory for this just now (SUNBOX_MEMORY).", RETRY_S)

    def count(self, category: Category, holder: object, size: int) -> None:
        """As `hold`, but never refused: for what is small, or in the place of what counted before and is larger."""
        with self._lock:
            self._accounts.setdefault(holder, _Account()).sizes[category] = size

    def lacks(self, size: int) -> int:
        """The bytes that are missing for `size` more, once caches have given way; 0 where there is room."""
        if (over := self._over(size)) > 0:
            for cache in self._caches:
                cache.shrink(over)
        return max(0, self._over(size))

    def _over(self, size: int) -> int:
        with self._lock:
            return self._used().total() + size - self.limit

    def check(self, size: int) -> None:
        """Raises TooLarge for more bytes than the limit, which would never fit, whatever others release."""
        if size > self.limit:
            needed, most = -(-size // MIB), self.limit // MIB
            raise TooLarge(f"This takes {needed} MiB of memory; {most} MiB are allowed (SUNBOX_MEMORY).")

    def release(self, holder: object) -> None:
        with self._lock:
            self._accounts.pop(holder, None)

    @contextmanager
    def reserved(self, category: Category, size: int) -> Iterator[None]:
        """A context in which `size` bytes count. Raises TooLarge, Unavailable."""
        with self.growing(category) as hold:
            hold(size)
            yield

    @contextmanager
    def growing(self, category: Category | Limit) -> Iterator[Callable[[int], None]]:
        """A context in which as many bytes count as its function was last called with; the function is `hold`."""
        holder = Reservation()
        try:
            yield lambda size: self.hold(category, holder, size)
        finally:
            self.release(holder)

    def used(self) -> dict[str, int]:
        """Bytes by category."""
        with self._lock:
            return dict(self._used())

    def _take(self, holder: object, sizes: Mapping[Category | Limit, int]) -> int:
        """The bytes that are too many: where there are any, nothing has changed. Less than before is always fine."""
        with self._lock:
            account = self._accounts.setdefault(holder, _Account())
            grown = {each: size - account.sizes.get(each, 0) for each, size in sizes.items()}
            for each, more in grown.items():
                if isinstance(each, Limit) and more > 0:
                    self._shares(each).check(account.caller, more)
            more = sum(grown.values())
            over = self._used().total() + more - self.limit
            if more > 0 and over > 0:
                return over
            account.sizes.update(sizes)
            return 0

    def _shares(self, limit: Limit) -> Shares:
        shares = Shares(limit.most, limit.what)
        for account in self._accounts.values():
            shares.count(account.caller, account.sizes.get(limit, 0))
        return shares

    def _used(self) -> Counter[str]:
        used: Counter[str] = Counter(dict.fromkeys(get_args(Category), 0))
        for account in self._accounts.values():
            for each, size in account.sizes.items():
                used[each.category if isinstance(each, Limit) else each] += size
        for cache in self._caches:
            used[cache.category] += cache.bytes()
        return used


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
        lines = PROCESS_CGROUP.read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, path = (*line.split(":", 2), "", "")[:3]
        if path and controllers in ("", "memory"):  # of version 2, and of version 1
            root, name = (CGROUP, "memory.max") if not controllers else (CGROUP / "memory", "memory.limit_in_bytes")
            cgroup = root / path.lstrip("/")
            yield from (folder / name for folder in (cgroup, *cgroup.parents) if folder.is_relative_to(root))
            yield root / name  # in a container the group's path may be that of the machine
