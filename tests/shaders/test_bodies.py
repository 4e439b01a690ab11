"""Bodies that overlap: the one of the highest priority is there, with its index, and what it is filled with."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from tests.extremes.scenes import ball, quad
from tests.marks import BY_ESTIMATOR
from tests.rendering import assert_estimators_agree, document, render

Doc = dict[str, Any]
GLASS, WATER, ICE = 1.5, 1.33, 1.31
LAMP = {"type": "diffuse", "albedo": 0, "emission": 1}


def clear(ior: float, **more: Any) -> Doc:
    return {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0, "ior": ior, **more}


MATERIALS = {
    "glass": clear(GLASS), "water": clear(WATER), "ice": clear(ICE), "air": clear(1), "lamp": LAMP,
    "rough": clear(GLASS, roughness=0.4),
}  # fmt: skip


def slab(material: str, low: float, high: float, **more: Any) -> Doc:
    return {"type": "box", "min": [-9, -9, low], "max": [9, 9, high], "material": material, **more}


def lamp(z: float) -> Doc:
    """It shines towards +Z."""
    return quad("lamp", (-5, -5, z), (10, 0, 0), (0, 10, 0))


def seen(
    gpu: Renderer, shapes: list[Doc], z: float, towards: tuple[float, float, float] = (0, 0, -1), **more: Any
) -> Any:
    """Radiance from (0, 0, z), of two channels of the same value."""
    camera = {"position": [0, 0, z], "target": [towards[0], towards[1], z + towards[2]], "vfov": 0.02}
    settings = {
        "max_bounces": 8,
        "roulette_depth": 64,
        **{k: more.pop(k) for k in ("estimator", "max_bounces") if k in more},
    }
    scene = document(shapes, MATERIALS | more.pop("materials", {}), camera=camera, **more)
    return render(gpu, scene, 64, width=8, height=8, **settings)[..., :3].mean((0, 1))


def reflected(a: float, b: float) -> float:
    return ((a - b) / (a + b)) ** 2


@pytest.mark.parametrize("overlap", [1e-5, 0.002, 0.5])
def test_glass_to_water(gpu: Renderer, overlap: float) -> None:
    """From within the glass to a lamp in the water: radiance goes with the square of the index."""
    shapes = [slab("glass", -1, 1, priority=1), slab("water", -3, -1 + overlap), lamp(-2)]
    image = seen(gpu, shapes, 0, max_bounces=1)
    assert reflected(GLASS, WATER) == pytest.approx(0.00361, abs=5e-6)
    np.testing.assert_allclose(image, (1 - 0.00361) * (GLASS / WATER) ** 2, rtol=0.002)
    image = seen(
        gpu, [slab("glass", -1, 1, priority=1), slab("water", -3, -1 + overlap), lamp(0.5)], 0.7, max_bounces=0
    )
    np.testing.assert_allclose(image, 1, rtol=1e-4)


def test_light_is_totally_reflected_from_the_critical_angle_on(gpu: Renderer) -> None:
    assert math.degrees(math.asin(WATER / GLASS)) == pytest.approx(62.46, abs=0.01)
    shapes = [slab("glass", -1, 1, priority=1), slab("water", -3, -0.999), {**lamp(-2), "origin": [-900, -900, -2],
              "u": [1800, 0, 0], "v": [0, 1800, 0]}]  # fmt: skip
    shapes = [
        {**s, "min": [-900, -900, s["min"][2]], "max": [900, 900, s["max"][2]]} if "min" in s else s for s in shapes
    ]
    for degrees, lit in ((61.9, True), (62.4, True), (62.52, False), (63.0, False)):
        angle = math.radians(degrees)
        image = seen(gpu, shapes, 0, (math.sin(angle), 0, -math.cos(angle)), max_bounces=1)
        assert (image.max() > 0.1) == lit, degrees


def test_bodies_within_bodies(gpu: Renderer) -> None:
    """A glass, water in it, ice in that: light passes each boundary once, and what is hidden is not there."""
    shapes = [
        slab("glass", -4, 4, priority=1), slab("water", -3, 3, priority=2), slab("ice", -1, 1, priority=3), lamp(-6),
    ]  # fmt: skip
    passed = 1.0
    for a, b in ((1, GLASS), (GLASS, WATER), (WATER, ICE)):
        passed *= (1 - reflected(a, b)) ** 2
    for order in (shapes, shapes[::-1]):
        np.testing.assert_allclose(seen(gpu, order, 6, max_bounces=6), passed, rtol=0.01)
        assert seen(gpu, order, 6, max_bounces=5).max() == 0, "six boundaries count"


def test_water_in_a_glass_that_overlaps_is_as_water_that_touches(gpu: Renderer) -> None:
    """The walls of a glass are above what is poured into it: a hidden boundary costs no bounce."""
    walls = [slab("glass", 2, 3, priority=2), slab("glass", -3, -2, priority=2)]
    shapes = [*walls, slab("water", -2.5, 2.5, priority=1), lamp(-6)]
    passed = ((1 - reflected(1, GLASS)) * (1 - reflected(GLASS, WATER))) ** 2
    np.testing.assert_allclose(seen(gpu, shapes, 6, max_bounces=4), passed, rtol=0.01)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_cavity_of_index_1(gpu: Renderer, estimator: str) -> None:
    shapes = [slab("glass", -3, 3), slab("air", -1, 1, priority=1), lamp(-6)]
    passed = (1 - reflected(1, GLASS)) ** 4
    np.testing.assert_allclose(seen(gpu, shapes, 6, max_bounces=4, estimator=estimator), passed, rtol=0.01)
    np.testing.assert_allclose(seen(gpu, shapes, 0, max_bounces=2, estimator=estimator), passed**0.5, rtol=0.01)


@pytest.mark.parametrize("tint", [[0.5, 0.5, 0.5], {"texture": "grey"}], ids=["of its material", "of a texture"])
def test_only_the_highest_absorbs(gpu: Renderer, tint: Any) -> None:
    """What a body absorbs is its material's, or what a texture gave it where the ray came in, which is kept."""
    tinted = {"air": clear(1, attenuation_color=tint, attenuation_distance=1.0)}
    shapes = [
        slab("air", -3, 0.5, priority=1, medium={"absorption": 0.2}),
        slab("other", -0.5, 3, medium={"absorption": 0.7}),
    ]  # fmt: skip
    white = {"type": "constant", "radiance": 1}
    rest = {"environment": white, "textures": {"grey": {"type": "checker", "a": 0.5, "b": 0.5}}}
    image = seen(gpu, shapes, 6, materials={**tinted, "other": clear(1)}, **rest)
    np.testing.assert_allclose(image, 0.5**3.5 * math.exp(-0.2 * 3.5 - 0.7 * 2.5), rtol=1e-4)
    image = seen(gpu, shapes, 0, materials={**tinted, "other": clear(1)}, **rest)
    np.testing.assert_allclose(image, 0.5**3 * math.exp(-0.2 * 3), rtol=1e-4)


def test_nothing_is_lost_nor_gained(gpu: Renderer) -> None:
    """Overlapping balls of glass, water and ice, some rough, some that scatter, in a white furnace."""
    shapes = [
        {**ball("rough", (-0.4, 0, 0), 0.8), "priority": 1},
        {**ball("water", (0.5, 0, 0), 0.9), "medium": {"scattering": 3, "g": 0.4}},
        {**ball("ice", (0, 0.6, 0.2), 0.6), "priority": 3}, {**ball("air", (0, -0.6, 0.2), 0.5), "priority": -2},
        {**ball("glass", (0.1, 0, 0.5), 0.4), "priority": 3},
    ]  # fmt: skip
    scene = document(shapes, MATERIALS, environment={"type": "constant", "radiance": 1})
    image = render(gpu, scene, 256, max_bounces=128)[..., :3]
    assert abs(image.mean() - 1) < 0.01


def test_estimators_agree(gpu: Renderer) -> None:
    """Shadow rays pass hidden boundaries, and boundaries between bodies that only look alike."""
    shapes = [
        {**ball("air", (0, 0, 0), 1.0), "priority": 1, "medium": {"absorption": [0.2, 0.5, 1]}},
        {**ball("air", (0.6, 0, 0), 0.9), "medium": {"scattering": 1.5}}, ball("lamp", (0.9, 0.3, 0.2), 0.5),
        quad("floor", (-4, -1, 4), (8, 0, 0), (0, 0, -8)),
    ]  # fmt: skip
    materials = {**MATERIALS, "floor": {"type": "diffuse", "albedo": 0.6}, "lamp": {**LAMP, "emission": 2}}
    assert_estimators_agree(gpu, document(shapes, materials))
