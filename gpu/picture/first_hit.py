"""AOVs of the first hit. They are traced when first read, apart from the picture, over the same camera rays."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.layout.bindings import Slot
from gpu.layout.pixel_layers import FIRST_HIT, VECTOR_BYTES
from gpu.picture.schedule import Tile
from gpu.picture.tiles import SLICE_S, Tiles
from gpu.settings import ID_AOVS

SAMPLES = 256  # samples that an AOV averages at most
_GUESS_S = SLICE_S / 1024  # seconds of a pixel's first hit in a picture that was restored and not traced since


class FirstHit:
    """Made for a picture of `size`, of which at most `most` pixels are bound at once. `allocate` takes its memory."""

    def __init__(self, context: Any, size: tuple[int, int], most: int) -> None:
        self._context, self._size, self._most = context, size, most
        self.buffers: dict[Slot, Any] = {}
        self._begin()

    def _begin(self) -> None:
        self.samples, self._row, self._column = 0, 0, 0
        self._tiles = Tiles(*self._size, self._most)

    @property
    def begun(self) -> bool:
        return (self.samples, self._row, self._column) > (0, 0, 0)

    def clear(self) -> None:
        for buffer in self.buffers.values():
            buffer.clear()
        self._begin()

    def allocate(self) -> None:
        width, height = self._size
        for slot in FIRST_HIT:
            self.buffers[slot] = contexts.allocate(self._context, VECTOR_BYTES * width * height)
            self.buffers[slot].clear()

    def limit(self, samples: int) -> None:
        """Start again if more than `samples` samples were traced."""
        if (self.samples, self._row, self._column) > (samples, 0, 0):
            self.clear()

    def trace(self, dispatch: Callable[[Tile, int], None], want: int, until: float, rates: np.ndarray) -> None:
        """Trace up to `want` samples while the clock (perf_counter) is before `until`; `dispatch` traces the n-th
        sample of a tile. `rates` are those of the picture's paths, whose first rays these are: the first tiles are
        sized by them, as the camera may look through thousands of layers."""
        width, height = self._size
        if not self.begun:
            self._tiles.expect(rates if rates.any() else np.array([_GUESS_S]))
        while self.samples < want and (began := time.perf_counter()) < until:
            tile = self._tiles.tile(self._row, self._column, 1)
            dispatch(tile, self.samples)
            self._tiles.took(tile, 1, time.perf_counter() - began)
            self._column = tile[0] + tile[2]
            if self._column >= width:
                self._row, self._column = self._row + tile[3], 0
            if self._row >= height:
                self.samples, self._row = self.samples + 1, 0

    def read(self, aov: str, numbers: Sequence[int] | None = None) -> np.ndarray:
        """(height, width, channels) float32 of albedo, normal, depth, incidence (degrees), or one of ID_AOVS.
        `numbers` are those of the scene's materials, from 0, where they are not their places."""
        if aov in ID_AOVS:
            hits = np.frombuffer(self.buffers[Slot.FIRST_HITS].read(), np.uint32)
            ids: np.ndarray = hits.reshape(self._size[1], self._size[0], 4)[..., ID_AOVS.index(aov), None]
            if aov == "material_id" and numbers is not None:
                ids = np.array([0, *(number + 1 for number in numbers)], np.uint32)[ids]
            return ids.astype(np.float32)  # whole up to 2^24, the most shapes of a kind that a scene holds
        if aov not in ("depth", "incidence"):
            values = self._vectors(Slot.ALBEDO if aov == "albedo" else Slot.NORMAL)
            mean: np.ndarray = values[..., :3] / np.float32(self.samples)
            return mean
        hits = self._vectors(Slot.ALBEDO)[..., 3:]
        sums = self._vectors(Slot.NORMAL)[..., 3:] if aov == "depth" else self._vectors(Slot.FIRST_HITS)[..., 2:3]
        return np.where(hits > 0, sums / np.maximum(hits, 1), 0).astype(np.float32)

    def _vectors(self, slot: Slot) -> np.ndarray:
        flat = np.frombuffer(self.buffers[slot].read(), np.float32)
        return flat.reshape(self._size[1], self._size[0], 4)

    def release(self) -> None:
        for buffer in self.buffers.values():
            buffer.release()
