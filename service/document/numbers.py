"""Numbers and vectors with the ranges of the contract: booleans are no numbers, NaN and infinity in no range."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import ROUND_HALF_UP, Context, Decimal
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from service.document.base import refusal

LARGEST = 1e9  # coordinates and lengths: their products stay well inside float32
BRIGHTEST = 1e20  # radiometric values: a product with any throughput does as well

Vec3 = tuple[float, float, float]


def _not_vanishing(value: float) -> float:
    if np.float32(value) == 0.0:
        raise refusal(f"{value!r} is zero in single precision: must be at least 1e-45")
    return value


Cosine = Annotated[float, Field(gt=0, le=1), AfterValidator(_not_vanishing)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Thickness = Annotated[float, Field(ge=0, le=10000)]
RefractiveIndex = Annotated[float, Field(ge=1, le=4)]
Coordinate = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Length = Annotated[float, Field(ge=0, le=LARGEST)]
PositiveLength = Annotated[float, Field(gt=0, le=LARGEST), AfterValidator(_not_vanishing)]
Factor = Annotated[float, Field(ge=0, le=BRIGHTEST)]
Degrees = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]


def is_number(value: object) -> bool:
    return type(value) is float or type(value) is int


def check_number(value: Any, low: float, high: float, name: str = "") -> float:
    """`value` as a float. Raises an error unless it is a number within the range, called `name` if there are
    several."""
    subject = name and name + " "
    if not is_number(value):
        raise refusal(f"{subject}must be a number, not {described(value)}")
    if not low <= value <= high:
        if value != value or value in (math.inf, -math.inf):
            raise refusal(f"{subject}must be finite, not {described(value)}")
        raise refusal(f"{subject}must be between {low:g} and {high:g}, not {described(value)}")
    return float(value)


def rounded(value: float, digits: int) -> float:
    """`value` to so many digits that count, halves upwards, as JavaScript's toPrecision has it."""
    return float(Context(prec=digits, rounding=ROUND_HALF_UP).create_decimal(Decimal(value)))


def described(value: object) -> str:
    """A short name of a JSON value for an error message."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if value != value else "infinity" if value > 0 else "-infinity"
    if isinstance(value, int) and abs(value) >= 10**17:
        return f"a whole number of {value.bit_length()} bits"  # its digits could fill a page
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return f"the text {value!r}" if len(value) <= 40 else "a text"
    return "an object" if isinstance(value, dict) else "an array"


def vector(low: float = -LARGEST, high: float = LARGEST, example: str = "[0, 1, 0]") -> Callable[[Any], Vec3]:
    """A validator: three numbers from `low` to `high`."""

    def validate(value: Any) -> Vec3:
        if not isinstance(value, list | tuple):
            raise refusal(f"must be three numbers like {example}, not {described(value)}")
        if len(value) != 3:
            raise refusal(f"must be three numbers like {example}, not {len(value)}")
        x, y, z = value
        return check_number(x, low, high, "x"), check_number(y, low, high, "y"), check_number(z, low, high, "z")

    return validate


def vector_schema(low: float = -LARGEST, high: float = LARGEST, size: int = 3) -> dict[str, Any]:
    return {
        "type": "array",
        "items": {"type": "number", "minimum": low, "maximum": high},
        "minItems": size,
        "maxItems": size,
    }


def _direction(value: Any) -> Vec3:
    v = vector()(value)
    if np.float32(math.hypot(*v)) == 0.0:
        raise refusal("must not be zero: a direction has a length")
    return v


def _scale(value: Any) -> Vec3:
    if isinstance(value, list | tuple):
        scale = vector(example="[1, 1, 1]")(value)
    else:
        factor = check_number(value, -LARGEST, LARGEST)
        scale = (factor, factor, factor)
    if any(np.float32(s) == 0.0 for s in scale):
        raise refusal("must not be zero on any axis: the shape would be flat; a negative factor mirrors")
    return scale


Point = Annotated[Vec3, PlainValidator(vector()), WithJsonSchema(vector_schema())]
Direction = Annotated[Vec3, PlainValidator(_direction), WithJsonSchema(vector_schema())]
ScaleFactors = Annotated[
    Vec3,
    PlainValidator(_scale),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": -LARGEST, "maximum": LARGEST}, vector_schema()]}),
]
