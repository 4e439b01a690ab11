"""Arrays in, images out. Knows no HTTP, no JSON, no scene document; all names not listed here are private."""

from gpu.analysis.path_truncation import bounced_paths, missing_light
from gpu.arrays import CameraArrays, EnvironmentArrays, SceneArrays, TextureArrays
from gpu.device.scene import Scene
from gpu.errors import (
    CompileError,
    ContextError,
    GpuError,
    NothingRendered,
    OutOfMemory,
    SceneTooLarge,
    WrongThread,
)
from gpu.footprint import picture_bytes, scene_bytes
from gpu.picture.picture import Picture
from gpu.picture.saved import Saved, save
from gpu.precompile.kernel_keys import KernelKey
from gpu.renderer import Renderer
from gpu.settings import AOVS, ESTIMATORS, FILTERS, SAMPLERS, TONE_MAPS, RenderSettings

__all__ = [
    "AOVS",
    "ESTIMATORS",
    "FILTERS",
    "SAMPLERS",
    "TONE_MAPS",
    "CameraArrays",
    "CompileError",
    "ContextError",
    "EnvironmentArrays",
    "GpuError",
    "KernelKey",
    "NothingRendered",
    "OutOfMemory",
    "Picture",
    "RenderSettings",
    "Renderer",
    "Saved",
    "Scene",
    "SceneArrays",
    "SceneTooLarge",
    "TextureArrays",
    "WrongThread",
    "bounced_paths",
    "missing_light",
    "picture_bytes",
    "save",
    "scene_bytes",
]
