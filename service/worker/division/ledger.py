"""The ledger of a picture's bands: which are free, leased or done. Runs without GL and without a clock of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from gpu import ACCUMULATOR_BYTES, Band, border_after

PIXEL_BYTES = ACCUMULATOR_BYTES  # of a result
MOST_BYTES = 3_000_000  # of one: it is copied a few times on its way, and a lost one is traced again
AHEAD_BYTES = 256 << 20  # of results and leases of blocks whose turn has not come
LEASE_S = 0.5  # of tracing at most: what a lost renderer costs, and how long the last one is waited for
LEAST_S = 0.02  # at least: a lease and its answer cost 1 or 2 ms
ALIGNED = 8  # rows: the side of a work group


@dataclass
class Outstanding:
    """A lease that has not come back."""

    assistant: int
    band: Band
    since: float  # when it was given, by the caller's clock


@dataclass
class _Block:
    first: int
    end: int
    free: list[tuple[int, int]]  # ranges of rows, from the top to the bottom
    done: int = 0  # rows
    parked: list[tuple[Band, np.ndarray]] = field(default_factory=list)  # results that came before its turn

    @property
    def free_rows(self) -> int:
        return sum(end - top for top, end in self.free)


class Ledger:
    """The ledger of one picture of `width` x `height` pixels and one generation, from one of its borders on."""

    def __init__(self, width: int, height: int, end: int, numbers: Iterator[int]) -> None:
        """`end`: the samples of the whole render. `numbers` name the leases; none comes twice."""
        self._width, self._height, self.end = width, height, end
        self._blocks: dict[int, _Block] = {}  # by their first sample
        self._numbers = numbers
        self.outstanding: dict[int, Outstanding] = {}
        self.current: _Block | None = None

    def begin(self, first: int) -> Iterator[tuple[Band, np.ndarray]]:
        """Make the block that begins at `first` the current one; the results of it that have come already."""
        self.current = block = self._block(first)
        parked, block.parked = block.parked, []
        return iter(parked)

    def finished(self) -> None:
        """The current block was merged: forget it."""
        assert self.current is not None
        self._blocks.pop(self.current.first, None)
        self.current = None

    @property
    def untouched(self) -> bool:
        """True if nobody but the home has anything of the current block."""
        assert self.current is not None
        return self.current.free_rows == self._height

    @property
    def complete(self) -> bool:
        """True if all rows of the current block are done."""
        return self.current is not None and self.current.done == self._height

    def window(self) -> int:
        """Take the free rows at the top of the current block for the home, which will trace them at one time; how
        many these are."""
        assert self.current is not None
        if not self.current.free or self.current.free[0][0] != 0:
            return 0
        return self.current.free.pop(0)[1]

    def take(self, pixel_s: float, renderers: int) -> Band | None:
        """The next band for the home: from the top of the current block. None where none is free."""
        block = self.current
        if block is None or not block.free:
            return None
        top, end = block.free[0]
        rows = min(end - top, self._rows(block, pixel_s, renderers))
        block.free[0] = top + rows, end
        if top + rows == end:
            block.free.pop(0)
        return Band(block.first, block.end - block.first, top, rows)

    def did(self, rows: int) -> None:
        """So many more rows of the current block are done: the home has traced them, or written a result."""
        assert self.current is not None
        self.current.done += rows

    @property
    def available(self) -> bool:
        """True if a band of the current block is free."""
        return self.current is not None and bool(self.current.free)

    def lease(
        self, assistant: int, since: int, pixel_s: float, renderers: int, now: float
    ) -> tuple[int, Band] | None:
        """Number and band of the next lease: of the first block from sample `since` on that has free rows, from its
        bottom. None where the render has no more, or where enough was traced ahead."""
        for block in self._ahead(since):
            if not block.free:
                continue
            top, end = block.free[-1]
            rows = min(end - top, self._rows(block, pixel_s, renderers))
            band = Band(block.first, block.end - block.first, end - rows, rows)
            if block is not self.current and self._ahead_bytes + self._bytes(rows) > AHEAD_BYTES:
                return None
            block.free[-1] = top, end - rows
            if top == end - rows:
                block.free.pop()
            number = next(self._numbers)
            self.outstanding[number] = Outstanding(assistant, band, now)
            return number, band
        return None

    def delivered(self, number: int, values: np.ndarray) -> tuple[Band, np.ndarray] | None:
        """A result to be written into the current block; None where it is kept for a later one, or where nobody
        waits for that lease any more."""
        lease = self.outstanding.pop(number, None)
        if lease is None:
            return None
        block = self._blocks[lease.band.first]
        if block is self.current:
            return lease.band, values
        block.done += lease.band.rows
        block.parked.append((lease.band, values))
        return None

    def resume(self, band: Band, values: np.ndarray) -> None:
        """Take a result that was saved, if it fits: all its rows are free, and it goes to the end of its block."""
        block = self._block(band.first) if band.first < self.end else None
        if block is None or band.first + band.count != block.end:
            return
        for number, (top, end) in enumerate(block.free):
            if top <= band.top and band.top + band.rows <= end:
                rest = [(top, band.top), (band.top + band.rows, end)]
                block.free[number : number + 1] = [each for each in rest if each[0] < each[1]]
                block.done += band.rows
                block.parked.append((band, values))
                return

    @property
    def parked(self) -> list[tuple[Band, np.ndarray]]:
        """All results of blocks whose turn has not come."""
        return [each for block in self._blocks.values() for each in block.parked]

    def lost(self, assistant: int) -> None:
        """That assistant will not answer: its leases are free again."""
        for number, lease in list(self.outstanding.items()):
            if lease.assistant == assistant:
                self.take_back(number)

    def take_back(self, number: int) -> None:
        """That lease is free again; its result is dropped should it come."""
        band = self.outstanding.pop(number).band
        free = self._blocks[band.first].free
        free.append((band.top, band.top + band.rows))
        free.sort()
        joined: list[tuple[int, int]] = []
        for top, end in free:
            if joined and joined[-1][1] == top:
                joined[-1] = joined[-1][0], end
            else:
                joined.append((top, end))
        free[:] = joined

    def count(self, assistant: int) -> int:
        """How many leases that assistant has."""
        return sum(lease.assistant == assistant for lease in self.outstanding.values())

    @property
    def oldest(self) -> tuple[int, Outstanding] | None:
        """The oldest lease of the current block, with its number."""
        first = -1 if self.current is None else self.current.first
        mine = [(number, lease) for number, lease in self.outstanding.items() if lease.band.first == first]
        return min(mine, key=lambda each: each[1].since, default=None)

    def _block(self, first: int) -> _Block:
        if first not in self._blocks:
            end = min(border_after(first), self.end)
            self._blocks[first] = _Block(first, end, [(0, self._height)])
        return self._blocks[first]

    def _ahead(self, since: int) -> Iterator[_Block]:
        first = since
        while first < self.end:
            block = self._block(first)
            yield block
            first = block.end

    def _rows(self, block: _Block, pixel_s: float, renderers: int) -> int:
        """Rows of the next band of a block: a share of what is free there, so that all end at about the same time
        [guided self-scheduling, Polychronopoulos & Kuck 1987], but neither too much nor too little work."""
        row_s = pixel_s * self._width * (block.end - block.first)
        rows = max(block.free_rows / (2 * renderers), LEAST_S / row_s)
        rows = min(rows, LEASE_S / row_s, MOST_BYTES / self._bytes(1))
        return max(int(rows) // ALIGNED * ALIGNED, min(ALIGNED, max(1, MOST_BYTES // self._bytes(1))))

    def _bytes(self, rows: int) -> int:
        return PIXEL_BYTES * self._width * rows

    @property
    def _ahead_bytes(self) -> int:
        rows = sum(self._height - block.free_rows for block in self._blocks.values() if block is not self.current)
        return self._bytes(rows)
