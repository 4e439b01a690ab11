"""Lights that are not shapes. Area lights are shapes whose material has an emission."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, PlainValidator, model_validator

from service.document.base import Name, Named, dial, entry, picker, refusal
from service.document.color import Color
from service.document.numbers import Direction, Point
from service.document.photometry import SPHERE, Flux, strength, strength_schema

Intensity = Annotated[Color, PlainValidator(strength("candela", "lumen")), strength_schema("candela", "lumen")]
Irradiance = Annotated[Color, PlainValidator(strength("lux")), strength_schema("lux")]
HalfAngle = Annotated[float, Field(ge=0, le=90)]


class _Light(Named):
    name: Name = None


class PointLight(_Light):
    """Shines equally in all directions, with 1/d^2; its shadows are sharp."""

    type: Literal["point"]
    position: Annotated[Point, entry("Position", "Where the light stands.")]
    intensity: Annotated[
        Intensity,
        picker("Intensity", "How bright it is: the light that falls on a surface 1 m away.", unit="W/sr", soft=100),
    ]

    @model_validator(mode="after")
    def _shines_all_around(self) -> Self:
        if isinstance(self.intensity, Flux):
            object.__setattr__(self, "intensity", self.intensity.over(SPHERE))
        return self


class SpotLight(_Light):
    """A point that shines into a cone: full inside the inner angle, fading to nothing at the outer."""

    type: Literal["spot"]
    position: Annotated[Point, entry("Position", "Where the light stands.")]
    direction: Annotated[Direction, entry("Direction", "The direction in which the beam points.", unit="")]
    intensity: Annotated[
        Intensity,
        picker(
            "Intensity",
            "How bright it is: the light that falls on a surface 1 m away, in the middle of the beam.",
            unit="W/sr",
            soft=100,
        ),
    ]
    inner_angle: Annotated[
        HalfAngle, dial("Inner angle", "From the middle of the beam to where the light begins to fade.")
    ]
    outer_angle: Annotated[
        HalfAngle,
        dial(
            "Outer angle",
            "From the middle of the beam to where nothing is left. The same as the inner angle gives a sharp edge.",
        ),
    ]

    @model_validator(mode="after")
    def _fades_outwards(self) -> Self:
        if self.inner_angle > self.outer_angle:
            detail = f"must be at most outer_angle, which is {self.outer_angle!r}, not {self.inner_angle!r}"
            raise refusal(detail, at="/inner_angle")
        if isinstance(self.intensity, Flux):
            inner, outer = (math.cos(math.radians(angle)) for angle in (self.inner_angle, self.outer_angle))
            # Between the two cosines it fades along a curve that is symmetric about its middle.
            beam = 2 * math.pi * (1 - (inner + outer) / 2)
            if beam <= 0:
                raise refusal("a beam without an angle has no flux: give candela", at="/intensity")
            object.__setattr__(self, "intensity", self.intensity.over(beam))
        return self


class DirectionalLight(_Light):
    """Light from infinity, such as the sun's: parallel, or from a disk in the sky where it has a diameter."""

    type: Literal["directional"]
    direction: Annotated[Direction, entry("Direction", "The direction in which the light travels.", unit="")]
    irradiance: Annotated[
        Irradiance,
        picker(
            "Irradiance",
            "How bright the light is on a surface that faces it. The sun at noon gives about 1000.",
            unit="W/m^2",
            soft=10,
        ),
    ]
    angular_diameter: Annotated[
        float,
        Field(ge=0, le=90),
        dial(
            "Angular diameter",
            "How large the light looks: 0 gives sharp shadows, 0.53 is the sun, more is softer. Brightness stays.",
            soft=10,
        ),
    ] = 0.0


Light = Annotated[PointLight | SpotLight | DirectionalLight, Field(discriminator="type")]
