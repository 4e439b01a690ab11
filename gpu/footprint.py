"""How many bytes of the device's memory a scene and a picture take, about."""

from __future__ import annotations

import numpy as np

from gpu.arrays import SceneArrays
from gpu.layout.pixel_layers import ACCUMULATOR_BYTES, COVER_BYTES, FIRST_HIT_BYTES, PLAN_BYTES, SPLAT_BYTES
from gpu.settings import RenderSettings

FIXED_BYTES = 1 << 20  # bytes of every picture, whatever its size: the noise meter's buffers and small ones


def scene_bytes(scene: SceneArrays) -> int:
    """About how many bytes a scene takes on the device."""
    parts = [scene, scene.environment, scene.textures]
    arrays = [array for part in parts if part is not None for array in vars(part).values()]
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def unshared_bytes(scene: SceneArrays) -> int:
    """About how many of these bytes are the scene's alone, and not in uploads that it shares with others."""
    shared = 0
    if scene.environment is not None and scene.environment.key:
        shared += scene.environment.bytes
    if scene.textures is not None and scene.textures.key:
        shared += scene.textures.texels.nbytes + scene.textures.floats.nbytes
    if scene.measured_key:
        shared += scene.measured.nbytes
    return scene_bytes(scene) - shared


def picture_bytes(
    settings: RenderSettings, guided: bool = False, covered: bool = False, splatted: bool = False
) -> int:
    """About how many bytes a picture takes on the device at most, with the AOVs of the first hit (`guided`), with
    coverage and with caustics that are traced from the lights (`splatted`), or without. A block of samples takes
    memory from sample 9 on."""
    block = PLAN_BYTES if settings.adaptive else ACCUMULATOR_BYTES
    pixel_bytes = ACCUMULATOR_BYTES + block + (FIRST_HIT_BYTES if guided else 0) + (COVER_BYTES if covered else 0)
    if splatted:
        pixel_bytes += SPLAT_BYTES
    return settings.width * settings.height * pixel_bytes + FIXED_BYTES
