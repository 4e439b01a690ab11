"""A picture's state off the device, saved when the device's memory is needed, or in case the renderer is lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpu.settings import RenderSettings

# The last buffer of a picture with blocks of samples of which none is under way. Pictures of versions without blocks
# have neither this nor a block.
NO_BLOCK = np.zeros(1, np.uint8)


@dataclass(frozen=True)
class Saved:
    """The state from which `Picture.restore` goes on to the same bits; `buffers` in the order of `Picture.state`, and
    NO_BLOCK after those of a picture of more than the first block."""

    settings: RenderSettings
    samples: int
    under_way: tuple[int, int, int]  # samples of the pass, row and column of its next tile
    buffers: list[np.ndarray]
