"""How a pass over a picture is cut into tiles: by the cost of each band of rows, so that all take about the same
time.

Runs without GL.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu.layout import WORK_GROUP
from gpu.layout.bindings import Slot
from gpu.picture.schedule import Dispatch, Tile, resampled, work_groups

# Seconds of a dispatch: short enough to turn to another client, long beside the time in which one of the driver's
# threads waits for another. With 8 ms a sample takes llvmpipe 1.1 to 1.2 times as long, with 30 ms as long as now.
SLICE_S = 0.015
PASS_S = 0.2  # seconds of a pass, once there are some samples
# The least samples of a pass once the picture has twice as many: beginning and ending an invocation, which loads and
# stores 48 bytes of sums, costs llvmpipe a third of a sample of a simple scene.
LEAST_A_PASS = 4
# Seconds within which every picture on a shared device shall complete a pass: passes get shorter for it, down to one
# sample. A picture that is alone always gets LEAST_A_PASS.
ROUND_S = 2.0
MAX_SAMPLES_A_PASS = 256
METER_ROUND = 8  # most samples of an invocation for the noise meter, whose few pixels then fill a slice
LOOP_TURNS = 65_535  # turns of all loops of an invocation together, after which llvmpipe ends them
BAND = 16  # rows
# Pixels of a GPU's smallest tile, and the slices that its largest one may take: a dispatch has a floor, the time of
# its longest paths, that no smaller tile lowers. An H200 is full with 16 to 64 Ki pixels.
GPU_FLOOR = 1 << 14
GPU_MOST = 1.5
_LEAST = WORK_GROUP  # columns of a tile
_LONG_BAND, _LONG_LEAST = 4, 16  # rows and columns where paths may be so long that 128 pixels take 0.1 s
GUESS_S = 2e-7  # seconds of a sample of a pixel, before any is measured
_LARGE = 64 * 64  # pixels of a tile whose cost a pixel is that of larger tiles
USUAL_BOUNCES = 16  # above this, later paths may be max_bounces / 16 times as long as measured ones


class Tiles:
    """Tiles of `width` x `height` pixels in order. No more than `most` pixels lie between a tile's first and last."""

    def __init__(
        self, width: int, height: int, most: int, max_bounces: int = 0, most_samples: int = MAX_SAMPLES_A_PASS,
        floor: int = 0,
    ) -> None:  # fmt: skip
        """A tile of fewer than `floor` pixels takes no less time than one of so many."""
        self.size, self.max_bounces = (width, height), max_bounces
        self._most_samples, self._floor = most_samples, floor
        self._caution = max(1.0, max_bounces / USUAL_BOUNCES)
        band, self._least = (BAND, _LEAST) if self._caution < 4 else (_LONG_BAND, _LONG_LEAST)
        self._band = band if band * width <= most else max(1, most // width)
        self._most = most
        self._most_rows = max(self._band, most // width // self._band * self._band)
        self._most_columns = max(_LEAST, (most - (self._band - 1) * width) // _LEAST * _LEAST)
        self.rates = np.zeros(-(-height // self._band))  # by band
        self._known, self._known_s = 0, 0.0  # the number of known rates, and their sum
        self.stops: tuple[int, ...] = ()
        self._before, self.chunk = 0, 1  # the first sample of the pass under way, and how many it takes

    @property
    def cost_s(self) -> float:
        return self._known_s / self._known if self._known else 0.0

    def expect(self, rates: np.ndarray) -> None:
        self.rates = resampled(rates, len(self.rates))
        self._known, self._known_s = int(np.count_nonzero(self.rates)), float(self.rates.sum())

    def tile(self, row: int, column: int, samples: int) -> Tile:
        """The tile that begins there: several whole bands where they fit into a slice, else part of one."""
        if self._floor and column == 0 and self._band * self.size[0] <= self._most:
            return self._large_tile(row, samples)
        width, height = self.size
        first = row // self._band
        guess = (self.cost_s or GUESS_S * self._caution) * self._caution
        pixels = SLICE_S / samples / (self.rates[first] or guess)
        rows = min(self._band, height - row)
        if column == 0 and pixels >= self._band * width:
            left = SLICE_S / samples / (self._band * width) - self.rates[first]
            for rate in self.rates[first + 1 :]:
                left -= rate or guess
                if left < 0 or rows + self._band > self._most_rows:
                    break
                rows += self._band
            return 0, row, width, min(rows, height - row)
        columns = max(int(min(pixels / self._band, width)) // _LEAST * _LEAST, self._least)
        return column, row, min(columns, self._most_columns, width - column), rows

    def _large_tile(self, row: int, samples: int) -> Tile:
        """A tile of the rows from there on: all of them where they fit into a slice, else an equal share of their
        cost."""
        width, height = self.size
        bands = self.rates[row // self._band :]
        costs = np.where(bands > 0, bands, self.cost_s or GUESS_S * self._caution) * (self._band * width * samples)
        parts = max(1, int(np.ceil(costs.sum() * (self._caution if self.cost_s == 0 else 1) / (GPU_MOST * SLICE_S))))
        count = int(np.searchsorted(np.cumsum(costs), costs.sum() / parts * (1 - 1e-6))) + 1
        least = -(-self._floor // (self._band * width))
        rows = min(max(count, least) * self._band, self._most_rows)
        return 0, row, width, min(rows, height - row)

    def pixels_before(self, row: int, column: int) -> int:
        """The pixels of all tiles before the one that begins there."""
        width, height = self.size
        return row * width + column * min(self._band, height - row)

    def took(self, tile: Tile, samples: int, seconds: float) -> None:
        """Record a tile's cost: a rise counts at once, a fall little by little."""
        _, y, width, height = tile
        rate = seconds / (width * height * samples)
        bands = self.rates[y // self._band : -(-(y + height) // self._band)]
        now = np.where(bands == 0, rate, np.maximum(rate, 0.7 * bands + 0.3 * rate))
        self._known += int(np.count_nonzero(bands == 0))
        self._known_s += float((now - bands).sum())
        bands[:] = now

    def pass_samples(self, samples: int, sharers: int = 1) -> int:
        """The samples of every pixel to take in the pass after `samples`, so that the smallest tile fits a slice."""
        if samples == 0 or self.cost_s == 0:
            return 1
        if self._floor:  # as many as a slice has time for in all pixels at once: few samples of many pixels
            fits = int(GPU_MOST * SLICE_S / (self.cost_s * self.size[0] * self.size[1]))
            return max(1, min(samples, fits, self._most_samples))
        fits = int(SLICE_S / (self.rates.max() * self._least * self._band))
        return max(1, min(fits, usual_pass(self.size, self.cost_s, samples, sharers), self._most_samples))

    def band_samples(self) -> int:
        """Samples of a pass over a band, which is shown only when it is complete: as many as a slice has time for in
        a large tile, as small ones cost more."""
        if self.cost_s == 0:
            return 1
        fits = int(SLICE_S / (self.rates.max() * self._least * self._band))
        usual = max(LEAST_A_PASS, int(SLICE_S / (self.cost_s * _LARGE)))
        return max(1, min(fits, usual, self._most_samples))

    def begin(self, before: int, after: int, most: int) -> None:
        self._before, self.chunk = before, after - before

    def dispatch(self, tile: Tile) -> Dispatch:
        groups = work_groups(tile[2], tile[3])
        return Dispatch(tile, tile[:2], tile[2:], self._before, self.chunk, groups)

    def meter_rounds(self, since: int) -> int:
        first = self._meter_first(since)
        return -(-(self._before + self.chunk - first) // self._meter_round)

    def meter_samples(self, since: int, turn: int) -> tuple[int, int]:
        first = self._meter_first(since) + turn * self._meter_round
        return first, min(self._meter_round, self._before + self.chunk - first)

    def _meter_first(self, since: int) -> int:
        return self._before if self._before >= since else 0

    @property
    def _meter_round(self) -> int:
        return max(1, self.chunk) if self._floor else min(METER_ROUND, self._most_samples)

    def resume(self, row: int, column: int) -> tuple[int, int]:
        return row, column

    # `Tiles` has no plan, and no buffers.
    @property
    def buffers(self) -> tuple[Any, ...]:
        return ()

    def decide(self, samples: int, main: dict[Slot, Any]) -> None:
        pass

    def bind(self) -> None:
        pass

    def forget(self) -> None:
        pass

    def release(self) -> None:
        pass


def usual_pass(size: tuple[int, int], cost_s: float, samples: int, sharers: int = 1) -> int:
    """The samples of every pixel to take in the pass after `samples`, each at `cost_s` seconds: as many as take
    PASS_S or LEAST_A_PASS, but fewer at the beginning of a picture, so that it changes often, and where so many
    pictures (`sharers`) take turns that their passes would take more than ROUND_S together."""
    width, height = size
    sample_s, fair_s = cost_s * width * height, ROUND_S / sharers
    least = LEAST_A_PASS if sharers == 1 else max(1, min(LEAST_A_PASS, int(fair_s / sample_s)))
    return min(samples, max(int(min(PASS_S, fair_s) / sample_s), min(least, samples // 2)))


def samples_at_once(max_bounces: int, shapes: int, nodes: int) -> int:
    """The number of samples that an invocation may take on llvmpipe without coming near the end of its loops.

    Three rays a bounce, each past all shapes outside of the tree (`shapes`) and, in the tree, past 16 nodes for each
    doubling of `nodes`: several times the mean over a mesh of 80 000 triangles.
    """
    turns = 3 * (max_bounces + 1) * (4 + shapes + 16 * max(nodes, 1).bit_length())
    return max(1, min(MAX_SAMPLES_A_PASS, LOOP_TURNS // turns))
