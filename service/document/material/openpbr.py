"""`openpbr`: OpenPBR Surface 1.1.1, with its names, ranges and defaults.

https://academysoftwarefoundation.github.io/OpenPBR. Colours are linear Rec.709, as everywhere in a document, where
the specification assumes ACEScg; lengths are metres. What the specification leaves open is in docs/rendering.md.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from service.document.base import OMITTABLE, entry, hint, picker, slider
from service.document.material import openpbr_film as film
from service.document.material import openpbr_words, subsurface
from service.document.material.parameters import Abbe, Tangent, dispersion, turn_of
from service.document.material.surface import AnySurface, EmissionSides, Height
from service.document.numbers import BRIGHTEST, Fraction
from service.document.texture import (
    AnyFactor,
    AnyFraction,
    AnyRadiometric,
    AnyReflectance,
    ColorTexture,
    NormalTexture,
    ScalarTexture,
)

Luminance = Annotated[float, Field(ge=0, le=BRIGHTEST)]


class OpenpbrMaterial(AnySurface):
    """OpenPBR Surface 1.1.1: fuzz over a coat over metal, plastic or glass."""

    model_config = ConfigDict(json_schema_extra={"x-name": "OpenPBR"})

    type: Literal["openpbr"]
    base_weight: Annotated[AnyFraction, slider("Base weight", "How strong the base colour is.", "Base")] = 1.0
    base_color: Annotated[
        AnyReflectance,
        picker(
            "Base colour",
            "The colour of the surface, or of a metal's reflection. Real surfaces lie between 0.03 and 0.9.",
            "Base",
        ),
    ] = (0.8, 0.8, 0.8)
    base_diffuse_roughness: Annotated[
        AnyFraction,
        slider(
            "Diffuse roughness", "0 is smooth; above it the surface looks flatter, as clay or plaster do.", "Base"
        ),
    ] = 0.0
    base_metalness: Annotated[
        AnyFraction,
        slider(
            "Metalness",
            "0 is no metal, 1 is metal. Values between are for dust, rust or blends.",
            "Base",
            known_as="metallic",
        ),
    ] = 0.0
    specular_weight: Annotated[
        AnyFactor, slider("Specular weight", "How strongly the surface mirrors.", "Specular", soft=1)
    ] = 1.0
    specular_color: Annotated[
        AnyReflectance, picker("Specular colour", "Tints the reflection; of a metal, only its rim.", "Specular")
    ] = (1.0, 1.0, 1.0)
    specular_roughness: Annotated[
        AnyFraction,
        slider(
            "Roughness", "0 is polished, 1 is matte.", "Specular", known_as="roughness", highlight=("roughness", None)
        ),
    ] = 0.3
    specular_roughness_anisotropy: Annotated[
        AnyFraction,
        slider(
            "Anisotropy",
            "Stretches the highlight, as on brushed metal; above 0.9 nothing changes any more.",
            "Specular",
            known_as="anisotropic",
        ),
    ] = 0.0
    specular_ior: Annotated[
        film.AnyPositiveIndex,
        slider(
            "Index of refraction",
            "How strongly light is bent and mirrored: water 1.33, glass 1.5, diamond 2.42. A texture gives 1 to 4.",
            "Specular",
            known_as="ior",
            soft=(1, 3),
        ),
    ] = 1.5
    transmission_weight: Annotated[
        AnyFraction,
        slider("Transmission", "How clear the material is: 1 is glass.", "Transmission", known_as="transmission"),
    ] = 0.0
    transmission_color: Annotated[
        AnyReflectance,
        picker("Transmission colour", "The colour of light that has gone through the material.", "Transmission"),
    ] = (1.0, 1.0, 1.0)
    transmission_depth: subsurface.Depth = 0.0
    transmission_scatter: subsurface.Scatter = (0.0, 0.0, 0.0)
    transmission_scatter_anisotropy: subsurface.ScatterAnisotropy = 0.0
    transmission_dispersion_scale: Annotated[
        Fraction,
        slider("Dispersion", "How much light is split into colours, as by a prism: 0 is not at all.", "Transmission"),
    ] = 0.0
    transmission_dispersion_abbe_number: Annotated[
        Abbe,
        slider(
            "Abbe number",
            "Splits light into colours as a prism does: the lower, the more. Flint 30, diamond 55, crown glass 60.",
            "Transmission",
            soft=(9, 91),
        ),
    ] = 20.0
    subsurface_weight: subsurface.Weight = 0.0
    subsurface_color: subsurface.Color = (0.8, 0.8, 0.8)
    subsurface_radius: subsurface.Radius = 1.0
    subsurface_radius_scale: subsurface.RadiusScale = (1.0, 0.5, 0.25)
    subsurface_scatter_anisotropy: subsurface.Anisotropy = 0.0
    coat_weight: Annotated[
        AnyFraction,
        slider("Coat", "How much of the surface is covered by clear lacquer.", "Coat", known_as="clearcoat"),
    ] = 0.0
    coat_color: Annotated[AnyReflectance, picker("Coat colour", "The tint of the lacquer.", "Coat")] = (1.0, 1.0, 1.0)
    coat_roughness: Annotated[
        AnyFraction,
        slider(
            "Coat roughness",
            "How rough the lacquer is: 0 is a perfect varnish.",
            "Coat",
            known_as="clearcoat_roughness",
        ),
    ] = 0.0
    coat_roughness_anisotropy: Annotated[
        AnyFraction, slider("Coat anisotropy", "Stretches the highlight of the lacquer.", "Coat")
    ] = 0.0
    coat_ior: Annotated[
        film.AnyPositiveIndex,
        slider("Coat index", "How strongly the lacquer bends and mirrors light: 1.5 to 1.6.", "Coat", soft=(1, 3)),
    ] = 1.6
    coat_darkening: Annotated[
        AnyFraction,
        slider("Coat darkening", "How much the lacquer deepens the colours under it, as varnish does wood.", "Coat"),
    ] = 1.0
    fuzz_weight: Annotated[
        AnyFraction,
        slider("Fuzz", "How much of the surface is covered by fibres or dust.", "Sheen", known_as="sheen"),
    ] = 0.0
    fuzz_color: Annotated[
        AnyReflectance,
        picker("Fuzz colour", "The colour of the fibres or the dust.", "Sheen", known_as="sheen_color"),
    ] = (1.0, 1.0, 1.0)
    fuzz_roughness: Annotated[
        AnyFraction,
        slider(
            "Fuzz roughness",
            "How far the fuzz reaches inwards from the rim: cloth is low, dust high.",
            "Sheen",
            known_as="sheen_roughness",
        ),
    ] = 0.5
    thin_film_weight: film.FilmWeight = 0.0
    thin_film_thickness: film.FilmThickness = 0.5
    thin_film_ior: film.FilmIndex = 1.4
    emission_luminance: Annotated[
        Luminance,
        slider(
            "Emission",
            "The light that leaves the front side. Above 0 the thing is a lamp.",
            "Emission",
            unit="cd/m^2",
            soft=1000,
        ),
    ] = 0.0
    emission_color: Annotated[
        AnyRadiometric, picker("Emission colour", "The colour of the light.", "Emission", soft=1)
    ] = (1.0, 1.0, 1.0)
    emission_sides: EmissionSides = "front"
    geometry_opacity: Annotated[
        AnyFraction,
        slider("Opacity", "1 is solid, 0.5 a fine mesh, 0 is not there at all.", "Geometry", known_as="alpha"),
    ] = 1.0
    geometry_thin_walled: Annotated[
        bool,
        hint(
            "Thin walled",
            "A sheet without an inside, such as a window pane: light goes straight through.",
            "Geometry",
            known_as="thin_walled",
        ),
    ] = False
    geometry_normal: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint(
            "Normal map",
            "Small bumps: an image that changes how the surface catches the light, but not its outline.",
            "Geometry",
            known_as="normal_map",
        ),
    ] = None
    geometry_tangent: Annotated[
        Tangent | None,
        OMITTABLE,
        entry(
            "Tangent",
            "The direction in which highlights are stretched, along the texture coordinates u and v.",
            "Geometry",
            unit="",
            absent="along u",
        ),
    ] = None
    geometry_coat_normal: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint(
            "Coat normal map",
            "Small bumps of the coat itself. Without it the coat is smooth, whatever lies under it.",
            "Coat",
            known_as="clearcoat_normal_map",
        ),
    ] = None
    geometry_coat_tangent: Annotated[
        Tangent | None,
        OMITTABLE,
        entry(
            "Coat tangent",
            "The direction in which the highlights of the lacquer are stretched.",
            "Coat",
            unit="",
            absent="along u",
        ),
    ] = None
    height: Height = None

    def value(self, name: str) -> Any:
        found = super().value(name)
        if name == "emission_color":
            share = self.emission_luminance / openpbr_words.NITS
            if isinstance(found, ColorTexture):
                return found.model_copy(update={"factor": tuple(share * x for x in found.factor)})
            return tuple(share * x for x in found)
        if name == "transmission_dispersion_abbe_number":
            return dispersion(found, self.transmission_dispersion_scale)
        if name == "thin_film_thickness":
            return film.in_nanometres(found)
        if name == "transmission_depth":
            return found or None
        if name == "subsurface_radius_scale":
            return subsurface.radii(self.subsurface_radius, found)
        if name in ("transmission_scatter_anisotropy", "subsurface_scatter_anisotropy"):
            return subsurface.open_interval(found)
        if name in ("geometry_tangent", "geometry_coat_tangent"):
            return 0.0 if found is None else turn_of(found)
        return found

    def derived(self) -> dict[str, float]:
        """A thin wall is as thick as a leaf: what walks in it comes out on either side."""
        if not self.geometry_thin_walled:
            return {}
        through = subsurface.factor_of(self.subsurface_weight) * (1 + self.subsurface_scatter_anisotropy) / 2
        return {"diffuse_transmission": through}

    def is_filled(self) -> bool:
        """True if it says by itself what is under its surface."""
        walks = subsurface.factor_of(self.subsurface_weight) > 0 and self.subsurface_radius > 0
        return (walks or self.transmission_depth > 0) and not self.geometry_thin_walled

    @classmethod
    def left(cls, old: dict[str, Any], made: dict[str, Any]) -> set[str]:
        return openpbr_words.leave(old, made)

    @classmethod
    def taken(cls, old: dict[str, Any], made: dict[str, Any]) -> set[str]:
        return openpbr_words.take(old, made)

    # What all models have, under the names that they have in common.
    @property
    def emission(self) -> Any:
        return self.value("emission_color")

    @property
    def alpha(self) -> float | ScalarTexture:
        return self.geometry_opacity

    @property
    def alpha_cutoff(self) -> None:
        return None

    @property
    def anisotropic(self) -> Any:
        """That of the base, or else of the coat."""
        base = self.specular_roughness_anisotropy
        return base if isinstance(base, ScalarTexture) or base > 0 else self.coat_roughness_anisotropy
