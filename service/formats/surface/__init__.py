"""One vocabulary of materials: what the inputs of the surface models that files have mean. The names are MaterialX'.

A reader of a format gives `Inputs`, its syntax, and a model's file says once what they are as a material of the
document; `outputs` says it the other way round, and the writer of a format takes that.

standard      Autodesk Standard Surface
open_pbr      OpenPBR Surface
gltf          glTF's metallic-roughness model with its extensions
preview       UsdPreviewSurface
disney        the Disney model
wavefront     the statements of .mtl libraries
parts         what several of them have in common
choice        which of two materials loses less of a surface
gltf_members  where a glTF file says the inputs of its model
inputs        what a model reads a shader by, and the parameters that it sets
plain         inputs that are numbers, colours and textures
outputs       materials of the document as inputs of a model
trees         formulas that hold for numbers and for textures
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from service.formats.surface import disney, gltf, open_pbr, preview, standard
from service.formats.surface.inputs import Inputs
from service.formats.surface.plain import Default


@dataclass(frozen=True)
class Model:
    """A surface model: what it makes of its inputs, and their defaults."""

    read: Callable[[Inputs], None]
    defaults: Mapping[str, Default]


MODELS: dict[str, Model] = {
    "standard_surface": Model(standard.standard_surface, standard.DEFAULTS),
    "open_pbr_surface": Model(open_pbr.open_pbr_surface, open_pbr.DEFAULTS),
    "gltf_pbr": Model(gltf.gltf_pbr, gltf.DEFAULTS),
    "UsdPreviewSurface": Model(preview.usd_preview_surface, preview.DEFAULTS),
    "disney_principled": Model(disney.disney_principled, disney.DEFAULTS),
}
