"""Lights without extent. Area lights are shapes whose material has an emission."""

from __future__ import annotations

from typing import Annotated, Literal

from service.scene.base import Model, hint
from service.scene.color import Radiometric
from service.scene.numbers import Point


class PointLight(Model):
    """Shines equally in all directions, with 1/d^2; its shadows are sharp."""

    type: Literal["point"]
    position: Annotated[Point, hint("Position", "Where the light stands.", unit="m", widget="number")]
    intensity: Annotated[
        Radiometric,
        hint("Intensity", "The irradiance it gives 1 m away; an isotropic lamp of P watts has P / (4 pi).",
             unit="W/sr", widget="color", soft=100),
    ]
