"""The direction along which a highlight is stretched, in the surface's own frame: x along growing u."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from service.document.base import refusal
from service.document.numbers import LARGEST, Vec3, check_number, described, vector_schema


def _tangent(value: Any) -> Vec3:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise refusal(f"must be three numbers like [1, 0, 0], not {described(value)}")
    x, y, z = (check_number(v, -LARGEST, LARGEST, name) for v, name in zip(value, "xyz", strict=True))
    if x == 0 and y == 0:
        raise refusal("must not be along the normal: x and y are both 0")
    return x, y, z


Tangent = Annotated[Vec3, PlainValidator(_tangent), WithJsonSchema(vector_schema(-LARGEST, LARGEST))]


def turn_of(tangent: Vec3) -> float:
    """Its angle in degrees, counter-clockwise from the surface's own."""
    return math.degrees(math.atan2(tangent[1], tangent[0]))
