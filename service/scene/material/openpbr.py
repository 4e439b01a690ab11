"""`openpbr`: OpenPBR Surface 1.1.1, with its names, ranges and defaults.

https://academysoftwarefoundation.github.io/OpenPBR. Colours are linear Rec.709, as everywhere in a document, where
the specification assumes ACEScg; lengths are metres. What the specification leaves open is in docs/rendering.md.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field

from service.scene.base import OMITTABLE, hint
from service.scene.material import openpbr_words, subsurface
from service.scene.material.abbe import Abbe, dispersion
from service.scene.material.openpbr_film import AnyPositiveIndex, FilmIndex, FilmThickness, FilmWeight, in_nanometres
from service.scene.material.surface import AnySurface, EmissionSides, Height
from service.scene.material.tangent import Tangent, turn_of
from service.scene.numbers import BRIGHTEST, Fraction
from service.scene.texture import (
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
    base_weight: Annotated[
        AnyFraction,
        hint("Base weight", "A factor on the base colour.", group="Base", unit="", widget="slider"),
    ] = 1.0
    base_color: Annotated[
        AnyReflectance,
        hint(
            "Base colour",
            "Diffuse albedo, or a metal's reflectance head-on; real albedos lie in 0.03 to 0.9.",
            group="Base",
            unit="",
            widget="color",
        ),
    ] = (0.8, 0.8, 0.8)
    base_diffuse_roughness: Annotated[
        AnyFraction,
        hint(
            "Diffuse roughness",
            "0 is Lambert's; above it flatter, as of clay or plaster.",
            group="Base",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    base_metalness: Annotated[
        AnyFraction,
        hint(
            "Metalness",
            "0 is a dielectric, 1 a metal; between is for dust or blends, not for one substance.",
            known_as="metallic",
            group="Base",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    specular_weight: Annotated[
        AnyFactor,
        hint(
            "Specular weight",
            "A factor on what a dielectric reflects head-on, or a metal at all; none reflects more than all.",
            group="Specular",
            unit="",
            widget="slider",
            soft=1,
        ),
    ] = 1.0
    specular_color: Annotated[
        AnyReflectance,
        hint(
            "Specular colour",
            "Tints a dielectric's reflection, or a metal's near grazing angles.",
            group="Specular",
            unit="",
            widget="color",
        ),
    ] = (1.0, 1.0, 1.0)
    specular_roughness: Annotated[
        AnyFraction,
        hint(
            "Roughness",
            "0 is polished, 1 is matte; its square is the width of the highlight.",
            known_as="roughness",
            group="Specular",
            highlight=("roughness", None),
            unit="",
            widget="slider",
        ),
    ] = 0.3
    specular_roughness_anisotropy: Annotated[
        AnyFraction,
        hint(
            "Anisotropy",
            "Stretches the highlight along the tangent, as of brushed metal; above 0.9 is as 0.9.",
            known_as="anisotropic",
            group="Specular",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    specular_ior: Annotated[
        AnyPositiveIndex,
        hint(
            "Index of refraction",
            "Water 1.33, glass 1.5, diamond 2.42; below 1 the outer side is the denser one. A texture gives 1 to 4.",
            known_as="ior",
            group="Specular",
            unit="",
            widget="slider",
            soft=(1, 3),
        ),
    ] = 1.5
    transmission_weight: Annotated[
        AnyFraction,
        hint(
            "Transmission",
            "Share of the dielectric that is clear: 1 is solid glass, entered and left by refraction.",
            known_as="transmission",
            group="Transmission",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    transmission_color: Annotated[
        AnyReflectance,
        hint(
            "Transmission colour",
            "Tints light that passes the surface, or by the transmission depth the inside.",
            group="Transmission",
            unit="",
            widget="color",
        ),
    ] = (1.0, 1.0, 1.0)
    transmission_depth: subsurface.Depth = 0.0
    transmission_scatter: subsurface.Scatter = (0.0, 0.0, 0.0)
    transmission_scatter_anisotropy: subsurface.ScatterAnisotropy = 0.0
    transmission_dispersion_scale: Annotated[
        Fraction,
        hint(
            "Dispersion", "How much of the dispersion that the Abbe number stands for; 0 is none.",
            group="Transmission", unit="", widget="slider",
        ),
    ] = 0.0  # fmt: skip
    transmission_dispersion_abbe_number: Annotated[
        Abbe,
        hint(
            "Abbe number", "How little refracted light spreads into colours: flint 30, diamond 55, crown 60.",
            group="Transmission", unit="", widget="slider", soft=(9, 91),
        ),
    ] = 20.0  # fmt: skip
    subsurface_weight: subsurface.Weight = 0.0
    subsurface_color: subsurface.Color = (0.8, 0.8, 0.8)
    subsurface_radius: subsurface.Radius = 1.0
    subsurface_radius_scale: subsurface.RadiusScale = (1.0, 0.5, 0.25)
    subsurface_scatter_anisotropy: subsurface.Anisotropy = 0.0
    coat_weight: Annotated[
        AnyFraction,
        hint(
            "Coat",
            "How much of the surface a clear coat covers.",
            known_as="clearcoat",
            group="Coat",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    coat_color: Annotated[
        AnyReflectance,
        hint(
            "Coat colour",
            "What is left of white light that passes the coat twice, straight.",
            group="Coat",
            unit="",
            widget="color",
        ),
    ] = (1.0, 1.0, 1.0)
    coat_roughness: Annotated[
        AnyFraction,
        hint(
            "Coat roughness",
            "Of the coat's own highlight; it makes those below rougher, too.",
            known_as="clearcoat_roughness",
            group="Coat",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    coat_roughness_anisotropy: Annotated[
        AnyFraction,
        hint(
            "Coat anisotropy",
            "Stretches the coat's highlight along the coat's tangent.",
            group="Coat",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    coat_ior: Annotated[
        AnyPositiveIndex,
        hint(
            "Coat index", "Of the coat's refraction; lacquer is 1.5 to 1.6.",
            group="Coat", unit="", widget="slider", soft=(1, 3),
        ),
    ] = 1.6  # fmt: skip
    coat_darkening: Annotated[
        AnyFraction,
        hint(
            "Coat darkening", "How much reflections inside the coat darken what lies under it; 1 is what they do.",
            group="Coat", unit="", widget="slider",
        ),
    ] = 1.0  # fmt: skip
    fuzz_weight: Annotated[
        AnyFraction,
        hint(
            "Fuzz",
            "How much of the surface fibres or dust cover.",
            known_as="sheen",
            group="Sheen",
            unit="",
            widget="slider",
        ),
    ] = 0.0
    fuzz_color: Annotated[
        AnyReflectance,
        hint(
            "Fuzz colour",
            "Of the light that the fuzz reflects.",
            known_as="sheen_color",
            group="Sheen",
            unit="",
            widget="color",
        ),
    ] = (1.0, 1.0, 1.0)
    fuzz_roughness: Annotated[
        AnyFraction,
        hint(
            "Fuzz roughness",
            "How far it reaches from grazing angles inwards; cloth is low, dust high.",
            known_as="sheen_roughness",
            group="Sheen",
            unit="",
            widget="slider",
        ),
    ] = 0.5
    thin_film_weight: FilmWeight = 0.0
    thin_film_thickness: FilmThickness = 0.5
    thin_film_ior: FilmIndex = 1.4
    emission_luminance: Annotated[
        Luminance,
        hint(
            "Emission",
            "Luminance that leaves the front side, times the colour: above 0 the shape is an area light.",
            group="Emission",
            unit="cd/m^2",
            widget="slider",
            soft=1000,
        ),
    ] = 0.0
    emission_color: Annotated[
        AnyRadiometric,
        hint("Emission colour", "A factor on the emission.", group="Emission", unit="", widget="color", soft=1),
    ] = (1.0, 1.0, 1.0)
    emission_sides: EmissionSides = "front"
    geometry_opacity: Annotated[
        AnyFraction,
        hint(
            "Opacity",
            "The chance that a ray meets the surface: 0 is not there, 0.5 a fine mesh.",
            known_as="alpha",
            group="Geometry",
            unit="",
            widget="slider",
        ),
    ] = 1.0
    geometry_thin_walled: Annotated[
        bool,
        hint(
            "Thin walled", "A sheet without an inside: light goes straight through.",
            known_as="thin_walled", group="Geometry",
        ),
    ] = False  # fmt: skip
    geometry_normal: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint(
            "Normal map",
            "Bends the surface's normal without moving the surface.",
            known_as="normal_map",
            group="Geometry",
        ),
    ] = None
    geometry_tangent: Annotated[
        Tangent | None,
        OMITTABLE,
        hint(
            "Tangent",
            "Where anisotropy stretches highlights: x along growing u, y along growing v.",
            group="Geometry",
            unit="",
            widget="number",
            absent="along u",
        ),
    ] = None
    geometry_coat_normal: Annotated[
        NormalTexture | None,
        OMITTABLE,
        hint(
            "Coat normal map",
            "The coat's own; without it the coat is smooth over whatever is under it.",
            known_as="clearcoat_normal_map",
            group="Coat",
        ),
    ] = None
    geometry_coat_tangent: Annotated[
        Tangent | None,
        OMITTABLE,
        hint(
            "Coat tangent", "Where the coat's anisotropy stretches its highlights.",
            group="Coat", unit="", widget="number", absent="along u",
        ),
    ] = None  # fmt: skip
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
            return in_nanometres(found)
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
        """Whether it says by itself what is under its surface."""
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
        own = self.specular_roughness_anisotropy
        return own if isinstance(own, ScalarTexture) or own > 0 else self.coat_roughness_anisotropy
