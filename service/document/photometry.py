"""Strengths of lights in photometric units: {"candela": 800, "color": {"kelvin": 2700}}.

A value in such a unit is 683 times one in watts [CIE 018:2019] at any wavelength, as three numbers have no spectrum.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from pydantic import PlainValidator, WithJsonSchema

from service.colorimetry import LUMINANCE
from service.document.base import refusal
from service.document.color import Color, color, color_schema
from service.document.numbers import BRIGHTEST, check_number

EFFICACY = 683.0  # lm/W
SPHERE = 4 * math.pi  # sr
FORMS = frozenset({"kelvin", "candela", "lumen", "lux", "nit"})  # members of objects that stand for a colour


class Flux(NamedTuple):
    """Three channels of a flux, W; the light that has it knows into which solid angle it goes."""

    red: float
    green: float
    blue: float

    def over(self, solid_angle: float) -> Color:
        """W/sr, of a flux that fills `solid_angle` evenly."""
        return self.red / solid_angle, self.green / solid_angle, self.blue / solid_angle


def strength(*units: str) -> Callable[[Any], Color]:
    """A validator: a colour of any brightness, or a number in one of these units with the `color` that it has. Lumens
    give a Flux."""
    plain = color(BRIGHTEST)

    def validate(value: Any) -> Color:
        if not isinstance(value, dict) or "kelvin" in value:
            return plain(value)
        given = [name for name in value if name in units]
        if len(given) != 1 or value.keys() - {given[0], "color"}:
            known = " or ".join(f'{{"{unit}": number, "color": colour}}' for unit in units)
            raise refusal(f"an object here is {known}, with or without its color")
        unit = given[0]
        r, g, b = plain(value["color"]) if "color" in value else (1.0, 1.0, 1.0)
        seen = float(LUMINANCE @ (r, g, b))
        amount = check_number(value[unit], 0, BRIGHTEST, unit) / EFFICACY
        if seen <= 0:
            raise refusal("black has no luminance that could be scaled", at="/color")
        scaled = [x * amount / seen for x in (r, g, b)]
        if max(scaled) > BRIGHTEST:
            raise refusal(f"gives {max(scaled):.3g} in a channel; at most {BRIGHTEST:g} is allowed")
        return Flux(*scaled) if unit == "lumen" else (scaled[0], scaled[1], scaled[2])

    return validate


def strength_schema(*units: str) -> WithJsonSchema:
    """The JSON Schema of what `strength` takes."""
    tint = color_schema(BRIGHTEST)
    number = {"type": "number", "minimum": 0, "maximum": BRIGHTEST}
    objects = [
        {
            "type": "object",
            "properties": {unit: number, "color": tint},
            "required": [unit],
            "additionalProperties": False,
        }
        for unit in units
    ]
    return WithJsonSchema({"anyOf": [*tint["anyOf"], *objects]})


# What shines: W/(m^2 sr), or nits.
Radiance = Annotated[Color, PlainValidator(strength("nit")), strength_schema("nit")]
