"""A candle that has burnt for a while: wax with a pool and drips, a flame, a plate with a rim."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.mesh import Mesh, denser, filleted, lathe, on_the_right, smooth

RADIUS, TALL = 0.24, 0.8  # metres
WICK = 0.62  # height of the melted wax about the wick
DRIPS = ((0.4, 0.5), (1.5, 0.3), (2.9, 0.62), (4.1, 0.38), (5.2, 0.55))  # the angle of each, and how far down it came
FLAME, FOOT = 0.3, 0.1  # heights of the flame and of its blue foot


def wax() -> bytes:
    """It stands on y = 0.001; its pool is 2 cm below the rim."""
    mesh = Mesh()
    line = filleted([
        (0, 0.001, 0), (RADIUS, 0.001, 0.02), (RADIUS, 0.2, 0.05), (RADIUS, 0.4, 0.05), (RADIUS, 0.6, 0.05),
        (RADIUS, TALL, 0.03), (RADIUS - 0.055, TALL, 0.022), (RADIUS - 0.075, TALL - 0.05, 0.05),
        (0.0, TALL - 0.055, 0),
    ], steps=5)  # fmt: skip
    # Drips bend what would be straight.
    points = denser(line[0], 0.025)
    lathe(mesh, (points, on_the_right(points)), around=144, shape=_ran)
    return mesh.file()


def _ran(angles: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Wax that ran down, thick at its lower end."""
    grown = np.zeros(np.broadcast_shapes(angles.shape, heights.shape))
    for at, length in DRIPS:
        apart = np.abs((angles - at + math.pi) % (2 * math.pi) - math.pi) * RADIUS
        end = TALL - length
        along = np.clip((heights - end) / 0.05, 0, 1) ** 0.5
        fat = 0.034 + 0.026 * np.exp(-(((heights - end - 0.045) / 0.04) ** 2))
        grown += fat * along * np.exp(-((apart / 0.03) ** 2))
    fade = np.clip((TALL - 0.005 - heights) / 0.05, 0, 1)
    return np.asarray(1 + grown / RADIUS * fade + 0.006 * np.sin(3 * angles + 5 * heights))


def flame() -> bytes:
    """The outer flame from y = 0 up, pointed above."""
    return _turned(
        [(0.0, 0.0), (0.032, 0.012), (0.056, 0.06), (0.06, 0.11), (0.044, 0.19), (0.018, 0.26), (0.0, FLAME)]
    )


def flame_foot() -> bytes:
    """The blue part round the wick."""
    return _turned([(0.0, -0.008), (0.036, 0.0), (0.062, 0.045), (0.056, 0.075), (0.03, 0.09), (0.0, FOOT)])


def _turned(points: list[tuple[float, float]]) -> bytes:
    mesh = Mesh()
    lathe(mesh, smooth(points), around=48)
    return mesh.file()


def plate() -> bytes:
    """A dish whose rim rises; the candle stands on 0.03."""
    mesh = Mesh()
    lathe(mesh, filleted([
        (0, 0.006, 0), (0.3, 0.006, 0.004), (0.31, 0.001, 0.004), (0.34, 0.001, 0.01), (0.37, 0.012, 0.06),
        (0.56, 0.075, 0.011), (0.55, 0.1, 0.011), (0.36, 0.03, 0.06), (0, 0.03, 0),
    ], steps=5), around=128)  # fmt: skip
    return mesh.file()
