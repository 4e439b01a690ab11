"""How many bytes of the device's memory a scene and a picture take, about."""

from __future__ import annotations

import numpy as np

from gpu.arrays import SceneArrays
from gpu.settings import RenderSettings

# Bytes of a pixel: three vec4 of the total, and three of the block under way (gpu.picture.accumulators), which take
# memory from sample 9 on; with `adaptive` a plan in place of a block. AOVs of the first hit: two vec4 and a uvec4.
TOTAL_BYTES, BLOCK_BYTES, PLAN_BYTES, FIRST_HIT_BYTES = 48, 48, 1, 48
PICTURE_BYTES = 1 << 20  # bytes of every picture, whatever its size: the noise meter's buffers and small ones


def scene_bytes(scene: SceneArrays) -> int:
    """About how many bytes a scene takes on the device."""
    parts = [scene, scene.environment, scene.textures]
    arrays = [array for part in parts if part is not None for array in vars(part).values()]
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def picture_bytes(settings: RenderSettings, guided: bool = False) -> int:
    """About how many bytes a picture takes on the device at most, with the AOVs of the first hit (`guided`) or
    without."""
    pixel_bytes = (
        TOTAL_BYTES + (PLAN_BYTES if settings.adaptive else BLOCK_BYTES) + (FIRST_HIT_BYTES if guided else 0)
    )
    return settings.width * settings.height * pixel_bytes + PICTURE_BYTES
