"""How surfaces scatter and emit: a module for each model.

surface         emission, opacity and a normal map, which every material may have
conversion      a material turned into another model
parameters      parameters that several models share: colours, dispersion, indices of metals, tangents
diffuse         the Lambertian model
disney          the "principled" BRDF of 2012
principled      the production model, with glass, coat and sheen: `disney` and more
openpbr         OpenPBR Surface
openpbr_film    the thin film of `openpbr`, and its indices
subsurface      media under the surface of `principled` and `openpbr`
openpbr_words   what it and other models say in other words
metal_rough     the core BRDF of glTF 2.0
blinn_phong     the highlight of early rasterisers
phong           the first of these highlights
measured        a real surface, by a file
microfacet      the distributions, geometry and Fresnel terms of the literature; widths of their peaks
"""

from __future__ import annotations

from typing import Annotated, get_args

from pydantic import Field

from service.document.material.blinn_phong import BlinnPhongMaterial
from service.document.material.diffuse import DiffuseMaterial
from service.document.material.disney import DisneyMaterial
from service.document.material.measured import MeasuredMaterial
from service.document.material.metal_rough import MetalRoughMaterial
from service.document.material.microfacet import MicrofacetMaterial
from service.document.material.openpbr import OpenpbrMaterial
from service.document.material.phong import PhongMaterial
from service.document.material.principled import PrincipledMaterial
from service.document.material.surface import AnySurface
from service.document.texture import ScalarTexture

Material = Annotated[
    DiffuseMaterial
    | DisneyMaterial
    | PrincipledMaterial
    | OpenpbrMaterial
    | MetalRoughMaterial
    | BlinnPhongMaterial
    | PhongMaterial
    | MeasuredMaterial
    | MicrofacetMaterial,
    Field(discriminator="type"),
]

MODELS: dict[str, type[AnySurface]] = {model.name(): model for model in get_args(get_args(Material)[0])}


def stretches(material: Material) -> bool:
    """True if the highlight of `material` has a direction, for which a mesh then needs tangents at its vertices. Of
    one that was measured its file would say so."""
    if isinstance(material, MeasuredMaterial):
        return True
    found = getattr(material, "anisotropic", 0.0)
    return bool((found.factor if isinstance(found, ScalarTexture) else found) > 0)


__all__ = [
    "MODELS",
    "BlinnPhongMaterial",
    "DiffuseMaterial",
    "DisneyMaterial",
    "Material",
    "MeasuredMaterial",
    "MetalRoughMaterial",
    "MicrofacetMaterial",
    "OpenpbrMaterial",
    "PhongMaterial",
    "PrincipledMaterial",
    "stretches",
]
