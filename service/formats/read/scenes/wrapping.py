"""Images beyond their edges: the document's words for it, and whether a mesh reads them there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

SLACK = 1e-3  # of an image's side; coordinates that are beyond its edge by less are roundings


def wrap_of(u: str, v: str) -> str | list[str]:
    """A texture's `wrap`: one word where both axes have it, else a pair."""
    return u if u == v else [u, v]


def goes_beyond(uvs: np.ndarray, placing: Mapping[str, Any]) -> tuple[bool, bool]:
    """True if a texture that lies so is read beyond 0..1 in u, and in v, by coordinates (n, 2); v points up."""
    low, high = uvs.min(axis=0), uvs.max(axis=0)
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 2).astype(np.float64)
    turn = math.radians(placing.get("rotation", 0.0))
    c, s = math.cos(turn), math.sin(turn)
    read = (corners * placing.get("scale", (1, 1))) @ np.array([[c, s], [-s, c]]) + placing.get("offset", (0, 0))
    beyond = (read.min(axis=0) < -SLACK) | (read.max(axis=0) > 1 + SLACK)
    return bool(beyond[0]), bool(beyond[1])
