"""Latitude-longitude pictures: the directions of their texels, and shapes of light to paint on them."""

from __future__ import annotations

import math

import numpy as np

WIDTH, HEIGHT = 512, 256  # .7 degrees a texel: a softbox's edge is sharp enough, and a file has 0.8 MB


def directions() -> np.ndarray:
    """(HEIGHT, WIDTH, 3): where texel centres lie. Row 0 is straight up, the middle column is -Z."""
    azimuth = ((np.arange(WIDTH) + 0.5) / WIDTH - 0.5) * 2 * math.pi
    polar = (np.arange(HEIGHT)[:, None] + 0.5) / HEIGHT * math.pi
    x, y, z = np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def unit(x: float, y: float, z: float) -> np.ndarray:
    return np.array([x, y, z]) / math.sqrt(x * x + y * y + z * z)


def toward(azimuth_degrees: float, elevation_degrees: float) -> np.ndarray:
    """Unit direction; azimuth 0 is -Z, 90 is +X."""
    azimuth, elevation = math.radians(azimuth_degrees), math.radians(elevation_degrees)
    c = math.cos(elevation)
    return np.array([c * math.sin(azimuth), math.sin(elevation), -c * math.cos(azimuth)])
