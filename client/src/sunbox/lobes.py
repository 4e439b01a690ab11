"""Values of a material's BSDF, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sunbox.errors import Refused

PAIRS = 65_536  # directions times directions that a server evaluates in one request
FLOATS = NDArray[np.float64]


@dataclass(frozen=True)
class SpecularLobe:
    """One direction that takes a share of the light by itself: a mirror's, or clear glass'. `wi` (3,); `weight` (3,)
    is what radiance is multiplied by, without eta^2; `probability` that sampling takes it."""

    wi: FLOATS
    weight: FLOATS
    probability: float


@dataclass(frozen=True)
class Bsdf:
    """`f` (n, m, 3) in 1/sr without the cosine and `pdf` (n, m) in 1/sr for n directions wo and m directions wi;
    `delta`: n lists of SpecularLobe, which f and pdf leave out."""

    f: FLOATS
    pdf: FLOATS
    delta: list[list[SpecularLobe]]


@dataclass(frozen=True)
class Albedo:
    """Directional albedo and its standard error, (n, 3) each."""

    albedo: FLOATS
    error: FLOATS


def directions(given: ArrayLike, pointer: str) -> FLOATS:
    """(n, 3), of one direction or rows of them. Raises Refused with the pointer."""
    rows = np.atleast_2d(np.asarray(given, np.float64))
    if rows.ndim != 2 or rows.shape[1] != 3 or not len(rows):
        detail = f"directions are rows of x, y, z: shape (n, 3), not {np.shape(given)}"
        raise Refused(detail, errors=[(pointer, detail)])
    return rows


def tiles(wo: FLOATS, wi: FLOATS) -> list[tuple[slice, slice]]:
    """Blocks of both lists that a server takes at a time."""
    columns = min(len(wi), PAIRS)
    rows = max(1, PAIRS // columns)
    return [
        (slice(i, i + rows), slice(j, j + columns))
        for i in range(0, len(wo), rows)
        for j in range(0, len(wi), columns)
    ]


def specular(answer: Any) -> list[list[SpecularLobe]]:
    return [
        [
            SpecularLobe(np.asarray(one["wi"], np.float64), np.asarray(one["weight"], np.float64), one["probability"])
            for one in each
        ]
        for each in answer
    ]
