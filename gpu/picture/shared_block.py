"""A block of a picture's samples that several renderers trace, band by band."""

from __future__ import annotations

import numpy as np

from gpu import context as contexts
from gpu.layout.pixel_layers import ACCUMULATORS
from gpu.picture import blocks
from gpu.picture.accumulators import Accumulators
from gpu.picture.bands import BandTracer, Sharing
from gpu.picture.blocks import Band
from gpu.picture.dispatcher import Dispatcher
from gpu.picture.passes import Passes


class SharedBlock:
    """The block under way of one picture, `Picture.block`. A picture with samples shares it: some rows are its own,
    and bands of the others are traced here or written. A picture without samples traces bands for another one."""

    def __init__(self, dispatcher: Dispatcher, sums: Accumulators, passes: Passes) -> None:
        """The picture's own parts; a band is traced into the block's accumulators."""
        self._dispatcher, self._sums, self._passes = dispatcher, sums, passes
        self._sharing: Sharing | None = None
        self._band: BandTracer | None = None  # traced last by `trace_band`

    def reset(self) -> None:
        """Forget the block and the band: the picture begins again, or is restored."""
        self._sharing = self._band = None

    @property
    def shared(self) -> bool:
        """True if the block's samples are traced here and elsewhere."""
        return self._sharing is not None

    @property
    def own_done(self) -> bool:
        """True if this picture's rows of the shared block are complete."""
        return self._sharing is None or self._sharing.own_done

    def allocate(self) -> None:
        """Allocate the memory of the block under way if it is not, so that `share` needs none. Raises OutOfMemory."""
        contexts.use(self._dispatcher.context)
        self._sums.allocate_block()

    def share(self, rows: int, end: int) -> None:
        """Have `Picture.trace` add the samples up to `end` to rows [0, rows) only; the others come by `write_band`
        and `trace_band`. Until `complete`, `Picture.samples` stays, and nothing of the block is seen, read or saved.

        Raises ValueError where a pass is under way, and but for the beginning of a block; OutOfMemory.
        """
        contexts.use(self._dispatcher.context)
        settings, samples = self._dispatcher.settings, self._passes.samples
        begins = samples == blocks.FIRST or (samples >= blocks.SIZE and samples % blocks.SIZE == 0)
        if settings.adaptive or not begins or self._sums.open or self._passes.under_way[0] or self.shared:
            raise ValueError(f"no block begins at {samples} samples")
        if not samples < end <= blocks.border_after(samples) or not 0 <= rows <= settings.height:
            raise ValueError(f"{rows} rows up to {end} samples are no part of the block at {samples}")
        self._sums.empty_block()
        self._sharing, self._band = Sharing(samples, end, rows), None

    def trace_own(self, budget_s: float) -> float:
        """Trace the picture's own rows of the shared block for about `budget_s` seconds. Returns the seconds that it
        took."""
        tracer = None if self._sharing is None else self._sharing.tracer
        return 0.0 if tracer is None else self._passes.trace_band(tracer, budget_s)

    def complete(self) -> None:
        """Take the shared block as the picture's: all rows have their samples. `Picture.trace` then traces the noise
        meter's samples and merges the block, and then `Picture.samples` is its end. Raises ValueError where rows of
        its own lack samples."""
        sharing = self._sharing
        if sharing is None or not sharing.own_done:
            raise ValueError("no block is shared, or its own rows lack samples")
        contexts.use(self._dispatcher.context)
        self.reset()
        self._sums.open = True
        self._passes.complete(sharing.end)

    def unshare(self) -> None:
        """Drop the shared block, if there is one: the picture is as it was before `share`."""
        if self.shared:
            self.reset()
            self._sums.close()

    def trace_band(self, band: Band, budget_s: float) -> bool:
        """Trace a band for about `budget_s` seconds, from zero unless it is that of the last call; whether all of it
        is there. A picture without samples takes any band, one that shares its block only what is not its own of
        that.

        Raises ValueError for another one; OutOfMemory.
        """
        contexts.use(self._dispatcher.context)
        self._check(band)
        if self._band is None or self._band.band != band:
            self._sums.allocate_block()
            self._sums.clear_rows(band.top, band.rows)
            self._band = BandTracer(band)
        self._passes.trace_band(self._band, budget_s)
        return self._band.complete

    def read_band(self, band: Band) -> np.ndarray:
        """The accumulators of a complete band: (rows, width, 4 * accumulators) float32. They are the sum, the
        compensation, and the moments, whose last number is the count of the samples. Raises ValueError where the
        band is not complete."""
        contexts.use(self._dispatcher.context)
        if self._band is None or self._band.band != band or not self._band.complete:
            raise ValueError(f"{band} is not complete")
        return self._sums.read_rows(band.top, band.rows)

    def write_band(self, band: Band, values: np.ndarray) -> None:
        """Write a band that another picture's `read_band` returned. Raises ValueError for a band that is not of the
        shared block, and for values of another shape."""
        contexts.use(self._dispatcher.context)
        if self._sharing is None:
            raise ValueError("no block is shared")
        self._check(band)
        if values.shape != (band.rows, self._dispatcher.settings.width, 4 * len(ACCUMULATORS)):
            raise ValueError(f"values of shape {values.shape} are not those of {band}")
        traced = None if self._band is None else self._band.band
        if traced is not None and traced.top < band.top + band.rows and band.top < traced.top + traced.rows:
            self._band = None
        self._sums.write_rows(band.top, values)

    def _check(self, band: Band) -> None:
        settings = self._dispatcher.settings
        if settings.adaptive or band.top + band.rows > settings.height:
            raise ValueError(f"{band} is no part of this picture")
        if self._sharing is not None:
            self._sharing.check(band)
        elif self._passes.samples or self._passes.under_way[0]:
            raise ValueError("a picture with samples traces bands only of a block that it shares")

    def take_counts(self) -> tuple[int, int]:
        """The numbers in `Picture.warnings` since the last call, of bands that were traced for others; they begin at
        zero again."""
        contexts.use(self._dispatcher.context)
        counts, self._dispatcher.counts = self._dispatcher.counts, (0, 0)
        return counts

    def add_counts(self, counts: tuple[int, int]) -> None:
        """Add to the numbers in `Picture.warnings` what `take_counts` returned elsewhere."""
        if any(counts):
            contexts.use(self._dispatcher.context)
            ended, cut = self._dispatcher.counts
            self._dispatcher.counts = ended + counts[0], cut + counts[1]
