"""A picture's state off the device: kept when the device's memory is needed, or for when the renderer is lost."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gpu import context as contexts
from gpu.settings import RenderSettings

if TYPE_CHECKING:
    from gpu.picture import Picture

PIECE_BYTES = 16 << 20  # read at once, some milliseconds: others have their turn in between
# A pixel's bytes: three vec4 (gpu.picture._allocate); with the AOVs of the first hit two more, and a uvec2.
PIXEL_BYTES, GUIDED_PIXEL_BYTES = 48, 88
PICTURE_BYTES = 1 << 20  # the noise meter's buffers and what is small


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


def scene_bytes(scene: object) -> int:
    """About what a SceneArrays takes on the device."""
    parts = [scene, *(getattr(scene, name, None) for name in ("environment", "textures"))]
    arrays = [array for part in parts if part is not None for array in vars(part).values()]
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def picture_bytes(settings: RenderSettings, guided: bool = False) -> int:
    """About what a picture takes on the device, with the AOVs of the first hit or without."""
    pixel_bytes = (GUIDED_PIXEL_BYTES if guided else PIXEL_BYTES) + (1 if settings.adaptive else 0)  # the plan
    return settings.width * settings.height * pixel_bytes + PICTURE_BYTES
