"""The home of a divided picture: gives out leases, traces its own bands, and merges blocks in ascending order."""

from __future__ import annotations

import itertools
import random
import secrets
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from gpu import border_after
from service.ipc.leases import Lease, LeaseDone, LeaseRefuted
from service.ipc.messages import FromRenderer
from service.worker.division.ledger import Ledger
from service.worker.payloads import Result

if TYPE_CHECKING:
    import numpy as np

    from gpu import Band, Picture

EACH = 2  # leases that an assistant has at a time: the next one lies there when the first is done
# With nothing else to do the home waits for a lease so many times as long as tracing that band here would take, and
# so many seconds at least; then it traces it itself. An assistant may have other clients, or a slow link.
OVERDUE_TIMES, OVERDUE_S = 6, 0.5
MOST_SAVED = 500  # bands with a checkpoint, whose first line names them
WORTH_SAVING_S = 4.0  # of a block: as long as between two checkpoints
GUESS_S = 2e-7  # a sample of a pixel, before any was measured
# The share of the results that are traced here as well, and compared: memory that loses bits says nothing of it. A
# render of some thousand leases finds it out for a five-hundredth of its time.
CHECKED = 1 / 500


class _Check(NamedTuple):
    """A result of an assistant that is to be traced here, too."""

    assistant: int
    band: Band
    values: np.ndarray


class Home:
    """The division of one task's picture. While nobody assists, the picture is traced as if it were not divided."""

    def __init__(self, number: int, send: Callable[[FromRenderer], None]) -> None:
        self._number, self._send = number, send
        self._assistants: tuple[int, ...] = ()
        self._paused = False
        # Of a lost home's leases, results may still be under way: their numbers must mean nothing here.
        self._numbers = itertools.count(secrets.randbits(60))
        self.restart()

    def restart(self) -> None:
        """Forget everything that was leased: the picture is another one, or none."""
        self._picture: Picture | None = None
        self._ledger: Ledger | None = None
        self._generation = 0
        self._pixel_s = GUESS_S
        self._since = 0  # the first sample that may be leased now
        self._window = 0  # rows at the top of the current block that are traced here at one time
        self._band: Band | None = None  # that is traced here
        self._checks: list[_Check] = []  # of the current block, to be traced here
        self._check: _Check | None = None  # that `_band` is for
        self._done: list[Result] = []  # bands of the current block
        self._resumed: list[Result] = []  # that were saved, for when the ledger is made
        self._began = 0.0  # when the current block was begun to be shared
        self._foreign = 0  # samples of pixels in the current block, or the one that is merged, from elsewhere

    def assist(self, ids: tuple[int, ...]) -> None:
        """These renderers assist from now on; the leases of others are free again."""
        for lost in set(self._assistants) - set(ids):
            if self._ledger is not None:
                self._ledger.lost(lost)
        self._assistants = ids
        self._give()

    def pause(self, paused: bool) -> None:
        """Give no leases while the task is paused."""
        self._paused = paused
        self._give()

    @property
    def waiting(self) -> bool:
        """True if nothing can be traced here before a lease comes back."""
        ledger = self._ledger
        if ledger is None or not self.sharing:
            return False
        busy = self._window or self._band is not None or self._checks or ledger.complete
        return not busy and not ledger.available and self.left_s > 0.0

    @property
    def left_s(self) -> float:
        """Seconds until the home no longer waits for the oldest lease of the current block."""
        oldest = None if self._ledger is None else self._ledger.oldest
        if oldest is None or self._picture is None:
            return 0.0
        lease = oldest[1]
        here_s = self._pixel_s * lease.band.rows * lease.band.count * self._picture.settings.width
        return max(0.0, lease.since + max(OVERDUE_S, OVERDUE_TIMES * here_s) - time.monotonic())

    def cap(self, picture: Picture, end: int, generation: int, since: int, progressive: bool) -> int:
        """How many samples to aim at where the block under way is not shared: no more than the next border, where one
        may be. To be asked before each slice, of a render that ends at `end` samples.

        `since`: the first sample that may be shared. `progressive`: a person looks on, so that a block of which
        nobody else has anything is traced here. Raises OutOfMemory, and can be called again.
        """
        if picture.block.shared:
            current = None if self._ledger is None else self._ledger.current
            if current is not None and current.end <= end:
                return end
            picture.block.unshare()  # the render ends earlier now
            self.restart()
        if picture is not self._picture or generation != self._generation:
            self.resume(self._resumed)
        if not self._assistants and self._ledger is None and not self._resumed:
            return end
        if self._ledger is None or self._ledger.end != end:
            self._ledger = Ledger(picture.settings.width, picture.settings.height, end, self._numbers)
            for band, values in self._resumed:
                self._ledger.resume(band, values)
            self._resumed = []
        self._picture, self._generation = picture, generation
        self._pixel_s = picture.cost_s or GUESS_S
        border = border_after(picture.samples)
        begins = border_after(picture.samples - 1) == picture.samples and not picture.under_way[0]
        self._since = max(since, picture.samples if begins else border)
        if begins and max(since, border_after(0)) <= picture.samples < end:
            self._begin(picture, min(border, end), progressive)
        self._give()
        return min(border, end)

    def _begin(self, picture: Picture, end: int, progressive: bool) -> None:
        ledger = self._ledger
        assert ledger is not None
        picture.block.allocate()  # before anything is taken from the ledger: the caller may try again
        parked = list(ledger.begin(picture.samples))
        if ledger.untouched and (progressive or not self._assistants):
            ledger.finished()
            self._since = end
            return
        self._window = ledger.window() if progressive else 0
        picture.block.share(self._window, end)
        self._done, self._began, self._foreign = [], time.monotonic(), 0
        for band, values in parked:
            self._write(picture, band, values)

    def trace(self, budget_s: float) -> None:
        """Do a slice of the block that is shared."""
        picture, ledger = self._picture, self._ledger
        assert picture is not None and ledger is not None and ledger.current is not None
        self._give()
        if self._window:
            picture.trace(budget_s, ledger.current.end)
            if picture.block.own_done:
                ledger.did(self._window)
                self._window = 0
        elif ledger.complete:
            picture.block.complete()
            self._since, self._done = ledger.current.end, []
            ledger.finished()
        else:
            self._trace_band(picture, ledger, budget_s)

    def _trace_band(self, picture: Picture, ledger: Ledger, budget_s: float) -> None:
        if self._band is None and self._checks:
            self._check = self._checks.pop(0)
            self._band = self._check.band
        if self._band is None:
            if not ledger.available and self.left_s == 0.0 and ledger.oldest is not None:
                ledger.take_back(ledger.oldest[0])
            self._band = ledger.take(self._pixel_s, 1 + len(self._assistants))
        if self._band is not None and picture.block.trace_band(self._band, budget_s):
            values, check = picture.block.read_band(self._band), self._check
            ledger.did(self._band.rows)
            self._done.append((self._band, values))
            self._band = self._check = None
            if check is not None and values.tobytes() != check.values.tobytes():
                self._refute(picture, check.assistant)

    def _refute(self, picture: Picture, assistant: int) -> None:
        """Report an assistant whose bits are wrong, and drop all that is not merged yet: more may be."""
        self._send(LeaseRefuted(self._number, self._generation, assistant))
        self._assistants = tuple(each for each in self._assistants if each != assistant)
        picture.block.unshare()
        self.restart()

    def heard(self, done: LeaseDone) -> None:
        """Take a result; one that nobody waits for any more is dropped."""
        picture, ledger = self._picture, self._ledger
        if picture is None or ledger is None or done.generation != self._generation:
            return
        lease = ledger.outstanding.get(done.number)
        current = ledger.delivered(done.number, done.values)
        if lease is not None and current is not None and random.random() < CHECKED:
            self._checks.append(_Check(lease.assistant, *current))  # it brings paths to count as well
        elif lease is not None:
            picture.block.add_counts(done.counts)
            if current is not None:
                self._write(picture, *current)
                ledger.did(current[0].rows)
        self._give()

    def _write(self, picture: Picture, band: Band, values: np.ndarray) -> None:
        picture.block.write_band(band, values)
        self._done.append((band, values))
        self._foreign += band.rows * band.count * picture.settings.width

    def take_foreign(self) -> int:
        """The samples of pixels that were traced elsewhere, of the block that was just merged."""
        foreign, self._foreign = self._foreign, 0
        return foreign

    def bands(self) -> list[Result]:
        """Finished bands of blocks that are not merged yet, for a checkpoint; none where the block under way has not
        taken long, and little would be lost with it."""
        if self._ledger is None or not self.sharing or time.monotonic() - self._began < WORTH_SAVING_S:
            return []
        return [*self._done, *self._ledger.parked][:MOST_SAVED]

    def resume(self, bands: list[Result]) -> None:
        """Go on with what was saved; the picture has just been restored."""
        self.restart()
        self._resumed = bands

    @property
    def sharing(self) -> bool:
        """True if the block under way is shared."""
        return self._picture is not None and self._picture.block.shared

    def _give(self) -> None:
        """Lease what is free to assistants with less than EACH leases, in turn."""
        ledger = self._ledger
        if ledger is None or self._paused:
            return
        for _ in range(EACH):
            for assistant in self._assistants:
                if ledger.count(assistant) >= EACH:
                    continue
                renderers, now = 1 + len(self._assistants), time.monotonic()
                given = ledger.lease(assistant, self._since, self._pixel_s, renderers, now)
                if given is None:
                    return
                number, band = given
                place = band.first, band.count, band.top, band.rows
                self._send(Lease(self._number, self._generation, number, assistant, *place))
