"""The highlight of a small lamp on clear glass, which is picked more often than its share of the light."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import Renderer
from gpu.device import scene as device_scene
from tests.rendering import document, picture

SCENE = document(
    [
        {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "glass"},
        {"type": "sphere", "center": [2, 3, 3], "radius": 0.4, "material": "lamp"},
        {"type": "quad", "origin": [-9, -1, 9], "u": [18, 0, 0], "v": [0, 0, -18], "material": "floor"},
    ],
    {
        "glass": {"type": "principled", "base_color": 1, "transmission": 1, "roughness": 0, "ior": 1.5},
        "lamp": {"type": "diffuse", "albedo": 0, "emission": 60},
        "floor": {"type": "diffuse", "albedo": 0.5},
    },
)
SETTINGS = {"width": 96, "height": 96, "max_bounces": 8, "caustics": "paths"}


def test_a_lamp_in_glass_holds_a_tenth_of_its_variance(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its mean stays what it is."""
    now = picture(gpu, SCENE, 256, **SETTINGS)
    variance, color = now.read("variance").sum(axis=2), now.read()[..., :3]
    monkeypatch.setattr(device_scene, "GLINT_CHANCE", 0.0)
    before = picture(gpu, SCENE, 256, **SETTINGS)
    old, old_color = before.read("variance").sum(axis=2), before.read()[..., :3]
    ball = np.hypot(*np.meshgrid(*[np.linspace(-1, 1, 96)] * 2)) < 0.6
    bright = ball & (old_color.max(axis=2) > 0.1 * old_color[ball].max())
    assert 3 <= bright.sum() < 60
    assert variance[bright].sum() < 0.15 * old[bright].sum()
    error = np.sqrt(variance[bright].sum() + old[bright].sum())
    assert abs(color[bright].sum() - old_color[bright].sum()) < 4 * 3 * error
