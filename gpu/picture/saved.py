"""A picture's state off the device: kept when the device's memory is needed, or for when the renderer is lost."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gpu import context as contexts
from gpu.settings import RenderSettings

if TYPE_CHECKING:
    from gpu.picture.picture import Picture

PIECE_BYTES = 16 << 20  # read at once, some milliseconds: others have their turn in between


@dataclass(frozen=True)
class Saved:
    """What `restore` needs to go on to the same bits; `buffers` in the order of `Picture.state`, as bytes."""

    settings: RenderSettings
    samples: int
    under_way: tuple[int, int, int]  # samples of the pass, row and column of its next tile
    buffers: list[np.ndarray]


def _room(size: int) -> np.ndarray:
    return np.empty(size, np.uint8)


def save(picture: Picture, room: Callable[[int], np.ndarray] = _room) -> Generator[None, None, Saved]:
    """Reads the picture's state piece by piece, a step each; the picture must not be traced meanwhile.

    `room` gives the memory for so many bytes."""
    out: list[np.ndarray] = []
    for buffer in picture.state:
        data = room(buffer.size)
        for start in range(0, buffer.size, PIECE_BYTES):
            contexts.use(picture.context)
            piece = data[start : start + PIECE_BYTES]
            buffer.read_into(piece.data, piece.nbytes, offset=start)
            yield
        out.append(data)
    return Saved(picture.settings, picture.samples, picture.under_way, out)
