"""How many bytes of the device's memory a scene and a picture take, about."""

from __future__ import annotations

import numpy as np

from gpu.arrays import SceneArrays
from gpu.settings import RenderSettings

# Bytes of a pixel: three vec4 (gpu.picture.picture); with the AOVs of the first hit two more and a uvec4.
PIXEL_BYTES, GUIDED_PIXEL_BYTES = 48, 96
PICTURE_BYTES = 1 << 20  # bytes of every picture, whatever its size: the noise meter's buffers and small ones


def scene_bytes(scene: SceneArrays) -> int:
    """About how many bytes a scene takes on the device."""
    parts = [scene, scene.environment, scene.textures]
    arrays = [array for part in parts if part is not None for array in vars(part).values()]
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def picture_bytes(settings: RenderSettings, guided: bool = False) -> int:
    """About how many bytes a picture takes on the device, with the AOVs of the first hit (`guided`) or without."""
    pixel_bytes = (GUIDED_PIXEL_BYTES if guided else PIXEL_BYTES) + (1 if settings.adaptive else 0)  # the plan
    return settings.width * settings.height * pixel_bytes + PICTURE_BYTES
