"""The document as a person writes it: models with ranges, defaults, units and hints, and what is made from them.

document        the document, and how it is parsed; a material as users save it
camera, light, shape, environment, material, texture, transform   its parts
medium          what fills a closed shape, or all space outside of bodies
procedural      textures that are computed: noise and ramps
settings        the settings of a render
base            the base of all models: strict, with hints for editors; names of shapes and lights
numbers         numbers with their ranges and units, and long lists of them
color           colours: linear, sRGB, by temperature
photometry      strengths in candela, lumen, lux and nit
validation      what pydantic says, as errors with pointers
text            JSON texts: parsed, weighed and bounded; merge patches
grading         the tone map and the colour space by which a picture is shown
axes            what varies from one render of a batch to the next
references      the assets that a document refers to
schema          the schema that editors are made from, and a model of it in few words
quality         quality presets, and settings with every knob resolved
presets         built-in scenes, materials and environments
"""

from __future__ import annotations

from service.document.camera import AnyCamera, Camera
from service.document.color import Color
from service.document.document import SavedMaterial, Scene, check_saved_material, parse_scene
from service.document.environment import (
    ConstantEnvironment,
    CubemapEnvironment,
    Environment,
    ImageEnvironment,
    SkyEnvironment,
)
from service.document.light import Light
from service.document.material import (
    BlinnPhongMaterial,
    DiffuseMaterial,
    DisneyMaterial,
    Material,
    MetalRoughMaterial,
    PrincipledMaterial,
)
from service.document.numbers import Vec3
from service.document.procedural import NoiseTexture, RampInput, RampStop, RampTexture
from service.document.schema import schema
from service.document.settings import Limits, Settings, parse_settings
from service.document.shape import MeshShape, Shape
from service.document.text import load_json, merge_patch
from service.document.texture import (
    CheckerTexture,
    ColorTexture,
    HeightTexture,
    ImageTexture,
    NormalTexture,
    ScalarTexture,
    Texture,
)
from service.document.transform import MatrixTransform, Transform

__all__ = [
    "AnyCamera",
    "BlinnPhongMaterial",
    "Camera",
    "CheckerTexture",
    "Color",
    "ColorTexture",
    "ConstantEnvironment",
    "CubemapEnvironment",
    "DiffuseMaterial",
    "DisneyMaterial",
    "Environment",
    "HeightTexture",
    "ImageEnvironment",
    "ImageTexture",
    "Light",
    "Limits",
    "Material",
    "MatrixTransform",
    "MeshShape",
    "MetalRoughMaterial",
    "NoiseTexture",
    "NormalTexture",
    "PrincipledMaterial",
    "RampInput",
    "RampStop",
    "RampTexture",
    "SavedMaterial",
    "ScalarTexture",
    "Scene",
    "Settings",
    "Shape",
    "SkyEnvironment",
    "Texture",
    "Transform",
    "Vec3",
    "check_saved_material",
    "load_json",
    "merge_patch",
    "parse_scene",
    "parse_settings",
    "schema",
]
