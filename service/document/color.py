"""Colours: three linear Rec.709 numbers, one number for grey, "#rrggbb" in sRGB, or the temperature of a radiator.
Validation gives linear triples."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from service.colorimetry import decode_srgb, planck_color
from service.document.base import refusal
from service.document.numbers import BRIGHTEST, check_number, described, is_number, vector_schema

Color = tuple[float, float, float]
HEX = "^#[0-9a-fA-F]{6}$"
FORMS = 'a colour is [r, g, b] (linear), one number (grey), "#rrggbb" (sRGB) or {"kelvin": number}'
COLDEST, HOTTEST = 1000.0, 40000.0  # K


LINEAR_OF_BYTE = [float(decode_srgb(byte / 255)) for byte in range(256)]


def color(high: float) -> Callable[[Any], Color]:
    """A validator: a colour whose channels are from 0 to `high`."""

    def validate(value: Any) -> Color:
        if isinstance(value, str):
            return _from_hex(value)
        if is_number(value):
            grey = check_number(value, 0, high)
            return grey, grey, grey
        if isinstance(value, dict):
            return _from_temperature(value, high)
        if not isinstance(value, list | tuple):
            raise refusal(f"{FORMS}, not {described(value)}")
        if len(value) != 3:
            raise refusal(f"{FORMS}, not {len(value)} numbers")
        r, g, b = value
        return check_number(r, 0, high, "red"), check_number(g, 0, high, "green"), check_number(b, 0, high, "blue")

    return validate


def _from_hex(text: str) -> Color:
    if not re.fullmatch(HEX[1:-1], text):
        raise refusal(f"{FORMS}, with six hexadecimal digits, not {described(text)}")
    r, g, b = bytes.fromhex(text[1:])
    return LINEAR_OF_BYTE[r], LINEAR_OF_BYTE[g], LINEAR_OF_BYTE[b]


def _from_temperature(value: dict[str, Any], high: float) -> Color:
    if value.keys() != {"kelvin"}:
        raise refusal(f"{FORMS}, not another object")
    kelvin = check_number(value["kelvin"], COLDEST, HOTTEST, "kelvin")
    r, g, b = planck_color(kelvin)
    if max(r, g, b) > high:
        raise refusal(f"{kelvin:g} K of luminance 1 has {max(r, g, b):.3g} in a channel; at most {high:g} is allowed")
    return r, g, b


def color_schema(high: float) -> dict[str, Any]:
    """The JSON Schema of a colour."""
    grey = {"type": "number", "minimum": 0, "maximum": high}
    kelvin = {"type": "number", "minimum": COLDEST, "maximum": HOTTEST}
    warm = {"type": "object", "properties": {"kelvin": kelvin}, "required": ["kelvin"], "additionalProperties": False}
    return {"anyOf": [vector_schema(0, high), grey, {"type": "string", "pattern": HEX}, warm]}


def _schema(high: float) -> WithJsonSchema:
    # No radiator of luminance 1 has all of its channels below 1.
    return WithJsonSchema(color_schema(high) if high > 1 else {"anyOf": color_schema(high)["anyOf"][:-1]})


Reflectance = Annotated[Color, PlainValidator(color(1)), _schema(1)]
Factors = Annotated[Color, PlainValidator(color(BRIGHTEST)), _schema(BRIGHTEST)]
Radiometric = Annotated[Color, PlainValidator(color(BRIGHTEST)), _schema(BRIGHTEST)]
