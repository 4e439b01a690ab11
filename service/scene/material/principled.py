"""`principled`: the production model and the editor's default."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import model_validator

from service.scene.base import OMITTABLE, hint, refusal
from service.scene.material import openpbr_words
from service.scene.material.abbe import Abbe, dispersion
from service.scene.material.conductor import ConductorIndex, Extinction
from service.scene.material.disney import DisneyMaterial
from service.scene.material.subsurface import WalkRadius, factor_of
from service.scene.texture import (
    AnyDegrees,
    AnyFraction,
    AnyIndex,
    AnyLength,
    AnyReflectance,
    AnyThickness,
    NormalTexture,
    ScalarTexture,
)


def index_of_specular(specular: float) -> float:
    """The index whose reflectance head-on is 0.08 `specular`, as `bsdf/models/principled.glsl` has it."""
    r = math.sqrt(0.08 * specular)
    return (1 + r) / (1 - r)


def roughness_of_gloss(gloss: float) -> float:
    """The coat's roughness for its gloss: the square root of alpha, which goes from 0.1 to 0.001 as in `disney`."""
    return math.sqrt(0.1 + (0.001 - 0.1) * gloss)


class PrincipledMaterial(DisneyMaterial):
    """The production model: reciprocal, never gains light, puts back what microfacets lose, and may be glass."""

    type: Literal["principled"]  # type: ignore[assignment]
    subsurface: Annotated[
        AnyFraction,
        hint(
            "Subsurface",
            "Share of the diffuse light that comes out beside where it went in; without a radius a flatter shade.",
            group="Subsurface",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    subsurface_radius: WalkRadius = None
    transmission: Annotated[
        AnyFraction,
        hint(
            "Transmission",
            "Share of the base that is clear: 1 is solid glass, entered and left by refraction.",
            group="Transmission",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    ior: Annotated[
        AnyIndex | None,
        OMITTABLE,
        hint(
            "Index of refraction",
            "Water 1.33, glass 1.5, diamond 2.42; in place of specular, which sets it otherwise.",
            group="Specular",
            unit="",
            widget="slider",
            follows=("specular", index_of_specular),
        ),
    ] = None
    abbe: Annotated[
        Abbe | None,
        OMITTABLE,
        hint(
            "Abbe number",
            "Spreads what glass refracts into colours: flint 30, diamond 55, crown 60; without it, none.",
            group="Transmission",
            unit="",
            widget="slider",
            soft=(10, 100),
            absent="none",
        ),
    ] = None
    attenuation_color: Annotated[
        AnyReflectance,
        hint(
            "Attenuation colour",
            "What is left of white light after the attenuation distance inside.",
            group="Transmission",
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
            group="Transmission",
            unit="m",
            widget="slider",
            soft=5,
            log=1e-4,
            absent="clear",
        ),
    ] = None
    thin_walled: Annotated[
        bool,
        hint(
            "Thin walled",
            "A sheet without an inside, as a window pane or a leaf: light goes straight through.",
            group="Transmission",
        ),
    ] = False
    diffuse_transmission: Annotated[
        AnyFraction,
        hint(
            "Diffuse transmission",
            "Share of the diffuse light that leaves on the other side, as of leaves and paper; above 0 a thin wall.",
            group="Transmission",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    diffuse_transmission_color: Annotated[
        AnyReflectance | None,
        OMITTABLE,
        hint(
            "Diffuse transmission colour",
            "Of the diffuse light that goes through, in place of the base colour.",
            group="Transmission",
            unit="",
            widget="color",
            absent="base colour",
        ),
    ] = None
    specular_color: Annotated[
        AnyReflectance,
        hint(
            "Specular colour",
            "Tints the dielectric's reflection head-on; grazing stays white.",
            group="Specular",
            unit="",
            widget="color",
        ),
    ] = (1.0, 1.0, 1.0)
    anisotropic_rotation: Annotated[
        AnyDegrees,
        hint(
            "Anisotropic rotation",
            "Turns the stretch of the highlight, counter-clockwise from the tangent.",
            group="Specular",
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
            group="Sheen",
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
            group="Sheen",
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
            group="Coat",
            unit="",
            widget="slider",
            follows=("clearcoat_gloss", roughness_of_gloss),
        ),
    ] = None
    conductor_eta: Annotated[
        ConductorIndex | None,
        OMITTABLE,
        hint(
            "Metal's index",
            "The metal's index of refraction, per channel, beside its k: in place of the base colour.",
            group="Specular",
            unit="",
            widget="number",
            absent="by base colour",
            beside="conductor_k",
            example=[0.18, 0.42, 1.37],
        ),
    ] = None
    conductor_k: Annotated[
        Extinction | None,
        OMITTABLE,
        hint(
            "Metal's k",
            "The metal's extinction coefficient, per channel, beside its index.",
            group="Specular",
            unit="",
            widget="number",
            absent="by base colour",
            beside="conductor_eta",
            example=[3.42, 2.35, 1.77],
        ),
    ] = None
    film_thickness: Annotated[
        AnyThickness,
        hint(
            "Film thickness",
            "Of a thin film on the base, whose colours are those of interference: soap 200 to 800, oxides 30 to 200.",
            group="Film",
            unit="nm",
            widget="slider",
            soft=1000,
        ),
    ] = 0.0
    film_ior: Annotated[
        AnyIndex,
        hint(
            "Film index",
            "Water 1.33, oil 1.47, oxides of metals 1.8 to 2.6.",
            group="Film",
            unit="",
            widget="slider",
            soft=(1, 3),
        ),
    ] = 1.4
    clearcoat_normal_map: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint(
            "Coat normal map",
            "The coat's own; without it the coat is smooth over whatever is under it.",
            group="Coat",
        ),
    ] = None

    @model_validator(mode="after")
    def _complex_index_is_whole(self) -> PrincipledMaterial:
        for name, other in (("conductor_eta", "conductor_k"), ("conductor_k", "conductor_eta")):
            if getattr(self, name) is not None and getattr(self, other) is None:
                raise refusal(f"{name} needs {other} beside it: the two are the metal's complex index", f"/{name}")
        return self

    @classmethod
    def taken(cls, old: dict[str, Any], made: dict[str, Any]) -> set[str]:
        """A model whose menu has a conductor becomes a metal; elsewhere its index is of no use."""
        used = openpbr_words.film(old, made)
        names = {"conductor_eta", "conductor_k"} & made.keys()
        if names and old.get("fresnel") == "conductor":
            made["metallic"] = 1
            return used | names | {"fresnel"}
        for name in names:
            del made[name]
        return used

    @property
    def is_thin(self) -> bool:
        """Whether its surfaces are walls without an inside: those that pass diffuse light always are."""
        through = self.diffuse_transmission
        passes = through.factor > 0 if isinstance(through, ScalarTexture) else through > 0
        return self.thin_walled or passes

    def is_filled(self) -> bool:
        """Whether it says by itself what is under its surface."""
        walks = self.subsurface_radius is not None and max(self.subsurface_radius) > 0
        return walks and factor_of(self.subsurface) > 0 and not self.is_thin

    def value(self, name: str) -> Any:
        if name == "abbe":
            return dispersion(self.abbe)
        return self.is_thin if name == "thin_walled" else super().value(name)
