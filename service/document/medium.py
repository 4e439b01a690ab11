"""Media that fill closed shapes, or all space outside of bodies: absorption, scattering, emission along the way."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, PlainValidator, WithJsonSchema, model_validator

from service.document.base import OMITTABLE, Model, picker, refusal, slider
from service.document.color import Color, Reflectance, color, color_schema
from service.document.numbers import LARGEST
from service.document.photometry import Radiance

LEAST_RADIUS = 1 / LARGEST
LARGEST_G = 1 - 2.0**-24  # the largest mean cosine below 1 in single precision, of which there is a phase function
Coefficient = Annotated[Color, PlainValidator(color(LARGEST)), WithJsonSchema(color_schema(LARGEST))]


class Medium(Model):
    """A homogeneous medium, by its coefficients or by the colour and the mean free path that it shows."""

    absorption: Annotated[
        Coefficient,
        picker("Absorption", "The rate at which light is lost, per channel.", unit="1/m", soft=1000, log=0.01),
    ] = (0.0, 0.0, 0.0)
    scattering: Annotated[
        Coefficient,
        picker("Scattering", "The rate at which light turns, per channel.", unit="1/m", soft=1000, log=0.01),
    ] = (0.0, 0.0, 0.0)
    albedo: Annotated[
        Reflectance | None,
        OMITTABLE,
        picker(
            "Albedo",
            "The colour that much of it has. With a radius it replaces absorption and scattering.",
            absent="from absorption and scattering",
        ),
    ] = None
    radius: Annotated[
        Coefficient | None,
        OMITTABLE,
        picker(
            "Radius",
            "How far light goes, on average, before something happens to it, per channel.",
            unit="m",
            soft=1,
            log=1e-5,
            absent="from absorption and scattering",
        ),
    ] = None
    g: Annotated[
        float,
        Field(gt=-1, lt=1),
        slider(
            "Direction", "Where light goes when it is scattered: above 0 onwards, below 0 back.", soft=(-0.95, 0.95)
        ),
    ] = 0.0
    emission: Annotated[
        Radiance, picker("Emission", "The light that it gives off itself, for each metre.", unit="W/(m^3 sr)", soft=4)
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

    def extinction(self) -> Color:
        """The rate at which something happens to light, 1/m per channel."""
        if self.radius is not None:
            red, green, blue = (1 / r for r in self.radius)
        else:
            red, green, blue = (a + s for a, s in zip(self.absorption, self.scattering, strict=True))
        return red, green, blue

    def is_empty(self) -> bool:
        """True if light passes as through a vacuum."""
        return not any(self.extinction()) and not any(self.emission)
