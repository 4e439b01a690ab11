"""A picture's state off the device: kept when the device's memory is needed, or for when the renderer is lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpu.settings import RenderSettings


@dataclass(frozen=True)
class Saved:
    """What `Picture.restore` needs to go on to the same bits; `buffers` in the order of `Picture.state`, as bytes."""

    settings: RenderSettings
    samples: int
    under_way: tuple[int, int, int]  # samples of the pass, row and column of its next tile
    buffers: list[np.ndarray]
