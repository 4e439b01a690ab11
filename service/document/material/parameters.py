"""Parameters that several models share, and what is computed from them: dispersion, indices of metals, tangents."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import Field, PlainValidator, WithJsonSchema

from service.document.base import picker, refusal, slider
from service.document.color import Color
from service.document.numbers import LARGEST, Vec3, check_number, described, is_number, vector, vector_schema
from service.document.texture import AnyFraction, AnyReflectance

BaseColor = Annotated[
    AnyReflectance,
    picker(
        "Base colour",
        "The colour of the surface, or of a metal's reflection. Real surfaces lie between 0.03 and 0.9.",
        "Base",
    ),
]
Metallic = Annotated[
    AnyFraction, slider("Metallic", "0 is no metal, 1 is metal. Values between are for dust, rust or blends.", "Base")
]
Roughness = Annotated[
    AnyFraction, slider("Roughness", "0 is polished, 1 is matte.", "Base", highlight=("roughness", None))
]
# Dispersion by the Abbe number, (n_d - 1) / (n_F - n_C) at 587.56, 486.13 and 656.27 nm.
MOST_ABBE = 1e30  # of its inverse, which single precision holds; an index far less dispersed reaches its bounds
Abbe = Annotated[float, Field(gt=0, le=LARGEST)]
LEAST_CONDUCTOR = 1e-30  # of a conductor: above 0 in single precision, too


def dispersion(abbe: float | None, share: float = 1.0) -> float:
    """The share of the inverse Abbe number; 0 without any."""
    return 0.0 if abbe is None else share / max(abbe, 1 / MOST_ABBE)


def _per_channel(low: float) -> Callable[[Any], Color]:
    """A validator: three numbers, one a channel, or one for all."""

    def validate(value: Any) -> Color:
        if is_number(value):
            number = check_number(value, low, LARGEST)
            return number, number, number
        return vector(low, LARGEST, "[0.2, 0.9, 1.1]")(value)

    return validate


def _per_channel_schema(low: float) -> WithJsonSchema:
    return WithJsonSchema(
        {"anyOf": [vector_schema(low, LARGEST), {"type": "number", "minimum": low, "maximum": LARGEST}]}
    )


# The complex index of a metal, n + i k, per channel.
ConductorIndex = Annotated[Color, PlainValidator(_per_channel(LEAST_CONDUCTOR)), _per_channel_schema(LEAST_CONDUCTOR)]
Extinction = Annotated[Color, PlainValidator(_per_channel(0.0)), _per_channel_schema(0.0)]


def _tangent(value: Any) -> Vec3:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise refusal(f"must be three numbers like [1, 0, 0], not {described(value)}")
    x, y, z = (check_number(v, -LARGEST, LARGEST, name) for v, name in zip(value, "xyz", strict=True))
    if x == 0 and y == 0:
        raise refusal("must not be along the normal: x and y are both 0")
    return x, y, z


# The direction along which a highlight is stretched, in the surface's own frame: x along growing u.
Tangent = Annotated[Vec3, PlainValidator(_tangent), WithJsonSchema(vector_schema(-LARGEST, LARGEST))]


def turn_of(tangent: Vec3) -> float:
    """Its angle in degrees, counter-clockwise from the surface's own."""
    return math.degrees(math.atan2(tangent[1], tangent[0]))
