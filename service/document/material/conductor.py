"""The complex index of a metal, n + i k, per channel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from service.document.color import Color
from service.document.numbers import LARGEST, check_number, is_number, vector, vector_schema

LEAST_INDEX = 1e-30  # of a conductor: above 0 in single precision, too


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


ConductorIndex = Annotated[Color, PlainValidator(_per_channel(LEAST_INDEX)), _per_channel_schema(LEAST_INDEX)]
Extinction = Annotated[Color, PlainValidator(_per_channel(0.0)), _per_channel_schema(0.0)]
