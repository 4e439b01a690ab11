"""Arrays in, images out. This package knows no HTTP, no JSON and no scene document; docs/house.md has the import
rules.

renderer    the one way in: load a scene, take a picture of it
arrays      a scene as finished arrays, which the service makes
settings    the choices that change pixels
steps       long work in steps, between which the caller may do something else
errors      what can go wrong on the GPU
context     a headless OpenGL context
egl         EGL's devices; a context that says when its device was reset
denoise     Open Image Denoise over pixels that were read back; public, without GL
oidn        the same library on the GPU that renders; public, without GL
footprint   how many bytes of the device a scene and a picture take
jit         machine code for the few loops that numpy cannot express
layout      the bytes that the host and the shaders share; public, without GL
accel       the trees that make rays and lights quick to find; public, without GL
tables      tables that kernels draw from and look up; public, without GL
kernels     from a scene to compiled kernels
device      arrays as OpenGL objects
picture     one picture in the making
bsdf        one material's BSDF as numbers
precompile  kernels that are compiled before they are needed; public
analysis    measurements of a scene and of the device at hand; public
"""

from gpu.arrays import EnvironmentArrays, MovedArrays, SceneArrays, SceneEdit, TextureArrays
from gpu.bsdf.evaluator import BsdfAlbedo, BsdfEvaluator, BsdfTerms, BsdfValues
from gpu.context import devices, software_device
from gpu.device.scene import Scene
from gpu.errors import (
    CompileError,
    ContextError,
    DeviceLost,
    GpuError,
    NothingRendered,
    OutOfMemory,
    SceneTooLarge,
    WrongThread,
)
from gpu.footprint import picture_bytes, scene_bytes
from gpu.kernels.binaries import cache_folder
from gpu.kernels.features import LIGHT_PERIOD
from gpu.layout.pixel_layers import ACCUMULATOR_BYTES
from gpu.picture.blocks import Band, border_after, stop_after
from gpu.picture.look import Lut, ViewTable
from gpu.picture.picture import Picture
from gpu.picture.prior import Prior, can_move, prior_bytes
from gpu.picture.saved import Saved
from gpu.precompile.kernel_keys import KernelKey
from gpu.renderer import Renderer
from gpu.settings import AOVS, COVERAGE_AOVS, ESTIMATORS, FILTERS, FIRST_HIT_AOVS, SAMPLERS, TONE_MAPS, RenderSettings
from gpu.steps import Steps

__all__ = [
    "ACCUMULATOR_BYTES",
    "AOVS",
    "COVERAGE_AOVS",
    "ESTIMATORS",
    "FILTERS",
    "FIRST_HIT_AOVS",
    "LIGHT_PERIOD",
    "SAMPLERS",
    "TONE_MAPS",
    "Band",
    "BsdfAlbedo",
    "BsdfEvaluator",
    "BsdfTerms",
    "BsdfValues",
    "CompileError",
    "ContextError",
    "DeviceLost",
    "EnvironmentArrays",
    "GpuError",
    "KernelKey",
    "Lut",
    "MovedArrays",
    "NothingRendered",
    "OutOfMemory",
    "Picture",
    "Prior",
    "RenderSettings",
    "Renderer",
    "Saved",
    "Scene",
    "SceneArrays",
    "SceneEdit",
    "SceneTooLarge",
    "Steps",
    "TextureArrays",
    "ViewTable",
    "WrongThread",
    "border_after",
    "cache_folder",
    "can_move",
    "devices",
    "picture_bytes",
    "prior_bytes",
    "scene_bytes",
    "software_device",
    "stop_after",
]
