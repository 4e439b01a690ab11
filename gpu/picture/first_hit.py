"""AOVs of the first hit. They are traced when first read, apart from the picture, over the same camera rays."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.layout import WORK_GROUP
from gpu.layout.bindings import Slot
from gpu.picture.schedule import Tile
from gpu.settings import ID_AOVS

SAMPLES = 256  # samples that they average at most
_PIXELS = 1 << 16  # pixels of a dispatch, which takes 25 ms on llvmpipe in a large mesh


class FirstHit:
    """Made for a picture of `size`; takes memory from the first `trace` on."""

    def __init__(self, context: Any, size: tuple[int, int]) -> None:
        self._context, self._size = context, size
        self.buffers: dict[Slot, Any] = {}
        self.samples, self._row = 0, 0

    @property
    def begun(self) -> bool:
        return (self.samples, self._row) > (0, 0)

    def clear(self) -> None:
        for buffer in self.buffers.values():
            buffer.clear()
        self.samples, self._row = 0, 0

    def allocate(self) -> None:
        width, height = self._size
        for slot in (Slot.ALBEDO, Slot.NORMAL, Slot.OUTPUT):
            self.buffers[slot] = contexts.allocate(self._context, 16 * width * height)
            self.buffers[slot].clear()

    def limit(self, samples: int) -> None:
        """Begin again if more samples than these were traced."""
        if (self.samples, self._row) > (samples, 0):
            self.clear()

    def trace(self, dispatch: Callable[[Tile, int], None], want: int, until: float) -> None:
        """Trace up to `want` samples while the clock (perf_counter) is before `until`; `dispatch` traces the n-th
        sample of a tile."""
        width, height = self._size
        rows = max(1 if width > _PIXELS else WORK_GROUP, _PIXELS // width // WORK_GROUP * WORK_GROUP)
        while self.samples < want and time.perf_counter() < until:
            lines = min(rows, height - self._row)
            dispatch((0, self._row, width, lines), self.samples)
            self._row += lines
            if self._row >= height:
                self.samples, self._row = self.samples + 1, 0

    def read(self, aov: str) -> np.ndarray:
        """(height, width, channels) float32 of albedo, normal, depth, incidence (degrees), or one of ID_AOVS."""
        if aov in ID_AOVS:
            met = np.frombuffer(self.buffers[Slot.OUTPUT].read(), np.uint32)
            ids: np.ndarray = met.reshape(self._size[1], self._size[0], 4)[..., ID_AOVS.index(aov), None]
            return ids.astype(np.float32)  # whole up to 2^24, the most shapes of a kind that a scene holds
        if aov not in ("depth", "incidence"):
            values = self._vectors(Slot.ALBEDO if aov == "albedo" else Slot.NORMAL)
            mean: np.ndarray = values[..., :3] / np.float32(self.samples)
            return mean
        hits = self._vectors(Slot.ALBEDO)[..., 3:]
        sums = self._vectors(Slot.NORMAL)[..., 3:] if aov == "depth" else self._vectors(Slot.OUTPUT)[..., 2:3]
        return np.where(hits > 0, sums / np.maximum(hits, 1), 0).astype(np.float32)

    def _vectors(self, slot: Slot) -> np.ndarray:
        flat = np.frombuffer(self.buffers[slot].read(), np.float32)
        return flat.reshape(self._size[1], self._size[0], 4)

    def release(self) -> None:
        for buffer in self.buffers.values():
            buffer.release()
