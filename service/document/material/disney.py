"""`disney`: the BRDF of 2012, kept for faithful comparison."""

from __future__ import annotations

from typing import Annotated, Literal

from service.document.base import hint, slider
from service.document.material.parameters import BaseColor, Metallic, Roughness
from service.document.material.surface import Surface
from service.document.texture import AnyFraction


class DisneyMaterial(Surface):
    """The "principled" BRDF of Burley's 2012 course notes."""

    type: Literal["disney"]
    base_color: BaseColor = (0.5, 0.5, 0.5)
    subsurface: Annotated[
        AnyFraction, slider("Subsurface", "A flatter, softer shade, as of skin or wax.", "Subsurface")
    ] = 0.0
    metallic: Metallic = 0.0
    specular: Annotated[
        AnyFraction,
        slider(
            "Specular",
            "How much the surface mirrors where you look straight at it: 0.5 is 4 %, as of plastic and glass.",
            "Specular",
        ),
    ] = 0.5
    specular_tint: Annotated[
        AnyFraction,
        slider(
            "Specular tint",
            "Tints the reflection with the base colour where you look straight at it; the rim stays white.",
            "Specular",
        ),
    ] = 0.0
    roughness: Roughness = 0.5
    anisotropic: Annotated[
        AnyFraction,
        slider(
            "Anisotropic",
            "Stretches the highlight, as on brushed metal: at 1 it is ten times as long as wide.",
            "Specular",
        ),
    ] = 0.0
    sheen: Annotated[AnyFraction, slider("Sheen", "A soft bright rim, as of cloth.", "Sheen")] = 0.0
    sheen_tint: Annotated[
        AnyFraction,
        hint(
            "Sheen tint",
            "Tints the sheen from white towards the base colour.",
            group="Sheen",
            unit="",
            widget="slider",
            unless="sheen_color",  # of the model that extends this one
        ),
    ] = 0.5
    clearcoat: Annotated[AnyFraction, slider("Clearcoat", "A thin layer of clear lacquer on top.", "Coat")] = 0.0
    clearcoat_gloss: Annotated[
        AnyFraction,
        slider("Clearcoat gloss", "1 is a glossy lacquer, 0 a satin one.", "Coat", unless="clearcoat_roughness"),
    ] = 1.0
