"""Bands of a block of samples: how one is traced slice by slice, and how a block is shared among renderers.

Runs without GL.
"""

from __future__ import annotations

from gpu.picture.blocks import Band
from gpu.picture.schedule import Tile
from gpu.picture.tiles import Tiles


class BandTracer:
    """The progress of one band, whose pixels begin at zero: passes over its rows, cut into tiles."""

    def __init__(self, band: Band) -> None:
        self.band = band
        self._done = 0  # samples in whole passes
        self._samples = 0  # of the pass under way; 0: none
        self._row, self._column = band.top, 0

    @property
    def complete(self) -> bool:
        return self._done >= self.band.count

    def next(self, tiles: Tiles, most: int) -> tuple[Tile, int, int]:
        """The next tile, its first sample and number of samples, which is at most `most`."""
        band = self.band
        if self._samples == 0:
            self._samples = min(tiles.band_samples(), most, band.count - self._done)
        x, y, width, rows = tiles.tile(self._row, self._column, self._samples)
        return (x, y, width, min(rows, band.top + band.rows - y)), band.first + self._done, self._samples

    def took(self, tile: Tile, width: int) -> None:
        """Record that a tile of a picture of this width was traced."""
        self._column = tile[0] + tile[2]
        if self._column >= width:
            self._column, self._row = 0, self._row + tile[3]
        if self._row >= self.band.top + self.band.rows:
            self._row, self._done, self._samples = self.band.top, self._done + self._samples, 0


class Sharing:
    """A block of samples that several renderers trace: its first and its last sample, and the tracer of its rows
    [0, n), the picture's own, if there are any."""

    def __init__(self, first: int, end: int, rows: int) -> None:
        self.first, self.end, self.rows = first, end, rows
        self.tracer = BandTracer(Band(first, end - first, 0, rows)) if rows else None

    @property
    def own_done(self) -> bool:
        return self.tracer is None or self.tracer.complete

    def check(self, band: Band) -> None:
        """Raises ValueError for a band that is not of this block, or has the picture's own rows."""
        if (band.first, band.count) != (self.first, self.end - self.first):
            raise ValueError(f"{band} is not of the block under way, samples {self.first} to {self.end}")
        if band.top < self.rows:
            raise ValueError(f"{band} has rows of the first {self.rows}, which the picture traces itself")
