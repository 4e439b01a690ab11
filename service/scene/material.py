"""How surfaces scatter and glow."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from service.scene.base import OMITTABLE, Model, hint
from service.scene.texture import (
    AnyDegrees,
    AnyFactor,
    AnyFraction,
    AnyIndex,
    AnyLength,
    AnyRadiometric,
    AnyReflectance,
    NormalTexture,
    ScalarTexture,
)

BaseColor = Annotated[
    AnyReflectance,
    hint(
        "Base colour",
        "Diffuse albedo, or a metal's reflectance head-on; real albedos lie in 0.03 to 0.9.",
        unit="",
        widget="color",
    ),
]
Metallic = Annotated[
    AnyFraction,
    hint(
        "Metallic",
        "0 is a dielectric, 1 a metal; between is for dust or blends, not for one substance.",
        unit="",
        widget="slider",
    ),
]
Roughness = Annotated[
    AnyFraction,
    hint(
        "Roughness",
        "0 is polished, 1 is matte; its square is the width of the highlight.",
        unit="",
        widget="slider",
    ),
]


class _Surface(Model):
    emission: Annotated[
        AnyRadiometric,
        hint(
            "Emission",
            "Radiance that leaves the front side: above 0 the shape is an area light.",
            unit="W/(m^2 sr)",
            widget="color",
            soft=20,
        ),
    ] = (0.0, 0.0, 0.0)
    emission_sides: Annotated[
        Literal["front", "both"],
        hint("Emitting sides", "Whether the emission leaves the outward side only, or the inward side as well."),
    ] = "front"
    alpha: Annotated[
        AnyFraction,
        hint(
            "Alpha",
            "The chance that a ray meets the surface: 0 is not there, 0.5 a fine mesh.",
            unit="",
            widget="slider",
        ),
    ] = 1.0
    alpha_cutoff: Annotated[
        AnyFraction | None,
        OMITTABLE,
        hint(
            "Alpha cutoff",
            "Where given, an alpha of at least this counts as 1, any other as 0.",
            unit="",
            widget="slider",
            absent="off",
        ),
    ] = None
    normal_map: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint("Normal map", "Bends the surface's normal without moving the surface."),
    ] = None


class DiffuseMaterial(_Surface):
    """Scatters equally in all directions: f = albedo / pi."""

    type: Literal["diffuse"]
    albedo: Annotated[
        AnyReflectance,
        hint(
            "Albedo",
            "Share of light sent back: fresh snow 0.9, white paint 0.8, grass 0.25, charcoal 0.04.",
            unit="",
            widget="color",
        ),
    ]


class DisneyMaterial(_Surface):
    """The "principled" BRDF of Burley's 2012 course notes."""

    type: Literal["disney"]
    base_color: BaseColor = (0.5, 0.5, 0.5)
    subsurface: Annotated[
        AnyFraction,
        hint(
            "Subsurface",
            "Blends towards a flatter diffuse shape, as of skin or wax (Hanrahan-Krueger).",
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
            unit="",
            widget="slider",
        ),
    ] = 0.5
    specular_tint: Annotated[
        AnyFraction,
        hint(
            "Specular tint",
            "Tints the dielectric's reflection head-on to the base colour; grazing stays white.",
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
            unit="",
            widget="slider",
        ),
    ] = 0.0
    sheen: Annotated[
        AnyFraction,
        hint("Sheen", "Extra light at grazing angles, for cloth.", unit="", widget="slider"),
    ] = 0.0
    sheen_tint: Annotated[
        AnyFraction,
        hint("Sheen tint", "Tints the sheen from white to the base colour.", unit="", widget="slider"),
    ] = 0.5
    clearcoat: Annotated[
        AnyFraction,
        hint("Clearcoat", "A second, thin layer of lacquer with an index of 1.5.", unit="", widget="slider"),
    ] = 0.0
    clearcoat_gloss: Annotated[
        AnyFraction,
        hint("Clearcoat gloss", "1 is a gloss lacquer, 0 a satin one.", unit="", widget="slider"),
    ] = 1.0


class MetalRoughMaterial(_Surface):
    """The core BRDF of glTF 2.0: a metal or a dielectric of index 1.5, without coat."""

    type: Literal["metal_rough"]
    base_color: BaseColor
    metallic: Metallic
    roughness: Roughness


class BlinnPhongMaterial(_Surface):
    """The classic highlight of early rasterisers, as a baseline: it conserves no energy."""

    type: Literal["blinn_phong"]
    diffuse: Annotated[
        AnyReflectance,
        hint("Diffuse", "Share of light that is sent back equally in all directions.", unit="", widget="color"),
    ]
    specular: Annotated[
        AnyReflectance,
        hint(
            "Specular",
            "Colour of the highlight; not normalised: a sharper one sends back less light.",
            unit="",
            widget="color",
        ),
    ]
    shininess: Annotated[
        AnyFactor,
        hint(
            "Shininess",
            "Exponent of the highlight: 10 is dull, 100 is polished, 1000 is close to a mirror.",
            unit="",
            widget="slider",
            soft=1000,
        ),
    ]
    ambient: Annotated[
        AnyRadiometric,
        hint(
            "Ambient",
            "Radiance added wherever the surface is met; it lights nothing by being picked as a light.",
            unit="W/(m^2 sr)",
            widget="color",
            soft=1,
        ),
    ] = (0.0, 0.0, 0.0)


def index_of_specular(specular: float) -> float:
    """The index of refraction whose reflectance head-on is 0.08 `specular`, as `surface.glsl` has it."""
    r = math.sqrt(0.08 * specular)
    return (1 + r) / (1 - r)


def roughness_of_gloss(gloss: float) -> float:
    """The coat's roughness for its gloss: the square root of alpha, which goes from 0.1 to 0.001 as in `disney`."""
    return math.sqrt(0.1 + (0.001 - 0.1) * gloss)


class PrincipledMaterial(DisneyMaterial):
    """The production model: reciprocal, never gains light, puts back what microfacets lose, and may be glass."""

    type: Literal["principled"]  # type: ignore[assignment]
    transmission: Annotated[
        AnyFraction,
        hint(
            "Transmission",
            "Share of the base that is clear: 1 is solid glass, entered and left by refraction.",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    ior: Annotated[
        AnyIndex | None,
        OMITTABLE,
        hint(
            "Index of refraction",
            "Water 1.33, glass 1.5, diamond 2.42; in place of specular, which else sets it.",
            unit="",
            widget="slider",
            follows=("specular", index_of_specular),
        ),
    ] = None
    attenuation_color: Annotated[
        AnyReflectance,
        hint(
            "Attenuation colour",
            "What is left of white light after the attenuation distance inside.",
            unit="",
            widget="color",
        ),
    ] = (1.0, 1.0, 1.0)
    attenuation_distance: Annotated[
        AnyLength | None,
        OMITTABLE,
        hint(
            "Attenuation distance",
            "How far inside light takes the attenuation colour; without it, clear.",
            unit="m",
            widget="slider",
            soft=5,
            absent="clear",
        ),
    ] = None
    specular_color: Annotated[
        AnyReflectance,
        hint(
            "Specular colour",
            "Tints the dielectric's reflection head-on; grazing stays white.",
            unit="",
            widget="color",
        ),
    ] = (1.0, 1.0, 1.0)
    anisotropic_rotation: Annotated[
        AnyDegrees,
        hint(
            "Anisotropic rotation",
            "Turns the stretch of the highlight, counter-clockwise from the tangent.",
            unit="degrees",
            widget="angle",
            soft=(-180, 180),
        ),
    ] = 0.0
    sheen_color: Annotated[
        AnyReflectance | None,
        OMITTABLE,
        hint(
            "Sheen colour",
            "Colour of the sheen, in place of white tinted by the sheen tint.",
            unit="",
            widget="color",
            absent="by tint",
        ),
    ] = None
    sheen_roughness: Annotated[
        AnyFraction,
        hint(
            "Sheen roughness",
            "How far the sheen reaches from grazing angles inwards; satin is low, wool high.",
            unit="",
            widget="slider",
        ),
    ] = 0.5
    clearcoat_roughness: Annotated[
        AnyFraction | None,
        OMITTABLE,
        hint(
            "Clearcoat roughness",
            "Roughness of the coat, in place of its gloss; 0 is a perfect varnish.",
            unit="",
            widget="slider",
            follows=("clearcoat_gloss", roughness_of_gloss),
        ),
    ] = None
    clearcoat_normal_map: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint("Coat normal map", "The coat's own; without it the coat is smooth over whatever is under it."),
    ] = None


Material = Annotated[
    DiffuseMaterial | DisneyMaterial | PrincipledMaterial | MetalRoughMaterial | BlinnPhongMaterial,
    Field(discriminator="type"),
]


def stretches(material: Material) -> bool:
    """Whether its highlight has a direction, which a mesh must then have at its vertices."""
    found = getattr(material, "anisotropic", 0.0)
    return bool((found.factor if isinstance(found, ScalarTexture) else found) > 0)
