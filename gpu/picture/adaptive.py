"""A picture with a sample plan: the areas of a pass, their slices, and the plan's buffers on the device."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout import PLAN_AREA as AREA
from gpu.layout import PLAN_CLASSES as CLASSES
from gpu.layout.bindings import Slot
from gpu.picture.sample_plan import DECISIONS, WORDS, SamplePlan, pixels_of, weights_of
from gpu.picture.schedule import Dispatch, Tile, mean_rate, resampled, work_groups
from gpu.picture.tiles import GUESS_S, SLICE_S, USUAL_BOUNCES, usual_pass

_MOST_AREAS = 1 << 14  # of a dispatch


class Adaptive:
    """The schedule of a picture with a sample plan. Its rows are areas, listed for the pass under way; an area that
    gets more samples than an invocation may take is listed several times, in rounds."""

    def __init__(
        self, context: Any, kernels: KernelCache, size: tuple[int, int], most: int, max_bounces: int
    ) -> None:
        self._context, self._kernels, self._picture, self._most = context, kernels, size, most
        self.max_bounces = max_bounces
        self._caution = max(1.0, max_bounces / USUAL_BOUNCES)
        self.rounds = self.chunk = 1  # of the pass under way: visits of an area at most; samples of an invocation
        self.stops: tuple[int, ...] = DECISIONS
        self._pixels = pixels_of(*size)
        self.rates = np.zeros(len(self._pixels))  # by row of areas
        self._areas, self._amounts = np.zeros(0, np.int64), np.zeros(0)  # listed; samples that each gets
        self._turns = np.zeros(1, np.int64)  # the end of each round in the list
        self._plan: SamplePlan | None = SamplePlan(self._pixels)
        count = self._pixels.shape[0] * self._pixels.shape[1]
        self._words = contexts.allocate(context, WORDS.itemsize * count)
        self._counts = contexts.allocate(context, 4 * CLASSES * count)
        self._work = contexts.allocate(context, 4 * _MOST_AREAS)

    @property
    def cost_s(self) -> float:
        return mean_rate(self.rates)

    def expect(self, rates: np.ndarray) -> None:
        self.rates = resampled(rates, len(self.rates))

    @property
    def size(self) -> tuple[int, int]:
        return 1, len(self._areas)

    @property
    def buffers(self) -> tuple[Any, ...]:
        return (self._words,)

    def resume(self, row: int, column: int) -> tuple[int, int]:
        """Begin the pass again; pixels that have their samples already get no more."""
        return 0, 0

    def forget(self) -> None:
        self._plan = None

    def _read_plan(self) -> SamplePlan:
        if self._plan is None:
            words = np.frombuffer(self._words.read(), WORDS).reshape(self._pixels.shape[:2])
            decided = bool((words["weights"] > 0).all())
            self._plan = (
                SamplePlan(self._pixels, words["counts"], words["weights"]) if decided else SamplePlan(self._pixels)
            )
        return self._plan

    def decide(self, samples: int, main: dict[Slot, Any]) -> None:
        """At a stop, make a new plan from the picture's second moments."""
        if samples not in self.stops:
            return
        variances, counts = self._seen(main[Slot.MOMENTS])
        words = np.zeros(self._pixels.shape[:2], WORDS)
        words["counts"], words["weights"] = counts, weights_of(variances, self._pixels)
        self._words.write(words.tobytes())
        self._plan = SamplePlan(self._pixels, words["counts"], words["weights"])

    def _seen(self, moments: Any) -> tuple[np.ndarray, np.ndarray]:
        """(rows, columns, CLASSES) of areas: the variance of a sample, summed over the pixels, and their samples."""
        width, height = self._picture
        kernel = self._kernels.get("areas.comp", features.defines(frozenset()))
        rows_at_once = max(AREA, self._most // width // AREA * AREA)
        parts = []
        for first in range(0, height, rows_at_once):
            rows = min(rows_at_once, height - first)
            lines, columns = -(-rows // AREA), self._pixels.shape[1]
            output = contexts.allocate(self._context, 8 * CLASSES * columns * lines)
            moments.bind_to_storage_buffer(int(Slot.MOMENTS), offset=16 * width * first, size=16 * width * rows)
            output.bind_to_storage_buffer(int(Slot.OUTPUT))
            kernel["size"].value = (width, rows)
            contexts.dispatch(self._context, kernel, *work_groups(columns, lines))
            parts.append(np.frombuffer(output.read(), np.float32).reshape(lines, columns, 2, CLASSES))
            output.release()
        seen = np.concatenate(parts)
        return seen[:, :, 0].astype(float), seen[:, :, 1].astype(np.uint32)

    def begin(self, before: int, after: int, most: int) -> None:
        """List the areas of a pass from `before` mean samples to `after`; an invocation takes at most `most`."""
        plan = self._read_plan()
        wanted = plan.at(after)
        self._counts.write(wanted.tobytes())
        # A plan that was just made anew may start some pixels at samples that they do not have.
        had = plan.counts if before in DECISIONS else plan.at(before)
        left = (wanted - had).astype(np.int64).max(axis=2).ravel()
        fits = SLICE_S / (self.rates.max() * AREA * AREA) if self.cost_s else 1
        self.chunk = max(1, min(most, int(fits)))
        self.rounds = max(1, -(-int(left.max()) // self.chunk))
        turns = [np.flatnonzero(left > turn * self.chunk) for turn in range(self.rounds)]
        self._areas = np.concatenate(turns)
        self._amounts = np.concatenate(
            [np.minimum(left[a] - k * self.chunk, self.chunk) for k, a in enumerate(turns)]
        )
        self._turns = np.cumsum([len(a) for a in turns])

    def tile(self, row: int, column: int, samples: int) -> Tile:
        """As many areas from `row` on as fit into a slice, of one round, and of rows that can be bound at once."""
        width, columns = self._picture[0], self._pixels.shape[1]
        end = int(self._turns[np.searchsorted(self._turns, row, side="right")])
        end = min(end, row + _MOST_AREAS)
        lines = self._areas[row:end] // columns
        rates = np.where(
            self.rates[lines] > 0, self.rates[lines], (self.cost_s or GUESS_S * self._caution) * self._caution
        )
        seconds = np.cumsum(self._amounts[row:end] * rates * AREA * AREA)
        fitting = np.searchsorted(seconds, SLICE_S, side="right")
        bound = np.searchsorted(lines, lines[0] + max(1, self._most // (width * AREA)))
        return 0, row, 1, max(1, int(min(fitting, bound)))

    def took(self, tile: Tile, samples: int, seconds: float) -> None:
        """Record what a tile has cost: a rise counts at once, a fall little by little, as in `Tiles`."""
        listed = slice(tile[1], tile[1] + tile[3])
        rate = seconds / (AREA * AREA * self._amounts[listed].sum())
        lines = np.unique(self._areas[listed] // self._pixels.shape[1])
        old = self.rates[lines]
        self.rates[lines] = np.where(old == 0, rate, np.maximum(rate, 0.7 * old + 0.3 * rate))

    def pass_samples(self, samples: int, sharers: int) -> int:
        """The mean number of samples that a pixel gets in the next pass, where `sharers` pictures take turns."""
        if samples == 0 or self.cost_s == 0:
            return 1
        return max(1, usual_pass(self._picture, self.cost_s, samples, sharers))

    def bind(self) -> None:
        self._counts.bind_to_storage_buffer(int(Slot.SAMPLE_PLAN))
        self._work.bind_to_storage_buffer(int(Slot.PLANNED_AREAS))

    def dispatch(self, tile: Tile) -> Dispatch:
        """A dispatch of one group for each area listed in the tile; each pixel continues after its last sample."""
        self.bind()
        y, x = np.divmod(self._areas[tile[1] : tile[1] + tile[3]], self._pixels.shape[1])
        self._work.write((x | y << 16).astype(np.uint32).tobytes())
        (width, height), top = self._picture, AREA * int(y[0])
        part = 0, top, width, min(height, AREA * (int(y[-1]) + 1)) - top
        return Dispatch(part, tile[:2], (tile[3], 1), 0, self.chunk, (tile[3], 1))

    def meter_rounds(self, since: int) -> int:
        return self.rounds

    def meter_samples(self, since: int, turn: int) -> tuple[int, int]:
        return 0, self.chunk

    def release(self) -> None:
        for buffer in (self._words, self._counts, self._work):
            buffer.release()
