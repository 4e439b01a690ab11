"""A camera for a file that has none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.formats.types import Doubles

Bounds = tuple[Doubles, Doubles]  # the least and the greatest coordinates (3,)
FRAMED_VFOV = 35.0  # degrees
FLAT = 0.15  # share of the greatest extent below which a wall is seen from the front, a floor from above
MARGIN = 1.06


def framed(bounds: Bounds) -> dict[str, Any]:
    """A camera that shows everything in a square picture, from the front, a little from the side and from above."""
    low, high = bounds
    extent = high - low
    azimuth, elevation = 30.0, 15.0
    if extent[2] < FLAT * extent.max():
        azimuth, elevation = 0.0, 0.0
    elif extent[1] < FLAT * extent.max():
        elevation = 40.0
    a, e = math.radians(azimuth), math.radians(elevation)
    back = np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
    right = np.array([math.cos(a), 0, -math.sin(a)])
    axes = np.stack([right, np.cross(back, right), back])
    middle = (low + high) / 2
    corners = (np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3) - middle) @ axes.T
    slope = math.tan(math.radians(FRAMED_VFOV / 2)) / MARGIN
    distance = float((np.abs(corners[:, :2]).max(axis=1) / slope + corners[:, 2]).max()) or 1.0
    return {"position": (middle + back * distance).tolist(), "target": middle.tolist(), "vfov": FRAMED_VFOV}
