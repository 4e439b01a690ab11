"""The transform of a shape: translate, rotate and scale, or a matrix."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from pydantic import Discriminator, PlainValidator, Tag, WithJsonSchema

from service.document.base import Model, dial, entry, refusal
from service.document.numbers import LARGEST, ZERO, Point, ScaleFactors, check_number, described, vector_schema

# The volume that the axes span once each has length one. Below it the inverse has no digit right in float32.
LEAST_VOLUME = 1e-7
VANISHING = 2.0**-150  # rounds to 0 in float32

Matrix = tuple[float, ...]


class Transform(Model):
    """T Rz Ry Rx S: scaled first, then turned about X, Y and Z, then moved."""

    translate: Annotated[Point, entry("Move", "Moves the thing along X, Y and Z.")] = ZERO
    rotate: Annotated[Point, dial("Rotate", "Turns the thing about X, then Y, then Z.", soft=(-180, 180))] = ZERO
    scale: Annotated[
        ScaleFactors,
        entry(
            "Scale",
            "How large the thing is: one factor, or one for each axis. Negative factors mirror it.",
            unit="",
            soft=(0.1, 10),
        ),
    ] = (1.0, 1.0, 1.0)

    def matrix4(self) -> np.ndarray:
        """World from object: (4, 4) float64."""
        x, y, z = (_rotation(axis, angle) for axis, angle in enumerate(self.rotate))
        matrix = np.eye(4)
        matrix[:3, :3] = z @ y @ x * np.array(self.scale)
        matrix[:3, 3] = self.translate
        return matrix


def _matrix(value: Any) -> Matrix:
    if not isinstance(value, list | tuple):
        raise refusal(f"must be 16 numbers, row by row, not {described(value)}")
    if len(value) != 16:
        raise refusal(f"must be 16 numbers, row by row, not {len(value)}")
    # Quick and without numpy: a model may have 60 000 transforms.
    if {*map(type, value)} <= {float, int} and abs(max(value, key=abs)) <= LARGEST:
        numbers = tuple(map(float, value))
    else:
        numbers = tuple(check_number(x, -LARGEST, LARGEST, f"number {i}") for i, x in enumerate(value))
    if numbers[12:] != (0, 0, 0, 1):
        raise refusal("must be affine: its last row is 0 0 0 1 (translation stands in numbers 3, 7 and 11)")
    x, y, z = (numbers[k:11:4] for k in range(3))  # the axes are the columns
    lengths = [math.hypot(*axis) for axis in (x, y, z)]
    volume = (
        x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) + x[2] * (y[0] * z[1] - y[1] * z[0])
    )
    if min(lengths) <= VANISHING or abs(volume) < LEAST_VOLUME * math.prod(lengths):
        raise refusal("must be invertible: this matrix makes every shape flat")
    return numbers


class MatrixTransform(Model):
    """An affine, invertible matrix that takes the shape to the world."""

    matrix: Annotated[
        Matrix,
        PlainValidator(_matrix),
        WithJsonSchema({**vector_schema(), "minItems": 16, "maxItems": 16}),
        entry("Matrix", "16 numbers, row by row; the last row is 0 0 0 1.", unit=""),
    ]

    def matrix4(self) -> np.ndarray:
        """World from object: (4, 4) float64."""
        return np.reshape(np.array(self.matrix, np.float64), (4, 4))


def _rotation(axis: int, degrees: float) -> np.ndarray:
    """Right-handed about one axis: (3, 3) float64. Quarter turns are exact, so a box stays on its grid."""
    quarter, rest = divmod(math.fmod(degrees, 360.0), 90.0)
    s, c = math.sin(math.radians(rest)), math.cos(math.radians(rest))
    for _ in range(int(quarter) % 4):
        s, c = c, -s
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def _form(value: Any) -> str:
    has_matrix = "matrix" in value if isinstance(value, dict) else isinstance(value, MatrixTransform)
    return MATRIX_TAG if has_matrix else PARTS_TAG


PARTS_TAG, MATRIX_TAG = "<parts>", "<matrix>"

AnyTransform = Annotated[
    Annotated[Transform, Tag(PARTS_TAG)] | Annotated[MatrixTransform, Tag(MATRIX_TAG)], Discriminator(_form)
]
