"""Shapes whose texture coordinates are known by heart, and a camera for one point of them."""

from __future__ import annotations

from typing import Any

import numpy as np

QUAD = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "m"}
BOX = {"type": "box", "min": [-1, -2, -3], "max": [1, 2, 3], "material": "m"}
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 2, "material": "m"}
BARE = {"type": "mesh", "material": "m", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}


def at(point: list[float], away: list[float], up: tuple[float, ...] = (0, 1, 0)) -> dict[str, Any]:
    """A camera that sees one place, from `away`."""
    return {"position": (np.array(point) + away).tolist(), "target": point, "up": list(up), "vfov": 0.01}


def on_ball(x: float, y: float, z: float) -> tuple[list[float], list[float]]:
    """The point of BALL in that direction, and its texture coordinates."""
    n = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    return (2 * n).tolist(), [0.5 + np.arctan2(x, z) / (2 * np.pi), 1 - np.arccos(n[1]) / np.pi]
