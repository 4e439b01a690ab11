"""The share of light beyond n bounces, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, bounced_paths, missing_light
from service import presets
from tests.rendering import document, picture

LIMITS = (0, 3, 5, 8, 16, 64)
SMALL = RenderSettings(48, 24, max_bounces=2)


def shares(gpu: Renderer, scene: dict, **settings: object) -> dict[int, float]:
    """Of that scene as it was loaded for another picture."""
    made = picture(gpu, scene, 1, **{"width": 48, "height": 24, **settings})
    before = made.read().copy()
    steps = missing_light(gpu, made.scene, made.settings, LIMITS)
    count = 0
    try:
        while True:
            next(steps)
            count += 1
    except StopIteration as end:
        found: dict[int, float] = end.value
    assert count >= len(LIMITS) and np.array_equal(made.read(), before)
    made.release()
    made.scene.release()
    return found


@pytest.mark.parametrize("albedo", [0.2, 0.5, 0.8])
def test_inside_a_glowing_sphere(gpu: Renderer, albedo: float) -> None:
    """Each bounce hands on `albedo` of the light, so that albedo^(n + 1) of it comes later than the nth."""
    material = {"type": "diffuse", "albedo": albedo, "emission": 2, "emission_sides": "both"}
    sphere = {"type": "sphere", "center": [0, 0, 0], "radius": 9, "material": "m"}
    found = shares(gpu, document([sphere], {"m": material}), estimator="bsdf", roulette_depth=100)
    assert found == pytest.approx({n: albedo ** (n + 1) for n in LIMITS}, abs=2e-6 + albedo**65)


def test_more_bounces_than_the_deepest_are_the_measure(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gpu.analysis.path_truncation.DEEPEST", 5)
    material = {"type": "diffuse", "albedo": 0.5, "emission": 2, "emission_sides": "both"}
    sphere = {"type": "sphere", "center": [0, 0, 0], "radius": 9, "material": "m"}
    found = shares(gpu, document([sphere], {"m": material}), estimator="bsdf", roulette_depth=100)
    assert found[5] == pytest.approx(0.5**6, abs=2e-6) and found[64] == 0


def test_what_has_no_light_misses_none(gpu: Renderer) -> None:
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
    assert shares(gpu, document([ball])) == dict.fromkeys(LIMITS, 0.0)


def test_a_room_agrees_with_long_renders(gpu: Renderer) -> None:
    room = presets.get("scenes", "cornell-boxes")
    found = shares(gpu, room, max_bounces=8)
    light = {}
    for bounces in (3, 8, 64):
        made = picture(gpu, room, 512, max_bounces=bounces, seed=7, width=64, height=64, filter="blackman_harris")
        light[bounces] = made.read()[..., :3].mean()
        made.release()
        made.scene.release()
    for bounces in (3, 8):
        assert found[bounces] == pytest.approx(1 - light[bounces] / light[64], abs=0.01)
    assert found[3] > 0.01 and list(found.values()) == sorted(found.values(), reverse=True) and found[64] == 0


def test_its_paths_are_counted() -> None:
    assert bounced_paths([3, 8]) == bounced_paths([8, 64, 3]) == 3 * 4096 * 16
