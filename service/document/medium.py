"""Media that fill closed shapes, or all space outside of bodies: absorption, scattering, emission along the way."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Self

import numpy as np
from pydantic import Field, PlainValidator, WithJsonSchema, model_validator

from service.document.base import OMITTABLE, Model, hint, refusal
from service.document.color import Color, Reflectance, color, color_schema
from service.document.numbers import LARGEST
from service.document.photometry import Radiance

LEAST_RADIUS = 1 / LARGEST
LARGEST_G = 1 - 2.0**-24  # the largest mean cosine below 1 in single precision, of which there is a phase function
Coefficient = Annotated[Color, PlainValidator(color(LARGEST)), WithJsonSchema(color_schema(LARGEST))]
COSINES, STEPS = 64, 257


class Medium(Model):
    """A homogeneous medium, by its coefficients or by the colour and the mean free path that it shows."""

    absorption: Annotated[
        Coefficient,
        hint(
            "Absorption",
            "The rate at which light is lost, per channel.",
            unit="1/m",
            widget="color",
            soft=1000,
            log=0.01,
        ),
    ] = (0.0, 0.0, 0.0)
    scattering: Annotated[
        Coefficient,
        hint(
            "Scattering",
            "The rate at which light turns, per channel.",
            unit="1/m",
            widget="color",
            soft=1000,
            log=0.01,
        ),
    ] = (0.0, 0.0, 0.0)
    albedo: Annotated[
        Reflectance | None,
        OMITTABLE,
        hint(
            "Albedo",
            "The colour that much of it has. With a radius it replaces absorption and scattering.",
            unit="",
            widget="color",
            absent="from absorption and scattering",
        ),
    ] = None
    radius: Annotated[
        Coefficient | None,
        OMITTABLE,
        hint(
            "Radius",
            "How far light goes, on average, before something happens to it, per channel.",
            unit="m",
            widget="color",
            soft=1,
            log=1e-5,
            absent="from absorption and scattering",
        ),
    ] = None
    g: Annotated[
        float,
        Field(gt=-1, lt=1),
        hint(
            "Direction",
            "Where light goes when it is scattered: above 0 onwards, below 0 back.",
            unit="",
            widget="slider",
            soft=(-0.95, 0.95),
        ),
    ] = 0.0
    emission: Annotated[
        Radiance,
        hint(
            "Emission",
            "The light that it gives off itself, for each metre.",
            unit="W/(m^3 sr)",
            widget="color",
            soft=4,
        ),
    ] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _is_given_once(self) -> Self:
        if (self.albedo is None) != (self.radius is None):
            missing, other = ("radius", "albedo") if self.radius is None else ("albedo", "radius")
            raise refusal(f"is required beside {other}", at=f"/{missing}")
        if self.radius is not None:
            for name in ("absorption", "scattering"):
                if any(getattr(self, name)):
                    raise refusal(f"a medium has {name}, or albedo and radius, not both", at=f"/{name}")
            if min(self.radius) < LEAST_RADIUS:
                raise refusal(f"must be at least {LEAST_RADIUS:g} in every channel", at="/radius")
        return self

    def coefficients(self) -> tuple[Color, Color]:
        """Extinction and scattering, 1/m per channel."""
        if self.albedo is None or self.radius is None:
            red, green, blue = (a + s for a, s in zip(self.absorption, self.scattering, strict=True))
            return (red, green, blue), self.scattering
        red, green, blue = (1 / r for r in self.radius)
        share = [single_scattering_albedo(a, self.g) for a in self.albedo]
        return (red, green, blue), (red * share[0], green * share[1], blue * share[2])

    def is_empty(self) -> bool:
        """True if light passes as through a vacuum."""
        return not any(self.coefficients()[0]) and not any(self.emission)


def single_scattering_albedo(color: float, g: float) -> float:
    """The share of light that a medium scatters where it meets a particle, so that an index-matched half space of it
    shows `color` at normal incidence under a constant sky; all in [0, 1], g in (-1, 1).

    For g = 0 that is the inverse of 1 - H(1) sqrt(1 - albedo) with Chandrasekhar's H [1960, "Radiative transfer",
    section 38]; another g counts by the similarity relation, by which scattering counts 1 - g times.
    """
    shown, albedos = _half_space()
    alike = float(np.interp(color, shown, albedos))
    return alike / (1.0 - g + g * alike)


@cache
def _half_space() -> tuple[np.ndarray, np.ndarray]:
    """Colours of half spaces, and the albedos of single scattering that give them; both rise from 0 to 1."""
    root = np.linspace(1.0, 0.0, STEPS)  # sqrt(1 - albedo), in which the colour is almost straight
    albedos = 1.0 - root**2
    return 1.0 - h_function(albedos, 1.0) * root, albedos


def h_function(albedos: np.ndarray, mu: float) -> np.ndarray:
    """Chandrasekhar's H(mu), 0 < mu <= 1, of isotropic media with these albedos (n,) of single scattering.

    By 1 / H(mu) = sqrt(1 - albedo) + albedo / 2 int_0^1 x H(x) / (mu + x) dx, whose iteration converges for an albedo
    of 1, too.
    """
    nodes, weights = np.polynomial.legendre.leggauss(COSINES)
    x, weights = (nodes + 1.0) / 2.0, weights / 2.0
    root, half = np.sqrt(1.0 - albedos)[:, None], albedos[:, None] / 2.0
    kernel = weights * x / (x[:, None] + x)
    h = np.ones((len(albedos), COSINES))
    for _ in range(100):
        h = (h + 1.0 / (root + half * (h @ kernel.T))) / 2.0
    there: np.ndarray = 1.0 / (root[:, 0] + half[:, 0] * (h @ (weights * x / (mu + x))))
    return there
