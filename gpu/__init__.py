"""Arrays in, images out. Knows no HTTP, no JSON, no scene document; all names not listed here are private."""

from gpu.ahead import Recipe
from gpu.arrays import CameraArrays, EnvironmentArrays, SceneArrays, TextureArrays
from gpu.beyond import bounced_paths, missing_light
from gpu.errors import (
    CompileError,
    ContextError,
    GpuError,
    NothingRendered,
    OutOfMemory,
    SceneTooLarge,
    WrongThread,
)
from gpu.picture import Picture
from gpu.renderer import Renderer
from gpu.saved import Saved, picture_bytes, save, scene_bytes
from gpu.scene import Scene
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
    "NothingRendered",
    "OutOfMemory",
    "Picture",
    "Recipe",
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
