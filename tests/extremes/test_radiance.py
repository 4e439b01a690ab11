"""Light from 1e-20 to 1e20, a million samples, a thousand bounces, one pixel, sixty stops: nothing drifts."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.settings import ESTIMATORS, TONE_MAPS
from tests.extremes.scenes import LIGHTS, LONG, Seen, ball, everything, icosphere, packed, quad, rows
from tests.marks import seldom
from tests.rendering import document, picture

POWERS = rows({"1e-20": 1e-20, "1e20": 1e20}, {"1e-10": 1e-10, "1e-4": 1e-4, "1e4": 1e4, "1e10": 1e10})


def _brighter(factor: float) -> dict[str, Any]:
    scene = everything(environment={"type": "constant", "radiance": 0.01 * factor})
    for light in scene["lights"]:
        for name in ("intensity", "irradiance"):
            if name in light:
                light[name] *= 0.01 * factor
    for material in scene["materials"].values():
        for name in ("emission", "ambient"):
            if name in material:
                material[name] = (np.array(material[name]) * 0.01 * factor).tolist()
    return scene


@pytest.fixture(scope="module")
def one(gpu: Renderer) -> Seen:
    return Seen(gpu, _brighter(1.0))


@pytest.mark.parametrize("row", POWERS)
def test_brighter_light_is_only_brighter(gpu: Renderer, one: Seen, row: str) -> None:
    other = Seen(gpu, _brighter(POWERS[row]))
    assert other.warnings == one.warnings
    assert all("caustics" in line for line in other.warnings), "no path is lost, nor cut"
    other.color /= POWERS[row]
    assert other.alike(one, 1e-4) > 0.99
    if 1e-18 < POWERS[row] < 1e18:  # of 1e40 float32 says 3e38, of 1e-48 it says 0; `noise` knows both
        other.variance /= POWERS[row] ** 2
        assert np.allclose(other.variance, one.variance, rtol=1e-2, atol=1e-6 * one.variance.max())


@cache
def _noise(gpu: Renderer, factor: float) -> float:
    made = picture(gpu, _brighter(factor), 8)
    noise = made.noise()
    made.release()
    made.scene.release()
    return noise


@pytest.mark.parametrize("row", POWERS)
def test_noise_is_relative(gpu: Renderer, row: str) -> None:
    assert _noise(gpu, POWERS[row]) == pytest.approx(_noise(gpu, 1.0), rel=1e-3)


@pytest.mark.parametrize("tone_map", TONE_MAPS)
def test_exposure_of_sixty_stops_shows_no_nan(gpu: Renderer, tone_map: str) -> None:
    for factor in (1e-20, 1e20):
        made = picture(gpu, _brighter(factor), 1)
        for exposure in (-60.0, 0.0, 60.0):
            shown = made.display(exposure=exposure, tone_map=tone_map, dtype="f4")
            assert np.isfinite(shown).all() and shown.min() >= 0 and shown.max() <= 1
        made.release()
        made.scene.release()


@pytest.mark.parametrize("samples", [1 << 14, *([1_000_000] if LONG else [])])
def test_many_samples_do_not_drift(gpu: Renderer, samples: int) -> None:
    """A sky of radiance .1, which no sum of floats meets exactly, beside a floor in its light."""
    floor = quad("m", (-9, -1, 9), (18, 0, 0), (0, 0, -18))
    scene = document([floor], environment={"type": "constant", "radiance": 0.1})
    made = picture(gpu, scene, samples, width=8, height=8, sampler="independent")
    color, spread = made.read()[..., 0].astype(float), made.read("variance")[..., 0].astype(float)
    assert color[0] == pytest.approx(float(np.float32(0.1)), rel=1e-7)
    assert (spread[0] == 0).all()
    error = np.sqrt(spread[-1].mean() / 8)
    assert abs(color[-1].mean() - 0.05) < 5 * error < 1e-3
    made.release()
    made.scene.release()


def _welford(gpu: Renderer, samples: int) -> tuple[np.ndarray, np.ndarray]:
    scene = document([quad("m", (-9, -9, 0), (18, 0, 0), (0, 18, 0))], lights=LIGHTS[2:])
    made = picture(gpu, scene, samples, width=8, height=8, sampler="independent", estimator="bsdf")
    out = made.read()[..., 0].astype(float), made.read("variance")[..., 0].astype(float)
    made.release()
    made.scene.release()
    return out


def test_moments_of_many_samples_are_those_of_few(gpu: Renderer) -> None:
    """One in some 3 000 paths meets a sun of 2 degrees: mean and variance agree with the binomial's."""
    n = 1 << 16
    mean, variance = _welford(gpu, n)
    # irradiance 1 at an angle of 2 / sqrt(6) to the normal... of the quad: z = -1 / sqrt(6)
    cos = 1 / np.sqrt(6)
    assert mean.mean() == pytest.approx(0.5 / np.pi * cos, rel=0.05)
    radiance = 1 / (np.pi * np.sin(np.radians(1)) ** 2)
    chance = mean / (0.5 * radiance)
    expected = chance * (0.5 * radiance) ** 2 * (1 - chance) / (n - 1)
    np.testing.assert_allclose(variance, expected, rtol=1e-3)


CLOSED: dict[str, dict[str, Any]] = {
    "box": {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": "m"},
    "mesh": {**icosphere("m", 0), "smooth": False},
    "sphere": ball("m"),
}


@pytest.mark.parametrize("row", CLOSED)
def test_a_thousand_bounces_in_a_white_room_lose_nothing(gpu: Renderer, row: str) -> None:
    """A wall that reflects everything and glows with 1 on both sides: 1 of each of 1 025 walls, from every path."""
    glow = {"type": "diffuse", "albedo": 1, "emission": 1, "emission_sides": "both"}
    camera = {"position": [0.1, 0.2, 0.3], "target": [0, 0, -1], "vfov": 90}
    scene = document([CLOSED[row]], {"m": glow}, camera=camera)
    seen = Seen(gpu, scene, 4, width=16, height=16, max_bounces=1024, estimator="bsdf")
    np.testing.assert_allclose(seen.color, 1025, rtol=1e-4)
    assert seen.warnings == []


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (2048, 1)])
def test_pictures_of_a_pixel(gpu: Renderer, size: tuple[int, int]) -> None:
    seen = Seen(gpu, everything(), 2, width=size[0], height=size[1])
    assert seen.color.shape == (size[1], size[0], 3) and seen.color.max() > 0


PLACES: dict[str, tuple[list[dict[str, Any]], list[float]]] = {
    "inside a mesh": ([icosphere("glow", 2, scale=3), ball("white", (0, 0, -1), 0.3)], [0, 0, 0.5]),
    "inside glass": ([ball("glass", (0, 0, 0)), ball("metal", (0, 0, -3))], [0, 0, 0.5]),
    "inside frosted glass": ([ball("frost", (0, 0, 0)), ball("metal", (0, 0, -3))], [0, 0, 0.5]),
    "on a ball": ([ball("plastic", (0, 0, 2))], [0, 0, 1]),
    "on a floor": ([quad("white", (-5, 0, 5), (10, 0, 0), (0, 0, -10)), ball("metal", (0, 0.5, -2), 0.5)], [0, 0, 0]),
    "in a corner of a box": ([{"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": "glow"}], [1, 1, 1]),
    "at a lamp's middle": ([ball("glow", (0, 0, 0), 2.0)], [0, 0, 0]),
    "nested glass": ([ball("glass", radius=1), ball("glass", radius=0.7), ball("frost", radius=0.4),
                      ball("lamp", radius=0.1)], [0, 0, 4]),
    "thin shells": ([ball("glass"), ball("glass", radius=1 - 1e-6), ball("white", (0, 0, -3))], [0, 0, 4]),
    "one in the other's place": ([ball("glass"), ball("glass"), ball("metal"), ball("lamp")], [0, 0, 4]),
    "slivers": ([{"type": "mesh", "material": "phong", "vertices": [
        [-2, -1, 0], [2, -1, 1e-6], [2, -1 + 1e-5, 0], [0, 1, 0], [1e-6, 1, 0], [0, -1, 1e-7], [1, 1, 0], [1, 1, 0]],
        "faces": [[0, 1, 2], [3, 4, 5], [0, 3, 1], [3, 6, 7], [0, 0, 0]]}], [0, 0, 4]),
}  # fmt: skip


FEW = ("inside glass", "on a floor", "in a corner of a box", "one in the other's place", "slivers")
RARE = FEW[:3]  # the scenes have all materials, so that each has two kernels of 5 s


@pytest.mark.parametrize("row", seldom(rows({row: row for row in FEW}, {row: row for row in PLACES}), RARE))
def test_odd_places_stay_sound(gpu: Renderer, row: str) -> None:
    shapes, position = PLACES[row]
    target = [0, 0.1, -2] if position != [1, 1, 1] else [0, 0, 0]
    camera = {"position": position, "target": target, "vfov": 60}
    brightest = 0.0
    for estimator in ESTIMATORS if LONG else ("mis",):
        seen = Seen(gpu, everything(shapes=shapes, camera=camera), 4, width=48, height=32, estimator=estimator)
        brightest = max(brightest, float(seen.color.max()))
        assert all("degenerate" in line or "caustics" in line for line in seen.warnings)
    assert brightest > 0
    assert row != "slivers" or seen.warnings == ["/shapes/0: 2 degenerate triangles skipped"]


@pytest.mark.slow
def test_settings_at_their_ends_render(gpu: Renderer) -> None:
    made = packed(everything()).arrays
    scene = gpu.load(made)
    for more in ({"max_bounces": 0}, {"roulette_depth": 0}, {"seed": 2**32 - 1}, {"clamp": 1e-20}, {"clamp": 1e20}):
        taken = gpu.picture(scene, RenderSettings(**{"width": 16, "height": 16, "filter": "gaussian", **more}))
        taken.trace(60.0, 2)
        assert np.isfinite(taken.read()).all()
        taken.release()
    scene.release()
