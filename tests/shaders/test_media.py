"""Bodies that absorb, by Beer and Lambert: around the camera, nested, overlapping, with things in them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from tests.extremes.scenes import ball, icosphere, quad
from tests.marks import BY_ESTIMATOR, seldom
from tests.rendering import document, render

Doc = dict[str, Any]
WHITE = {"type": "constant", "radiance": 1}
A, B = np.array([0.9, 0.5, 0.1]), np.array([0.4, 0.8, 0.6])  # left of light after 1 m, and after .5 m
LAMP = {"type": "diffuse", "albedo": 0, "emission": 1}


def glass(colour: np.ndarray | list[float], distance: float, ior: float = 1) -> Doc:
    return {
        "type": "principled", "transmission": 1, "base_color": 1, "roughness": 0, "ior": ior,
        "attenuation_color": np.asarray(colour, float).tolist(), "attenuation_distance": distance,
    }  # fmt: skip


def left(a: float, b: float = 0) -> np.ndarray:
    """Of light after a metres in the one and b in the other."""
    return np.asarray(A**a * B ** (b / 0.5))


def seen(gpu: Renderer, shapes: list[Doc], z: float, **more: Any) -> np.ndarray:
    """Radiance from (0, 0, z) along -Z."""
    materials = {"a": glass(A, 1), "b": glass(B, 0.5), "lamp": LAMP, **more.pop("materials", {})}
    camera = {"position": [0, 0, z], "target": [0, 0, z - 1], "vfov": 0.02}
    given = {k: more.pop(k) for k in ("estimator", "max_bounces") if k in more}
    settings = {"max_bounces": 8, "roulette_depth": 8, **given}
    scene = document(shapes, materials, camera=camera, **more)
    return np.asarray(render(gpu, scene, 4, width=8, height=8, **settings)[..., :3].mean((0, 1)))


ROOM = {"type": "box", "min": [-2, -2, -2], "max": [2, 2, 2], "material": "a"}
MESH = icosphere("a", 1)
BODIES = {
    "ball": ball("a", radius=2), "box": ROOM, "mesh": {**MESH, "smooth": False, "transform": {"scale": 2}},
    "ellipsoid": ball("a", radius=2, transform={"scale": [1, 1, 0.9]}),
}  # fmt: skip


@pytest.mark.parametrize("body", seldom(BODIES, ["box", "ellipsoid"]))
@pytest.mark.parametrize("bounces", [0, 8])
def test_a_lamp_within_the_body_that_the_camera_is_in(gpu: Renderer, body: str, bounces: int) -> None:
    lamp = quad("lamp", (-1, -1, -0.5), (2, 0, 0), (0, 2, 0))
    for ior in (1, 1.5):
        image = seen(gpu, [BODIES[body], lamp], 1, materials={"a": glass(A, 1, ior)}, max_bounces=bounces)
        np.testing.assert_allclose(image, left(1.5), rtol=1e-4)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_matte_thing_within_the_body_that_the_camera_is_in(gpu: Renderer, estimator: str) -> None:
    """Lit by a point within it too: the light fades on both its ways."""
    wall = quad("wall", (-1, -1, -0.5), (2, 0, 0), (0, 2, 0))
    light = {"type": "point", "position": [0, 0, 0.25], "intensity": 3}
    made = {"wall": {"type": "diffuse", "albedo": 0.5}, "a": glass(A, 1, 1.5)}
    image = seen(gpu, [BODIES["ball"], wall], 1, materials=made, lights=[light], estimator=estimator, max_bounces=1)
    np.testing.assert_allclose(image, 0.5 / math.pi * 3 / 0.75**2 * left(1.5 + 0.75), rtol=1e-4)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
@pytest.mark.parametrize(("z", "a", "b"), [(4, 4, 2), (1.5, 3.5, 2), (0, 2, 1), (-1.5, 0.5, 0)])
def test_a_body_within_a_body(gpu: Renderer, estimator: str, z: float, a: float, b: float) -> None:
    """From outside, from between, from within both, and behind the inner one."""
    image = seen(gpu, [ROOM, ball("b")], z, environment=WHITE, estimator=estimator)
    np.testing.assert_allclose(image, left(a, b), rtol=1e-4)


@pytest.mark.parametrize(("z", "a", "b"), [(4, 2, 2), (1, 1.5, 2), (0, 0.5, 1.5), (-1, 0, 0.5)])
def test_bodies_that_overlap(gpu: Renderer, z: float, a: float, b: float) -> None:
    image = seen(gpu, [ball("a", (0, 0, 0.5)), ball("b", (0, 0, -0.5))], z, environment=WHITE)
    np.testing.assert_allclose(image, left(a, b), rtol=1e-4)


def test_a_lamp_within_both(gpu: Renderer) -> None:
    lamp = quad("lamp", (-0.2, -0.2, -0.5), (0.4, 0, 0), (0, 0.4, 0))
    for z, a, b in ((4, 2.5, 1.5), (1.5, 2, 1.5), (0.5, 1, 1)):
        np.testing.assert_allclose(seen(gpu, [ROOM, ball("b"), lamp], z), left(a, b), rtol=1e-4)


def test_what_lies_behind_the_camera_changes_nothing(gpu: Renderer) -> None:
    """Not a body that lets a channel through not at all, nor an open sheet, nor a hidden body."""
    lamp = quad("lamp", (-1, -1, -0.5), (2, 0, 0), (0, 2, 0))
    red = ball("red", (0, 0, 1.6), 0.3)
    made = {"red": glass([1, 0, 0], 1)}
    np.testing.assert_allclose(seen(gpu, [ROOM, red, lamp], 1, materials=made), left(1.5), rtol=1e-4)
    sheet = quad("b", (-9, -9, 3), (18, 0, 0), (0, 18, 0))
    np.testing.assert_allclose(seen(gpu, [sheet, lamp], 1), 1, rtol=1e-5)
    np.testing.assert_allclose(seen(gpu, [{**ROOM, "visible_to_camera": False}, lamp], 1), 1, rtol=1e-5)


def test_the_back_of_a_sheet_is_seen_through_its_glass(gpu: Renderer) -> None:
    """As if the camera were in the body that the sheet bounds."""
    sheet = quad("a", (9, -9, 0), (-18, 0, 0), (0, 18, 0))
    np.testing.assert_allclose(seen(gpu, [sheet], 1.5, environment=WHITE), left(1.5), rtol=1e-4)


def test_a_rate_that_changes_over_a_surface_goes_with_the_body(gpu: Renderer) -> None:
    """The place of entry gives the rate; what is outside stays clear, though the exit says otherwise."""
    texture = {"type": "checker", "a": A.tolist(), "b": B.tolist(), "scale": [1, 2]}
    made = {"t": {**glass(A, 1), "attenuation_color": {"texture": "t"}}}
    camera = {"position": [0, 4, 0.01], "target": [0, 0, 0], "vfov": 0.02}
    scene = document([ball("t")], made, camera=camera, environment=WHITE, textures={"t": texture})
    image = render(gpu, scene, 4, width=8, height=8, max_bounces=8)[..., :3].mean((0, 1))
    np.testing.assert_allclose(image, B**2, rtol=1e-3)
