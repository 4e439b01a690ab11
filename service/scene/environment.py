"""What surrounds the scene. None at all is black."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.scene.base import Model, hint, refusal
from service.scene.color import Radiometric
from service.scene.numbers import BRIGHTEST, Degrees, Factor


class _Surroundings(Model):
    rotation: Annotated[
        Degrees,
        hint("Rotation", "Turns the surroundings about the vertical, counter-clockwise seen from above.",
             unit="degrees", widget="angle", soft=(-180, 180)),
    ] = 0.0
    scale: Annotated[
        Factor,
        hint("Brightness", "Factor on the radiance; twice as much is one stop.", unit="", widget="slider", soft=4),
    ] = 1.0
    background: Annotated[
        bool,
        hint("Show as background", "Off: it lights the scene, but the camera sees black with alpha 0."),
    ] = True


class ConstantEnvironment(_Surroundings):
    """The same radiance from every direction."""

    type: Literal["constant"]
    radiance: Annotated[
        Radiometric,
        hint("Radiance", "The same from everywhere: a white furnace, or the light of a closed overcast.",
             unit="W/(m^2 sr)", widget="color", soft=4),
    ]

    @model_validator(mode="after")
    def _stays_finite(self) -> Self:
        if max(self.radiance) * self.scale > BRIGHTEST:
            raise refusal(f"radiance times scale must be at most {BRIGHTEST:g}", at="/scale")
        return self


class ImageEnvironment(_Surroundings):
    """A latitude-longitude image; -Z is in its middle."""

    type: Literal["image"]
    asset: Annotated[
        str,
        Field(min_length=1),
        hint("Image", "An HDR image of all directions: latitude-longitude, EXR or Radiance HDR."),
    ]


Environment = Annotated[ConstantEnvironment | ImageEnvironment, Field(discriminator="type")]
