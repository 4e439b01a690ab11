"""`microfacet`: the distributions, geometry and Fresnel terms of the literature, in any combination."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal, cast

from pydantic import Discriminator, Field, Tag, model_validator

from service.document.base import OMITTABLE, entry, hint, picker, refusal, slider
from service.document.material.parameters import ConductorIndex, Extinction
from service.document.material.surface import SolidSurface
from service.document.numbers import Fraction, RefractiveIndex, rounded
from service.document.texture import REFERENCE_TAG, VALUE_TAG, AnyReflectance, ScalarTexture, form_of

Distribution = Literal["phong", "beckmann", "ggx", "gtr", "abc", "sgd", "gaussian"]
Geometry = Literal["implicit", "neumann", "cook_torrance", "kelemen", "schlick_ggx", "smith", "smith_correlated"]
Fresnel = Literal["none", "schlick", "cook_torrance", "dielectric", "conductor"]
DiffuseModel = Literal["lambert", "oren_nayar", "disney", "eon"]
Range = tuple[float, float]
WIDTHS: Range = (0.001, 10.0)
ALPHA_RANGES: dict[Distribution, Range] = {
    "phong": (0.0, 1e6),
    "beckmann": WIDTHS,
    "ggx": WIDTHS,
    "gtr": WIDTHS,
    "abc": (1e-3, 1e6),
    "sgd": (0.01, 2.0),
    "gaussian": (0.01, 2.0),
}
ANY_GAMMA: Range = (0.0, 1000.0)  # where the distribution has none
GAMMA_RANGES: dict[Distribution, Range] = {"gtr": (0.1, 10.0), "abc": ANY_GAMMA, "sgd": (0.0, 2.0)}
SCHLICK_GGX = ("ggx", "beckmann", "gtr")  # the distributions whose alpha it takes
AnyAlpha = Annotated[
    Annotated[Annotated[float, Field(ge=0, le=1e6)], Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)],
    Discriminator(form_of),
]
# How fast D falls off at its peak, log D = log D(0) - slope theta^2, by alpha and gamma; alpha by slope and gamma.
_PEAKS: dict[str, tuple[Callable[[float, float], float], Callable[[float, float], float]]] = {
    "phong": (lambda n, g: n / 2, lambda s, g: 2 * s),
    "beckmann": (lambda a, g: 1 / a**2 - 2, lambda s, g: (s + 2) ** -0.5),
    "ggx": (lambda a, g: 2 / a**2 - 2, lambda s, g: (s / 2 + 1) ** -0.5),
    "gtr": (lambda a, g: g / a**2 - g, lambda s, g: (s / g + 1) ** -0.5),
    "abc": (lambda a, g: a * g / 2, lambda s, g: 2 * s / (g or 1)),
    "sgd": (lambda a, g: 1 / a + g / a**2 - 2, lambda s, g: _sgd(s, g)),
    "gaussian": (lambda a, g: 1 / a**2, lambda s, g: s**-0.5),
}
_FLATTEST = 1e-3  # a slope; below it, and above 0, all peaks are flat


def _inside(value: float, bounds: Range) -> float:
    return min(max(value, bounds[0]), bounds[1])


class MicrofacetMaterial(SolidSurface):
    """Microfacets by the terms of the literature, for comparison and teaching: may lose or gain energy."""

    type: Literal["microfacet"]
    distribution: Annotated[
        Distribution, hint("Distribution", "How the tiny facets of the surface are tilted (D).", "Specular")
    ] = "ggx"
    alpha: Annotated[
        AnyAlpha,
        slider(
            "Alpha",
            "How wide the highlight is; for Phong an exponent, for ABC an inverse width.",
            "Specular",
            highlight=("alpha", "f0"),
            soft=(0.01, 1.0),
            ranges=("distribution", ALPHA_RANGES),
        ),
    ] = 0.25
    gamma: Annotated[
        Annotated[float, Field(ge=ANY_GAMMA[0], le=ANY_GAMMA[1])],
        slider(
            "Gamma",
            "How soon the highlight fades towards its rim.",
            "Specular",
            soft=(0.1, 10.0),
            ranges=("distribution", dict(GAMMA_RANGES)),
            used=("distribution", list(GAMMA_RANGES)),
        ),
    ] = 2.0
    geometry: Annotated[Geometry, hint("Geometry", "How the tiny facets hide each other (G).", "Specular")] = "smith"
    fresnel: Annotated[Fresnel, hint("Fresnel", "How one facet mirrors (F).", "Specular")] = "schlick"
    f0: Annotated[
        AnyReflectance,
        picker(
            "F0",
            "How much is mirrored where you look straight at it.",
            "Specular",
            used=("fresnel", ["schlick", "cook_torrance"]),
        ),
    ] = (0.04, 0.04, 0.04)
    ior: Annotated[
        RefractiveIndex,
        slider(
            "Index of refraction",
            "How strongly light is bent and mirrored: water 1.33, glass 1.5, diamond 2.42.",
            "Specular",
            used=("fresnel", ["dielectric"]),
        ),
    ] = 1.5
    conductor_eta: Annotated[
        ConductorIndex | None,
        OMITTABLE,
        entry(
            "n (metal)",
            "The index of refraction as measured, for red, green and blue.",
            "Specular",
            unit="",
            used=("fresnel", ["conductor"]),
            example=[0.2, 0.9, 1.1],
        ),
    ] = None
    conductor_k: Annotated[
        Extinction | None,
        OMITTABLE,
        entry(
            "k (metal)",
            "The extinction coefficient as measured, for red, green and blue.",
            "Specular",
            unit="",
            used=("fresnel", ["conductor"]),
            example=[3.9, 2.4, 2.2],
        ),
    ] = None
    diffuse: Annotated[
        AnyReflectance, picker("Diffuse", "The colour of the matte part, which is added to the highlight.", "Base")
    ] = (0.0, 0.0, 0.0)
    diffuse_model: Annotated[DiffuseModel, hint("Diffuse model", "How the matte part is shaded.", "Base")] = "lambert"
    diffuse_roughness: Annotated[
        Fraction,
        slider(
            "Diffuse roughness",
            "How flat the matte part looks, as clay or plaster do.",
            "Base",
            used=("diffuse_model", ["oren_nayar", "disney", "eon"]),
        ),
    ] = 0.0

    @model_validator(mode="before")
    @classmethod
    def _no_opacity(cls, value: Any) -> Any:
        if isinstance(value, dict) and "alpha_cutoff" in value:
            detail = "alpha_cutoff belongs to opacity, which microfacet has none of: its alpha is the distribution's"
            raise refusal(detail, "/alpha_cutoff")
        return value

    @model_validator(mode="after")
    def _terms_fit(self) -> MicrofacetMaterial:
        self._check("alpha", self.alpha_range)
        self._check("gamma", GAMMA_RANGES.get(self.distribution, ANY_GAMMA))
        if self.geometry == "schlick_ggx" and self.distribution not in SCHLICK_GGX:
            allowed = ", ".join(SCHLICK_GGX)
            raise refusal(f"schlick_ggx goes with {allowed} only, not with {self.distribution}", "/geometry")
        for name in ("conductor_eta", "conductor_k"):
            if self.fresnel == "conductor" and getattr(self, name) is None:
                raise refusal(f"{name} is required where fresnel is conductor", f"/{name}")
        return self

    def _check(self, name: str, bounds: Range) -> None:
        value, (low, high) = getattr(self, name), bounds
        if isinstance(value, float) and not low <= value <= high:
            detail = f"must be between {low:g} and {high:g} where distribution is {self.distribution}, not {value!r}"
            raise refusal(detail, f"/{name}")

    @classmethod
    def chosen(cls, document: dict[str, Any], name: str, value: str) -> dict[str, Any]:
        """Another distribution has a peak as wide."""
        material = document | {name: value}
        if name != "distribution":
            return material
        before = {each: document.get(each, cls.model_fields[each].default) for each in (name, "alpha", "gamma")}
        gamma = _inside(before["gamma"], GAMMA_RANGES.get(cast(Distribution, value), ANY_GAMMA))
        if "gamma" in document or gamma != before["gamma"]:
            material["gamma"] = gamma
        if not isinstance(before["alpha"], dict):
            alpha = same_width(before[name], before["alpha"], before["gamma"], value, gamma)
            material["alpha"] = rounded(_inside(alpha, ALPHA_RANGES[cast(Distribution, value)]), 3)
        return material

    @classmethod
    def taken(cls, old: dict[str, Any], made: dict[str, Any]) -> set[str]:
        """A metal with a complex index is a conductor."""
        if old.get("metallic") == 1 and {"conductor_eta", "conductor_k"} <= made.keys():
            made["fresnel"] = "conductor"
        return set()

    @property
    def alpha_range(self) -> Range:
        """The range of alpha; a texture's values are clamped to it."""
        return ALPHA_RANGES[self.distribution]


def _sgd(slope: float, gamma: float) -> float:
    if gamma == 0:
        return 1 / (slope + 2)
    return 2 / (math.sqrt(1 + 4 * gamma * (slope + 2)) - 1) * gamma


def same_width(before: str, alpha: float, gamma: float, after: str, gamma_after: float) -> float:
    """The alpha with which the peak of `after` is as wide as that of `before`, two distributions; it may be out of
    range."""
    slope = max(_PEAKS[before][0](alpha, gamma), _FLATTEST)
    return _PEAKS[after][1](slope, gamma_after)
