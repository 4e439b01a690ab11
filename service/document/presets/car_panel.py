"""The flank of a car: a door and a fender with a crease along them, and the gap between."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.mesh import Mesh, bent_normals

DOOR, FENDER = (-3.4, 0.44), (0.46, 3.4)  # metres along the car; the gap lies in between
EDGE = 0.03  # depth to which the sheet is bent inward at the gap
ACROSS = 150  # points over the height


def door() -> bytes:
    return _panel(DOOR, gap=1)


def fender() -> bytes:
    return _panel(FENDER, gap=0)


def _flank(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Points over places along the car and 0..1 from the sill to the shoulder, which leans back to the bonnet."""
    y = 1.15 * v
    crease = 0.74 + 0.035 * x - 0.004 * x**2
    over, under = np.maximum(y - crease, 0), np.maximum(crease - y, 0)
    # Hollow below the crease, round above it; the crease itself is bent over half a centimetre.
    z = 0.18 - 0.62 * over**2 - 0.9 * over**4 - 0.34 * (1 - np.exp(-under / 0.1)) * 0.3
    z += 0.1 * np.exp(-(((y - 0.32) / 0.26) ** 2)) - 0.35 * np.maximum(0.12 - y, 0)
    z += 0.02 * np.cos(x * 0.6) - 0.012 * x**2
    z += 0.1 * np.exp(-(((x - 1.5) / 0.75) ** 2) - ((y - 0.5) / 0.34) ** 2)  # over the wheel
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _panel(span: tuple[float, float], gap: int) -> bytes:
    """`gap`: the end (0 or 1) at which it is bent inward."""
    mesh = Mesh()
    x = np.linspace(*span, 64)
    v = np.linspace(0, 1, ACROSS)
    edge = span[gap]
    rows = [_flank(np.full(1, place)[:, None], v)[0] for place in x]
    turn = np.linspace(0, math.pi / 2, 6)[1:]
    radius = 0.007
    fold = []
    for angle in turn:
        step = radius * math.sin(angle) * (1 if gap else -1)
        row = _flank(np.full(1, edge)[:, None], v)[0] + [step, 0, -radius * (1 - math.cos(angle))]
        fold.append(row)
    fold.append(fold[-1] - [0, 0, EDGE])
    rows = rows + fold if gap else fold[::-1] + rows
    grid = np.array(rows)
    rough = np.broadcast_to([0.0, 0.2, 1.0], grid.shape).copy()
    side = slice(len(x), None) if gap else slice(0, len(fold))
    rough[side] = [1.0 if gap else -1.0, 0, 0.3]
    mesh.add(grid, bent_normals(grid, rough), grid[..., :2])
    return mesh.file()
