"""Colours: three linear Rec.709 numbers, one number for grey, or "#rrggbb" in sRGB. Validation gives linear
triples."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from service.colorimetry import decode_srgb
from service.scene.base import refusal
from service.scene.numbers import BRIGHTEST, check_number, described, is_number, vector_schema

Color = tuple[float, float, float]
HEX = "^#[0-9a-fA-F]{6}$"
FORMS = 'a colour is [r, g, b] (linear), one number (grey) or "#rrggbb" (sRGB)'


LINEAR_OF_BYTE = [float(decode_srgb(byte / 255)) for byte in range(256)]


def color(high: float) -> Callable[[Any], Color]:
    """A validator: a colour whose channels are from 0 to `high`."""

    def validate(value: Any) -> Color:
        if isinstance(value, str):
            return _from_hex(value)
        if is_number(value):
            grey = check_number(value, 0, high)
            return grey, grey, grey
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


def _schema(high: float) -> WithJsonSchema:
    grey = {"type": "number", "minimum": 0, "maximum": high}
    return WithJsonSchema({"anyOf": [vector_schema(0, high), grey, {"type": "string", "pattern": HEX}]})


Reflectance = Annotated[Color, PlainValidator(color(1)), _schema(1)]
Factors = Annotated[Color, PlainValidator(color(BRIGHTEST)), _schema(BRIGHTEST)]
Radiometric = Annotated[Color, PlainValidator(color(BRIGHTEST)), _schema(BRIGHTEST)]
