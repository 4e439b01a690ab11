"""The protocol of schedules. `Tiles` gives every pixel the same number of samples; `Adaptive` follows a sample
plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from gpu.layout import WORK_GROUP
from gpu.layout.bindings import Slot

Tile = tuple[int, int, int, int]  # x, y, width, height
_MOST_SPREAD = 1 << 16  # groups: their number times the stride must fit into 32 bits


class Dispatch(NamedTuple):
    """One run of the path tracer's kernel."""

    part: Tile  # of the picture: the accumulators of these pixels are bound
    origin: tuple[int, int]  # of the invocations, in the picture or in a list of areas
    size: tuple[int, int]  # of the same
    first: int  # the first sample; 0 where each pixel continues after its last one
    samples: int  # of an invocation
    groups: tuple[int, int]


def work_groups(columns: int, rows: int) -> tuple[int, int]:
    """The work groups that cover `columns` x `rows` invocations."""
    return -(-columns // WORK_GROUP), -(-rows // WORK_GROUP)


def group_stride(groups: int) -> int:
    """A stride that visits each of `groups` work groups once, and spreads any stretch of visits over the tile.

    llvmpipe cuts a dispatch into as many stretches as it has threads and waits for the slowest; the upper half of a
    tile may be sky and the lower one a mesh. Steps of the golden section spread evenly for any number of threads.
    """
    if groups > _MOST_SPREAD:
        return 1
    stride = max(1, round(groups * (math.sqrt(5) - 1) / 2))
    while math.gcd(stride, groups) > 1:
        stride += 1
    return stride


def mean_rate(rates: np.ndarray) -> float:
    """The mean of the known rates; 0 if none is known."""
    known = rates[rates > 0]
    return float(known.mean()) if len(known) else 0.0


def resampled(rates: np.ndarray, count: int) -> np.ndarray:
    """Rates of another picture of the same scene, resampled to `count` parts of this one's height; all are known if
    any is."""
    filled = np.where(rates > 0, rates, mean_rate(rates))
    parts = (np.arange(count) + 0.5) * (len(filled) / count) - 0.5
    out: np.ndarray = np.interp(parts, np.arange(len(filled)), filled)
    return out


class Schedule(Protocol):
    """Cuts a pass into tiles of a grid, row by row; each tile is one dispatch."""

    stops: tuple[int, ...]  # numbers of samples at which a pass must end
    chunk: int  # samples that an invocation of the pass under way takes
    max_bounces: int
    rates: np.ndarray  # seconds per sample of a pixel, by equal parts of the picture's height; 0: unknown

    @property
    def cost_s(self) -> float:
        """Seconds per sample of a pixel, in the mean over the rows that were measured; 0: unknown."""

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the grid."""

    @property
    def buffers(self) -> Sequence[Any]:
        """The schedule's buffers in the picture's saved state."""

    def decide(self, samples: int, main: dict[Slot, Any]) -> None:
        """Plan by the accumulators, before the pass that begins at `samples`."""

    def pass_samples(self, samples: int, sharers: int) -> int:
        """The mean number of samples that a pixel gets in the pass that begins at `samples`, where `sharers` pictures
        take turns."""

    def begin(self, before: int, after: int, most: int) -> None:
        """Begin a pass from `before` samples to `after`; an invocation takes at most `most`."""

    def tile(self, row: int, column: int, samples: int) -> Tile:
        """The tile that begins there and takes about SLICE_S."""

    def expect(self, rates: np.ndarray) -> None:
        """Size the first tiles by the rates of another picture of about the same cost."""

    def took(self, tile: Tile, samples: int, seconds: float) -> None:
        """Record a tile's cost, by which the next ones are sized."""

    def bind(self) -> None:
        """Bind the buffers of the schedule that the kernel reads."""

    def dispatch(self, tile: Tile) -> Dispatch:
        """The dispatch for a tile; it binds the schedule's own buffers."""

    def meter_rounds(self, since: int) -> int:
        """The visits of the noise meter's pixels, which began at 0 and joined at `since`, in the pass under way."""

    def meter_samples(self, since: int, turn: int) -> tuple[int, int]:
        """First sample and number of samples for these pixels in one of the rounds."""

    def resume(self, row: int, column: int) -> tuple[int, int]:
        """The tile from which a saved pass goes on, after `buffers` were written."""

    def forget(self) -> None:
        """Forget the plan: `buffers` were written or cleared."""

    def release(self) -> None:
        """Release the device's memory."""
