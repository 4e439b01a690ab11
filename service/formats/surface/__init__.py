"""One vocabulary of materials: what the inputs of the surface models that files have mean. The names are MaterialX'.

A reader of a format gives `Inputs`, its syntax; a model's file says once what they are as a material of the document.

standard  Autodesk Standard Surface
open_pbr  OpenPBR Surface
gltf      glTF's metallic-roughness model with its extensions
preview   UsdPreviewSurface
disney    the Disney model
parts     what several of them have in common
inputs    what a model reads a shader by, and the parameters that it sets
plain     inputs that are numbers, colours and textures
trees     formulas that hold for numbers and for textures
"""

from collections.abc import Callable

from service.formats.surface.disney import disney_principled
from service.formats.surface.gltf import gltf_pbr
from service.formats.surface.inputs import Inputs
from service.formats.surface.open_pbr import open_pbr_surface
from service.formats.surface.preview import usd_preview_surface
from service.formats.surface.standard import standard_surface

MODELS: dict[str, Callable[[Inputs], None]] = {
    "standard_surface": standard_surface,
    "open_pbr_surface": open_pbr_surface,
    "gltf_pbr": gltf_pbr,
    "UsdPreviewSurface": usd_preview_surface,
    "disney_principled": disney_principled,
}
