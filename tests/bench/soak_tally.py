"""The results of a soak's clients, counted from many threads, and their table."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Sequence
from statistics import median

from tests.bench.soak_server import SoakServer, descriptors, largest, resident

MIB = 2**20


class Tally:
    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.kills = self.frames = self.renders = self.cancelled = self.uploads = self.vanished = self.stuck = 0
        self.drags = 0  # on the page
        self.lost: Counter[str] = Counter()  # losses, which should not happen, by kind
        self.errors: Counter[str] = Counter()  # refusals that were expected, by kind
        self.first_frames_s: list[float] = []
        self.recoveries_s: list[float] = []
        self.jain: float | None = None
        self.exit_code, self.orphans = 0, 0
        self._killed_at: dict[str, float] = {}
        self._watchers: set[str] = set()
        self._advanced_at: dict[int | None, float] = {}  # by thread
        self._memory: list[tuple[int, int, int]] = []  # server's, renderer's bytes, descriptors
        self._ended: tuple[int, int, int] = (0, 0, 0)
        self._page: list[tuple[int, int]] = []  # bytes of heap, nodes

    def count(self, name: str, more: int = 1) -> None:
        with self._lock:
            setattr(self, name, getattr(self, name) + more)

    def lose(self, what: str) -> None:
        with self._lock:
            self.lost[what] += 1

    def refuse(self, what: str) -> None:
        with self._lock:
            self.errors[what] += 1

    def kill(self) -> None:
        """Record that a renderer was killed; the clients that watch frames record when the next one comes."""
        with self._lock:
            self.kills += 1
            for watcher in self._watchers:
                self._killed_at.setdefault(watcher, time.monotonic())

    def frame(self, watcher: str, began_again: bool) -> None:
        with self._lock:
            self.frames += 1
            self._watchers.add(watcher)
            if began_again and watcher in self._killed_at:
                self.recoveries_s.append(time.monotonic() - self._killed_at.pop(watcher))

    def advance(self) -> None:
        """Record that the work for which the calling thread waits has progressed."""
        self._advanced_at[threading.get_ident()] = time.monotonic()

    def still_s(self, thread: int | None, since: float) -> float:
        """Seconds since the work for which that thread waits has progressed, counted from `since` at the earliest."""
        return time.monotonic() - max(since, self._advanced_at.get(thread, since))

    def moved(self, watcher: str, first_frame_s: float) -> None:
        with self._lock:
            self.first_frames_s.append(first_frame_s)
            self._killed_at.pop(watcher, None)

    def seen(self, server: int, renderer: int, open_files: int, settled: bool) -> None:
        if settled and renderer:
            self._memory.append((server, renderer, open_files))

    def weighed(self, heap: int, nodes: int, settled: bool) -> None:
        if settled:
            self._page.append((heap, nodes))

    def end(self, server: SoakServer) -> None:
        self._ended = resident(server.pid), largest(server.renderers()), descriptors(server)

    def good(self, growth: float, fair: float, page_growth: float) -> bool:
        early, late = _halves(self._memory, 0)
        early_page, late_page = _halves(self._page, 0)
        return not (
            self.lost
            or self.stuck
            or self.exit_code
            or self.orphans
            or late > growth * early
            or late_page > page_growth * early_page
            or (self.jain is not None and self.jain < fair)
        )

    def table(self) -> str:
        rows: list[tuple[str, str]] = [
            ("renderers killed", str(self.kills)),
            ("kill to next frame, median / p95 (s)", _quantiles(self.recoveries_s)),
            ("frames", str(self.frames)),
            ("update to first frame, median / p95 (s)", _quantiles(self.first_frames_s)),
            ("renders done / cancelled", f"{self.renders} / {self.cancelled}"),
            ("drags in a browser", str(self.drags) if self._page else "-"),
            ("its page's heap, first / second half (MiB)", self._page_grown(0, MIB)),
            ("its page's nodes, likewise", self._page_grown(1, 1)),
            ("uploads", str(self.uploads)),
            ("clients that vanished", str(self.vanished)),
            ("lost or wrong", _counts(self.lost)),
            ("refused, and meant to be", _counts(self.errors)),
            ("clients stuck", str(self.stuck)),
            ("Jain's index of equal streams", "-" if self.jain is None else f"{self.jain:.3f}"),
            ("server's memory, first / second half / end (MiB)", self._grown(0)),
            ("renderer's memory, likewise (MiB)", self._grown(1)),
            ("server's descriptors, likewise", self._grown(2)),
            ("exit code, orphans", f"{self.exit_code}, {self.orphans}"),
        ]
        width = max(len(name) for name, _ in rows)
        return "\n".join(f"{name:<{width}}  {value}" for name, value in rows)

    def _grown(self, which: int) -> str:
        scale = 1 if which == 2 else MIB
        return " / ".join(f"{value / scale:.0f}" for value in (*_halves(self._memory, which), self._ended[which]))

    def _page_grown(self, which: int, scale: int) -> str:
        decimals = 0 if scale == 1 else 1
        return (
            " / ".join(f"{value / scale:.{decimals}f}" for value in _halves(self._page, which)) if self._page else "-"
        )


def _halves(seen: Sequence[tuple[int, ...]], which: int) -> tuple[float, float]:
    """Medians of the first and the second half of the records."""
    values = [each[which] for each in seen]
    middle = len(values) // 2
    return (median(values[:middle]), median(values[middle:])) if middle else (0.0, 0.0)


def _quantiles(values: list[float]) -> str:
    ordered = sorted(values)
    return f"{median(ordered):.3f} / {ordered[int(0.95 * (len(ordered) - 1))]:.3f}" if ordered else "-"


def _counts(counted: Counter[str]) -> str:
    return ", ".join(f"{what} {count}" for what, count in sorted(counted.items())) or "none"
