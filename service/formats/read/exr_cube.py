"""Six faces of a cube, as OpenEXR stacks them -> a latitude-longitude image. Runs in the parsing child."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.types import AssetLimits, Floats

FORMAT = "CubeFace Environment"  # OpenImageIO's `textureformat` of such a file
TOLD = "its six faces of a cube are shown as a latitude-longitude image"
SMALL = 512  # texels a side: each texel of a smaller cube's image is a mean of four, as suns may be one texel wide
ROWS = 32  # at a time
# For each face from the top: the axis in its middle, and those to its right and to its bottom, seen from inside.
# +Z is in the middle of OpenEXR's latitude-longitude images, as -Z is in that of ours.
FACES = (
    ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    ((-1, 0, 0), (0, 0, -1), (0, -1, 0)),
    ((0, 1, 0), (1, 0, 0), (0, 0, -1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    ((0, 0, 1), (-1, 0, 0), (0, -1, 0)),
    ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
)


def latitude_longitude(strip: Floats, limits: AssetLimits) -> Floats:
    """The image of (6 n, n, channels) texels, whose outermost middles lie on the cube's edges. Raises ParseError."""
    height, side = strip.shape[:2]
    if height != 6 * side:
        raise ParseError(
            f"its header says that it is a cube map; {side} x {height} texels are not six squares in a column"
        )
    rows = max(min(2 * side, math.isqrt(limits.max_texels // 2)), 1)
    fine = 2 if side <= SMALL else 1
    faces = strip.reshape(6, side, side, -1)
    out = np.empty((rows, 2 * rows, strip.shape[2]), np.float32)
    for first in range(0, rows, ROWS):
        some = out[first : first + ROWS]
        seen = np.zeros(some.shape, np.float64)
        for j in range(fine):
            latitude = math.pi * (0.5 - (first + np.arange(len(some)) + (j + 0.5) / fine) / rows)
            for i in range(fine):
                longitude = math.pi * (1 - (np.arange(2 * rows) + (i + 0.5) / fine) / rows)
                seen += _seen(faces, latitude[:, None], longitude[None, :])
        some[:] = seen / fine**2
    return out


def _seen(faces: Floats, latitude: npt.NDArray[np.float64], longitude: npt.NDArray[np.float64]) -> Floats:
    """What lies in these directions, between four texels of a face each."""
    side = faces.shape[1]
    level = np.cos(latitude)
    x, y, z = np.broadcast_arrays(np.sin(longitude) * level, np.sin(latitude), np.cos(longitude) * level)
    p = np.stack([x, y, z])
    axis = np.abs(p).argmax(axis=0)
    ahead = np.take_along_axis(p, axis[None], axis=0)[0]
    face = 2 * axis + (ahead < 0)
    right, down = (np.array([one[k] for one in FACES], float)[face] for k in (1, 2))
    column, row = (
        np.clip((np.einsum("hwk,khw->hw", way, p) / np.abs(ahead) + 1) / 2 * (side - 1), 0, side - 1)
        for way in (right, down)
    )
    left, top = (np.minimum(place.astype(int), max(side - 2, 0)) for place in (column, row))
    u, v = (column - left)[..., None], (row - top)[..., None]
    beside, below = (np.minimum(place + 1, side - 1) for place in (left, top))
    upper = faces[face, top, left] * (1 - u) + faces[face, top, beside] * u
    lower = faces[face, below, left] * (1 - u) + faces[face, below, beside] * u
    seen: Floats = upper * (1 - v) + lower * v
    return seen
