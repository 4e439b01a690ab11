"""Lights that are not shapes. Area lights are shapes whose material has an emission."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.scene.base import hint, refusal
from service.scene.color import Radiometric
from service.scene.named import Name, Named
from service.scene.numbers import Direction, Point

HalfAngle = Annotated[float, Field(ge=0, le=90)]


class _Light(Named):
    name: Name = None


class PointLight(_Light):
    """Shines equally in all directions, with 1/d^2; its shadows are sharp."""

    type: Literal["point"]
    position: Annotated[Point, hint("Position", "Where the light stands.", unit="m", widget="number")]
    intensity: Annotated[
        Radiometric,
        hint(
            "Intensity",
            "The irradiance it gives 1 m away; an isotropic lamp of P watts has P / (4 pi).",
            unit="W/sr",
            widget="color",
            soft=100,
        ),
    ]


class SpotLight(_Light):
    """A point that shines into a cone: full inside the inner angle, fading to nothing at the outer."""

    type: Literal["spot"]
    position: Annotated[Point, hint("Position", "Where the light stands.", unit="m", widget="number")]
    direction: Annotated[Direction, hint("Direction", "Where the beam points; any length.", unit="", widget="number")]
    intensity: Annotated[
        Radiometric,
        hint("Intensity", "Along the beam: the irradiance it gives 1 m away.", unit="W/sr", widget="color", soft=100),
    ]
    inner_angle: Annotated[
        HalfAngle,
        hint(
            "Inner angle", "From the beam's axis to where the light begins to fade.", unit="degrees", widget="angle"
        ),
    ]
    outer_angle: Annotated[
        HalfAngle,
        hint(
            "Outer angle",
            "From the beam's axis to where nothing is left; equal to the inner: a sharp edge.",
            unit="degrees",
            widget="angle",
        ),
    ]

    @model_validator(mode="after")
    def _fades_outwards(self) -> Self:
        if self.inner_angle > self.outer_angle:
            told = f"must be at most outer_angle, which is {self.outer_angle!r}, not {self.inner_angle!r}"
            raise refusal(told, at="/inner_angle")
        return self


class DirectionalLight(_Light):
    """Light from infinity, such as the sun's: parallel, or from a disk in the sky where it has a diameter."""

    type: Literal["directional"]
    direction: Annotated[
        Direction, hint("Direction", "The way the light travels; any length.", unit="", widget="number")
    ]
    irradiance: Annotated[
        Radiometric,
        hint(
            "Irradiance",
            "On a surface that faces the light; the sun at noon gives about 1000.",
            unit="W/m^2",
            widget="color",
            soft=10,
        ),
    ]
    angular_diameter: Annotated[
        float,
        Field(ge=0, le=90),
        hint(
            "Angular diameter",
            "0: sharp shadows; 0.53: the sun's; more is softer, the brightness stays.",
            unit="degrees",
            widget="angle",
            soft=10,
        ),
    ] = 0.0


Light = Annotated[PointLight | SpotLight | DirectionalLight, Field(discriminator="type")]
