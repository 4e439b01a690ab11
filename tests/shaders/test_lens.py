"""A lens: what is in focus is sharp, and all else blurs by as much as that of a thin lens."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gpu import Renderer
from tests.rendering import document, render

FOCUS, APERTURE, VFOV, SIDE = 4.0, 0.4, 40.0, 64  # metres, metres, degrees, pixels
PIXEL = 2 * math.tan(math.radians(VFOV / 2)) / SIDE  # its side, one metre away


@pytest.mark.parametrize("distance", [2.0, FOCUS, 8.0])
def test_a_disk_is_as_wide_as_a_thin_lens_shows_it(gpu: Renderer, distance: float) -> None:
    """A ray from the place o of the lens through the place t of the image, one metre away, meets a plane z metres
    away at z t + o (1 - z / f). Where that is uniform on a disk of radius r, and o on one of radius a, the mean
    square of t is (r^2 + a^2 (1 - z / f)^2) / 2 z^2; the pixel adds a sixth of its side's square."""
    radius = 0.05 * distance
    disk = {
        "type": "disk",
        "center": [0, 0, FOCUS - distance],
        "normal": [0, 0, 1],
        "radius": radius,
        "material": "m",
    }
    camera = {"position": [0, 0, FOCUS], "target": [0, 0, 0], "vfov": VFOV, "aperture_radius": APERTURE}
    scene = document([disk], {"m": {"type": "diffuse", "albedo": 0, "emission": 1}}, camera=camera)
    shown = render(gpu, scene, 256, max_bounces=0, width=SIDE, height=SIDE)[..., 0]
    places = (np.indices(shown.shape) + 0.5 - SIDE / 2) * PIXEL
    wide = (radius**2 + (APERTURE * (1 - distance / FOCUS)) ** 2) / (2 * distance**2) + PIXEL**2 / 6
    assert np.average((places**2).sum(axis=0), weights=shown) == pytest.approx(wide, rel=0.03)
