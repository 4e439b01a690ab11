"""How much of each pixel every shape and every material covers, over the camera rays of AOVs of the first hit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.layout.pixel_layers import COVER, COVER_RANKS, COVER_VECTORS, VECTOR_BYTES
from gpu.picture.first_hit import FirstHit
from gpu.settings import COVERAGE_AOVS

NOTHING = 0xFFFFFFFF  # the shader's NONE


class Coverage(FirstHit):
    """Traced when it is first read, as `FirstHit` is."""

    def __init__(self, context: Any, size: tuple[int, int], most: int) -> None:
        super().__init__(context, size, max(1, most // COVER_VECTORS))

    def allocate(self) -> None:
        width, height = self._size
        for slot in COVER:
            self.buffers[slot] = contexts.allocate(self._context, COVER_VECTORS * VECTOR_BYTES * width * height)
            self.buffers[slot].clear()

    def read(self, aov: str, numbers: Sequence[int] | None = None) -> np.ndarray:
        """(height, width, 2 * COVER_RANKS) float32: index + 1, or -1 for nothing, and the share of the pixel's
        rays, the largest share first; 0 and 0 where there are fewer. The shares add up to 1."""
        words = np.frombuffer(self.buffers[COVER[COVERAGE_AOVS.index(aov)]].read(), np.uint32)
        pairs = words.reshape(self._size[1], self._size[0], COVER_RANKS, 2)
        if aov == "material_coverage" and numbers is not None:
            pairs = pairs.copy()
            taken = (pairs[..., 0] > 0) & (pairs[..., 0] != NOTHING)
            pairs[taken, 0] = np.array(numbers, np.uint32)[pairs[taken, 0] - 1] + 1
        # Equal shares in the order of the document, so that the driver's threads leave no trace.
        order = np.lexsort((pairs[..., 0], -pairs[..., 1].astype(np.int64)), axis=-1)
        out = np.take_along_axis(pairs, order[..., None], axis=2).astype(np.float32)
        out[..., 0][out[..., 0] > NOTHING / 2] = -1
        out[..., 1] /= np.float32(self.samples)
        return out.reshape(*out.shape[:2], 2 * COVER_RANKS)
