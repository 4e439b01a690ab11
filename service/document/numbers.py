"""Numbers and vectors with the ranges of the contract: booleans are no numbers, NaN and infinity in no range. Long
arrays of rows are checked by numpy: 100 000 of them take tens of milliseconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import ROUND_HALF_UP, Context, Decimal
from functools import partial
from itertools import chain
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, PlainSerializer, PlainValidator, WithJsonSchema

from service.document.base import refusal

LARGEST = 1e9  # coordinates and lengths: their products stay well inside float32
BRIGHTEST = 1e20  # radiometric values: a product with any throughput does as well
Vec3 = tuple[float, float, float]
ZERO: Vec3 = (0.0, 0.0, 0.0)
LARGEST_INDEX = 2**31 - 1
WORDS = {2: "two", 3: "three", 4: "four"}


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


def _rows(value: Any, low: float, high: float, example: str, width: int = 3, to_number: bool = False) -> np.ndarray:
    """(n, width) float64, read-only. An error has the pointer of the first bad row; with `to_number` that of the bad
    number, where the rest of the row is right."""
    bounds = f"between {low:.10g} and {high:.10g}"
    if not isinstance(value, list | tuple | np.ndarray):
        raise refusal(f"must be an array of rows like {example}, not {described(value)}")
    if len(value) == 0:
        raise refusal(f"must not be empty: it holds rows like {example}")
    if not isinstance(value, np.ndarray):
        _check_kinds(value, example, width, to_number)
    try:
        array = np.array(value, np.float64)
    except (OverflowError, ValueError):  # a whole number beyond float64
        i, j = next((i, j) for i, row in enumerate(value) for j, x in enumerate(row) if abs(x) > high)
        raise refusal(f"must be {bounds}", at=_place(i, j, to_number)) from None
    good = (array >= low) & (array <= high)  # false for NaN
    if not good.all():
        i, j = np.argwhere(~good)[0].tolist()
        raise refusal(f"must be {bounds}, not {described(value[i][j])}", at=_place(i, j, to_number))
    array.flags.writeable = False
    return array


def _place(i: int, j: int, to_number: bool) -> str:
    return f"/{i}/{j}" if to_number else f"/{i}"


def _check_kinds(rows: Any, example: str, width: int, to_number: bool) -> None:
    # Sets of types take one pass in C; the fault is searched for only where there is one.
    good = (
        set(map(type, rows)) <= {list, tuple}
        and set(map(len, rows)) == {width}
        and set(map(type, chain.from_iterable(rows))) <= {int, float}
    )
    if not good:
        i, row = next((i, row) for i, row in enumerate(rows) if not _is_row(row, width))
        if to_number and isinstance(row, list | tuple) and len(row) == width:
            j, bad = next((j, x) for j, x in enumerate(row) if not is_number(x))
            raise refusal(f"must be a number, not {described(bad)}", at=f"/{i}/{j}")
        raise refusal(f"must be {WORDS[width]} numbers like {example}, not {_row_described(row, width)}", at=f"/{i}")


def _is_row(row: object, width: int) -> bool:
    return isinstance(row, list | tuple) and len(row) == width and all(map(is_number, row))


def _row_described(row: object, width: int) -> str:
    if not isinstance(row, list | tuple):
        return described(row)
    if len(row) != width:
        return str(len(row))
    return f"with {described(next(x for x in row if not is_number(x)))}"


def _points(value: Any) -> np.ndarray:
    return _rows(value, -LARGEST, LARGEST, "[0.5, 1, 0]")


def _directions(value: Any, to_number: bool = False) -> np.ndarray:
    array = _rows(value, -LARGEST, LARGEST, "[0, 1, 0]", to_number=to_number)
    lengths = np.abs(array).max(axis=1).astype(np.float32)
    if not lengths.all():
        raise refusal("must not be zero: a direction has a length", at=f"/{int(np.argmin(lengths))}")
    return array


def _coordinates(value: Any) -> np.ndarray:
    return _rows(value, -LARGEST, LARGEST, "[0.5, 1]", 2)


def _colors(value: Any) -> np.ndarray:
    rows = isinstance(value, list | tuple) and len(value) > 0
    opaque = not rows or not isinstance(value[0], list | tuple) or len(value[0]) != 4
    return _rows(value, 0, 1, "[0.5, 0.25, 1]" if opaque else "[0.5, 0.25, 1, 1]", 3 if opaque else 4)


def _indices(value: Any) -> np.ndarray:
    array = _rows(value, 0, LARGEST_INDEX, "[0, 1, 2]")
    whole = array == np.floor(array)
    if not whole.all():
        i, j = np.argwhere(~whole)[0].tolist()
        raise refusal(f"an index is a whole number, not {described(float(array[i, j]))}", at=f"/{i}")
    indices = array.astype(np.int32)
    indices.flags.writeable = False
    return indices


def first_beyond(indices: np.ndarray, count: int) -> int | None:
    """The first row with an index that is not below `count`."""
    bad = (indices >= count).any(axis=1)
    return int(np.argmax(bad)) if bad.any() else None


def _type(validate: Callable[[Any], np.ndarray], row: dict[str, Any]) -> Any:
    schema = {"type": "array", "items": row, "minItems": 1}
    return Annotated[
        np.ndarray, PlainValidator(validate), PlainSerializer(lambda array: array.tolist()), WithJsonSchema(schema)
    ]


_INDEX_ROW = {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 3, "maxItems": 3}
_COLOR_ROW = {"type": "array", "items": {"type": "number", "minimum": 0, "maximum": 1}, "minItems": 3, "maxItems": 4}
Points = _type(_points, vector_schema())
Directions = _type(_directions, vector_schema())
# The directions of a question, written by hand: an error has the pointer of the number.
QuestionDirections = _type(partial(_directions, to_number=True), vector_schema())
Triangles = _type(_indices, _INDEX_ROW)
Coordinates = _type(_coordinates, vector_schema(size=2))
Colors = _type(_colors, _COLOR_ROW)
