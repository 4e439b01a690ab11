"""`principled`: the production model and the editor's default."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import model_validator

from service.document.base import OMITTABLE, dial, entry, hint, picker, refusal, slider
from service.document.material import openpbr_words
from service.document.material.disney import DisneyMaterial
from service.document.material.parameters import Abbe, ConductorIndex, Extinction, dispersion
from service.document.material.subsurface import WalkRadius, factor_of
from service.document.texture import (
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
        slider(
            "Subsurface",
            "Share of the diffuse light that comes out beside where it went in; without a radius a flatter shade.",
            "Subsurface",
        ),
    ] = 0.0
    subsurface_radius: WalkRadius = None
    transmission: Annotated[
        AnyFraction, slider("Transmission", "How clear the material is: 1 is glass.", "Transmission")
    ] = 0.0
    ior: Annotated[
        AnyIndex | None,
        OMITTABLE,
        slider(
            "Index of refraction",
            "How strongly light is bent and mirrored: water 1.33, glass 1.5, diamond 2.42. It takes the place of "
            "specular.",
            "Specular",
            follows=("specular", index_of_specular),
        ),
    ] = None
    abbe: Annotated[
        Abbe | None,
        OMITTABLE,
        slider(
            "Abbe number",
            "Splits light into colours as a prism does: the lower, the more. Flint 30, diamond 55, crown glass 60.",
            "Transmission",
            soft=(10, 100),
            absent="none",
        ),
    ] = None
    attenuation_color: Annotated[
        AnyReflectance,
        picker(
            "Attenuation colour",
            "The colour of white light after the attenuation distance through the material.",
            "Transmission",
        ),
    ] = (1.0, 1.0, 1.0)
    attenuation_distance: Annotated[
        AnyLength | None,
        OMITTABLE,
        slider(
            "Attenuation distance",
            "How far light goes through the material until it has the attenuation colour. Without it, the inside "
            "is clear.",
            "Transmission",
            unit="m",
            soft=5,
            log=1e-4,
            absent="clear",
        ),
    ] = None
    thin_walled: Annotated[
        bool,
        hint(
            "Thin walled",
            "A sheet without an inside, such as a window pane or a leaf: light goes straight through.",
            "Transmission",
        ),
    ] = False
    diffuse_transmission: Annotated[
        AnyFraction,
        slider(
            "Diffuse transmission",
            "How much light shines through, as through leaves and paper. Above 0 the thing is a thin sheet.",
            "Transmission",
        ),
    ] = 0.0
    diffuse_transmission_color: Annotated[
        AnyReflectance | None,
        OMITTABLE,
        picker(
            "Diffuse transmission colour",
            "The colour of the light that shines through, in place of the base colour.",
            "Transmission",
            absent="base colour",
        ),
    ] = None
    specular_color: Annotated[
        AnyReflectance,
        picker(
            "Specular colour", "Tints the reflection where you look straight at it; the rim stays white.", "Specular"
        ),
    ] = (1.0, 1.0, 1.0)
    anisotropic_rotation: Annotated[
        AnyDegrees,
        dial(
            "Anisotropic rotation",
            "Turns the direction in which the highlight is stretched, counter-clockwise.",
            "Specular",
            soft=(-180, 180),
        ),
    ] = 0.0
    sheen_color: Annotated[
        AnyReflectance | None,
        OMITTABLE,
        picker(
            "Sheen colour",
            "The colour of the sheen. It takes the place of the sheen tint.",
            "Sheen",
            absent="by tint",
        ),
    ] = None
    sheen_roughness: Annotated[
        AnyFraction,
        slider(
            "Sheen roughness", "How far the sheen reaches inwards from the rim: satin is low, wool high.", "Sheen"
        ),
    ] = 0.5
    clearcoat_roughness: Annotated[
        AnyFraction | None,
        OMITTABLE,
        slider(
            "Clearcoat roughness",
            "How rough the lacquer is: 0 is a perfect varnish. It takes the place of the gloss.",
            "Coat",
            follows=("clearcoat_gloss", roughness_of_gloss),
        ),
    ] = None
    conductor_eta: Annotated[
        ConductorIndex | None,
        OMITTABLE,
        entry(
            "n (metal)",
            "The index of refraction as measured, for red, green and blue. With k it takes the place of the base "
            "colour.",
            "Specular",
            unit="",
            absent="by base colour",
            beside="conductor_k",
            example=[0.18, 0.42, 1.37],
        ),
    ] = None
    conductor_k: Annotated[
        Extinction | None,
        OMITTABLE,
        entry(
            "k (metal)",
            "The extinction coefficient as measured, for red, green and blue. It goes with n.",
            "Specular",
            unit="",
            absent="by base colour",
            beside="conductor_eta",
            example=[3.42, 2.35, 1.77],
        ),
    ] = None
    film_thickness: Annotated[
        AnyThickness,
        slider(
            "Film thickness",
            "A thin film with the colours of a soap bubble or of oil on water: soap 200 to 800, oxides of metals "
            "30 to 200.",
            "Film",
            unit="nm",
            soft=1000,
        ),
    ] = 0.0
    film_ior: Annotated[
        AnyIndex,
        slider(
            "Film index",
            "How strongly the film bends light: water 1.33, oil 1.47, oxides of metals 1.8 to 2.6.",
            "Film",
            soft=(1, 3),
        ),
    ] = 1.4
    clearcoat_normal_map: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint(
            "Coat normal map",
            "Small bumps of the coat itself. Without it the coat is smooth, whatever lies under it.",
            "Coat",
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
        """True if its surfaces are walls without an inside: those that pass diffuse light always are."""
        through = self.diffuse_transmission
        passes = through.factor > 0 if isinstance(through, ScalarTexture) else through > 0
        return self.thin_walled or passes

    def is_filled(self) -> bool:
        """True if it says by itself what is under its surface."""
        walks = self.subsurface_radius is not None and max(self.subsurface_radius) > 0
        return walks and factor_of(self.subsurface) > 0 and not self.is_thin

    def value(self, name: str) -> Any:
        if name == "abbe":
            return dispersion(self.abbe)
        return self.is_thin if name == "thin_walled" else super().value(name)
