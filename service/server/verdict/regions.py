"""Where two pictures differ: the smallest regions that the tests found, rectangles around those that are near, and
maps of them as 8-bit pictures.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from service.colorimetry import LUMINANCE
from service.server.verdict.decision import Level
from service.server.verdict.evidence import Array, blocks
from service.server.verdict.figures import displayed, flip_map
from service.views import MapKind

MOST = 64  # rectangles, those of the least p-values
CELLS = 256  # of a side, at most, of the grid on which near regions become one
STEPS = (-2, -1, 0, 1, 2)  # to cells that are near

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Region:  # in pixels
    x: Annotated[int, Field(description="Pixels from the left.")]
    y: Annotated[int, Field(description="Pixels from the top.")]
    width: int
    height: int
    p_value: float


def p_map(levels: list[Level], shape: tuple[int, int], alpha: float) -> Array:
    """(height, width): p-values of the pixels in regions below `alpha`, and 1 elsewhere. A region that holds a
    smaller one below `alpha` says nothing of its other pixels."""
    out = np.ones(shape)
    for level in sorted(levels, key=lambda level: level.side):
        known = blocks((out < alpha).astype(np.float64), level.side)
        new = np.where((level.p < alpha) & (known == 0), level.p, 1.0)
        out = np.minimum(out, spread(new, level.side, shape))
    return out


def regions(p: Array, alpha: float) -> list[Region]:
    """Rectangles of the pixels of a `p_map` that are below `alpha`, the most certain first."""
    height, width = p.shape
    side = -(-max(height, width) // CELLS)
    below = blocks((p < alpha).astype(np.float64), side) > 0
    found = []
    for top, left, bottom, right in _connected(below):
        part = p[top * side : bottom * side, left * side : right * side]
        rows, columns = np.nonzero(part < alpha)
        y, x = top * side + int(rows.min()), left * side + int(columns.min())
        high, wide = int(np.ptp(rows)) + 1, int(np.ptp(columns)) + 1
        found.append(Region(x, y, wide, high, float(part.min())))
    return sorted(found, key=lambda region: region.p_value)[:MOST]


def spread(values: Array, side: int, shape: tuple[int, int]) -> Array:
    """The value of each pixel's block."""
    return np.repeat(np.repeat(values, side, axis=0), side, axis=1)[: shape[0], : shape[1]]


def _connected(cells: Mask) -> Iterator[tuple[int, int, int, int]]:
    """First and last (exclusive) rows and columns of each group of cells between which there are gaps of one cell at
    most: within an object that changed some pixels are not certain."""
    left = {(int(y), int(x)) for y, x in np.argwhere(cells)}
    while left:
        group = [left.pop()]
        for y, x in group:
            near = {(y + dy, x + dx) for dy in STEPS for dx in STEPS} & left
            left -= near
            group += near
        rows, columns = [y for y, _ in group], [x for _, x in group]
        yield min(rows), min(columns), max(rows) + 1, max(columns) + 1


# Magma at equal steps, in bytes of sRGB; linear in between it is 5 % off at most [van der Walt and Smith 2015, CC0].
MAGMA = np.array(
    [
        (0, 0, 4), (16, 11, 45), (44, 17, 95), (81, 18, 124), (114, 31, 129), (147, 43, 128), (183, 55, 121),
        (216, 69, 108), (241, 96, 93), (252, 137, 97), (254, 176, 120), (254, 215, 153), (252, 253, 191),
    ],
    float,
)  # fmt: skip
FAINTEST = 0.35  # of the scale, of a p-value just below the threshold, so that it is seen
CERTAIN = 1e-12  # and less: the end of the scale
LEAST_SCALE = 1 / 255  # of the differences that are shown as the largest: smaller ones cannot be seen in a picture
OF_ALL = 99.9  # per cent of the pixels, whose differences the scale holds: one firefly does not darken the rest


def drawn(kind: MapKind, a: Array, b: Array, p: Array, alpha: float) -> npt.NDArray[np.uint8]:
    """(height, width, 3) of two pictures' mean radiance and their `p_map`.

    p: black where nothing is known to differ, brighter the more certain it is. difference: b - a as displayed, about
    a middle grey. flip: 0 to 1. heat: the difference in linear luminance, of any sign.
    """
    if kind == "difference":
        difference = displayed(b) - displayed(a)
        shown = 0.5 + 0.5 * np.clip(difference / _scale(np.abs(difference), LEAST_SCALE), -1, 1)
        return np.round(255 * shown).astype(np.uint8)
    if kind == "flip":
        return _coloured(flip_map(displayed(a), displayed(b)))
    if kind == "heat":
        heat = np.abs((b - a) @ LUMINANCE)
        return _coloured(heat / _scale(heat, 0.0))
    certain = min(CERTAIN, alpha / 10)
    share = np.log(alpha / np.maximum(p, certain)) / np.log(alpha / certain)
    return np.where((p < alpha)[..., None], _coloured(FAINTEST + (1 - FAINTEST) * share), 0).astype(np.uint8)


def _scale(values: Array, least: float) -> float:
    return max(float(np.percentile(values, OF_ALL)), least) or 1.0


def _coloured(values: Array) -> npt.NDArray[np.uint8]:
    steps = np.linspace(0, 1, len(MAGMA))
    shown = [np.interp(values, steps, MAGMA[:, channel]) for channel in range(3)]
    return np.round(np.stack(shown, axis=-1)).astype(np.uint8)
