"""`disney`: the BRDF of 2012, kept for faithful comparison."""

from __future__ import annotations

from typing import Annotated, Literal

from service.scene.base import hint
from service.scene.material.parameters import BaseColor, Metallic, Roughness
from service.scene.material.surface import Surface
from service.scene.texture import AnyFraction


class DisneyMaterial(Surface):
    """The "principled" BRDF of Burley's 2012 course notes."""

    type: Literal["disney"]
    base_color: BaseColor = (0.5, 0.5, 0.5)
    subsurface: Annotated[
        AnyFraction,
        hint(
            "Subsurface",
            "Blends towards a flatter diffuse shape, as of skin or wax (Hanrahan-Krueger).",
            group="Subsurface",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    metallic: Metallic = 0.0
    specular: Annotated[
        AnyFraction,
        hint(
            "Specular",
            "Reflectance head-on of a dielectric is 0.08 of it: 0.5 is 4 %, an index of 1.5.",
            group="Specular",
            unit="",
            widget="slider",
        ),
    ] = 0.5
    specular_tint: Annotated[
        AnyFraction,
        hint(
            "Specular tint",
            "Tints the dielectric's reflection head-on to the base colour; grazing stays white.",
            group="Specular",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    roughness: Roughness = 0.5
    anisotropic: Annotated[
        AnyFraction,
        hint(
            "Anisotropic",
            "Stretches the highlight along the tangent, as of brushed metal; 1 is 10 to 1.",
            group="Specular",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    sheen: Annotated[
        AnyFraction,
        hint("Sheen", "Extra light at grazing angles, for cloth.", group="Sheen", unit="", widget="slider"),
    ] = 0.0
    sheen_tint: Annotated[
        AnyFraction,
        hint("Sheen tint", "Tints the sheen from white to the base colour.", group="Sheen", unit="", widget="slider"),
    ] = 0.5
    clearcoat: Annotated[
        AnyFraction,
        hint(
            "Clearcoat",
            "A second, thin layer of lacquer with an index of 1.5.",
            group="Coat",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    clearcoat_gloss: Annotated[
        AnyFraction,
        hint("Clearcoat gloss", "1 is a gloss lacquer, 0 a satin one.", group="Coat", unit="", widget="slider"),
    ] = 1.0
