"""Rays that pass: shapes that hide from the camera, and surfaces that are met by chance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import ESTIMATORS, Renderer
from tests.marks import BY_ESTIMATOR
from tests.rendering import document, picture, render

STRAIGHT = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}
ASKEW = {"position": [-5, -4, 2], "target": [0, 0, 0], "vfov": 0.02}
FLOOR = {"type": "quad", "origin": [-9, -9, 0], "u": [18, 0, 0], "v": [0, 18, 0], "material": "m"}
POINT = {"type": "point", "position": [0, 0, 2], "intensity": 5}
SKY = {"type": "constant", "radiance": [2, 1, 0.5]}
# Each stands above the origin, between the point light and the floor, and in the camera's way.
SHAPES: dict[str, dict[str, Any]] = {
    "sphere": {"type": "sphere", "center": [0, 0, 1], "radius": 0.5},
    "ellipsoid": {"type": "sphere", "center": [0, 0, 1], "radius": 0.5, "transform": {"scale": [1, 2, 1]}},
    "quad": {"type": "quad", "origin": [-1, -1, 1], "u": [2, 0, 0], "v": [0, 2, 0]},
    "box": {"type": "box", "min": [-0.5, -0.5, 0.5], "max": [0.5, 0.5, 1.5]},
    "mesh": {"type": "mesh", "vertices": [[-2, -2, 1], [2, -2, 1], [0, 3, 1]], "faces": [[0, 1, 2]]},
}
LAYERS = {"sphere": 2, "ellipsoid": 2, "quad": 1, "box": 2, "mesh": 1}


def _scene(shapes: list[dict[str, Any]], veil: dict[str, Any], **more: Any) -> dict[str, Any]:
    materials = {"m": {"type": "diffuse", "albedo": 0.6}, "veil": {"type": "diffuse", "albedo": 0, **veil}}
    return document(shapes, materials, **{"camera": STRAIGHT, **more})


def _mean(gpu: Renderer, scene: dict[str, Any], samples: int = 4096, **more: Any) -> np.ndarray:
    return render(gpu, scene, samples // 16, width=16, height=16, **more).mean((0, 1))


SELDOM = ("ellipsoid", "quad", "box")  # with the tree, where each has a kernel of its own


@pytest.mark.parametrize(
    ("kind", "many"),
    [
        *((kind, False) for kind in SHAPES),
        *(pytest.param(kind, True, marks=[pytest.mark.slow] * (kind in SELDOM)) for kind in SHAPES),
    ],
)
def test_the_camera_looks_through_hidden_shapes(gpu: Renderer, kind: str, many: bool) -> None:
    """Nothing is in the picture but the shadow; through the tree as well."""
    hidden = {**SHAPES[kind], "material": "veil", "visible_to_camera": False}
    away = [{**hidden, "transform": {"translate": [50 + 3 * i, 0, 0]}} for i in range(30 if many else 0)]
    unlit = _mean(gpu, _scene([FLOOR, hidden, *away], {}, lights=[POINT]), 64)
    assert unlit.tolist() == [0, 0, 0, 1]
    low = {**POINT, "position": [0, 0, 0.2]}
    lit = _mean(gpu, _scene([FLOOR, hidden, *away], {}, lights=[low]), 64)
    np.testing.assert_allclose(lit[:3], 0.6 / math.pi * 5 / 0.04, rtol=1e-4)
    alone = picture(gpu, _scene([hidden, *away], {}, environment=SKY), 16)
    np.testing.assert_allclose(alone.read(), np.broadcast_to([2, 1, 0.5, 1], (32, 32, 4)), rtol=1e-6)
    assert alone.read("depth").max() == 0 and np.abs(alone.read("normal")).max() == 0


def test_hidden_shapes_are_seen_in_reflections_and_light_the_room(gpu: Renderer) -> None:
    lamp = {**SHAPES["quad"], "material": "veil", "visible_to_camera": False, "u": [0, 2, 0], "v": [2, 0, 0]}
    glow = {"emission": [3, 2, 1]}
    plain = {key: value for key, value in lamp.items() if key != "visible_to_camera"}
    for estimator in ESTIMATORS:
        shown, hidden = (
            _mean(gpu, _scene([FLOOR, shape], glow, camera=ASKEW), 1 << 14, estimator=estimator)
            for shape in (plain, lamp)
        )
        assert shown[0] > 0.1
        np.testing.assert_allclose(hidden, shown, rtol=1e-5)
    turned = {**lamp, "u": [2, 0, 0], "v": [0, 2, 0]}
    assert _mean(gpu, _scene([turned], glow), 16).tolist() == [0, 0, 0, 0]  # it faces the camera, and hides


@pytest.mark.parametrize(
    ("kind", "estimator", "many"),
    [
        *(
            pytest.param(kind, name, False, marks=[pytest.mark.slow] * (kind in SELDOM and name in ("bsdf", "light")))
            for kind in SHAPES
            for name in ESTIMATORS
        ),
        *(pytest.param(kind, "mis", True, marks=[pytest.mark.slow] * (kind in SELDOM)) for kind in SHAPES),
    ],
)
def test_alpha_is_the_chance_of_being_met(gpu: Renderer, kind: str, estimator: str, many: bool) -> None:
    """Black veils over a floor in a point light: what is left is (1 - alpha) to the number of layers, both ways; in
    the tree as well, where a ray that goes into a solid must also come out."""
    alpha, n = 0.3, LAYERS[kind]
    veil = {**SHAPES[kind], "material": "veil"}
    away = [{**veil, "transform": {"translate": [50 + 3 * i, 0, 0]}} for i in range(30 if many else 0)]
    scene = _scene([FLOOR, veil, *away], {"alpha": alpha}, lights=[POINT])
    image = _mean(gpu, scene, 1 << 14, estimator=estimator)
    expected = (1 - alpha) ** (2 * n) * 0.6 / math.pi * 5 / 4
    np.testing.assert_allclose(image[:3], expected, rtol=0.02)
    aside = _mean(gpu, {**scene, "camera": ASKEW}, 64, estimator=estimator)
    if kind == "quad":  # the camera's ray misses the others' shadows
        np.testing.assert_allclose(aside[:3], (1 - alpha) * 0.6 / math.pi * 5 / 4, rtol=1e-4)


def test_alpha_of_the_picture_is_the_background_s(gpu: Renderer) -> None:
    veil = {**SHAPES["box"], "material": "veil"}
    for background in (True, False):
        sky = {**SKY, "background": background}
        image = _mean(gpu, _scene([veil], {"alpha": 0.3}, environment=sky), 1 << 14)
        through = 0.7**2
        expected = [*(through * np.array([2, 1, 0.5]) * background), 1 if background else 1 - through]
        np.testing.assert_allclose(image, expected, rtol=0.01, atol=1e-6)
    assert _mean(gpu, _scene([veil], {"alpha": 0}), 16).tolist() == [0, 0, 0, 0]


def test_layers_cover_each_other_from_the_front(gpu: Renderer) -> None:
    """Glowing veils of many alphas, in an order that is not theirs along the ray: the walk down the tree meets some
    layers before others that are in front of them. An opaque one ends the stack."""
    rng = np.random.default_rng(5)
    alphas, glow = rng.uniform(0.1, 0.6, 40), rng.uniform(0, 4, (40, 3))
    alphas[30] = 1
    heights = np.linspace(3, 0.1, 40).tolist()
    order = rng.permutation(40)
    stack = [{**SHAPES["quad"], "origin": [-1, -1, heights[i]], "material": f"veil {i}"} for i in order]
    scene = _scene(stack, {})
    scene["materials"] = {
        f"veil {i}": {"type": "diffuse", "albedo": 0, "alpha": float(alphas[i]), "emission": glow[i].tolist()}
        for i in range(40)
    }
    before = np.cumprod([1, *(1 - alphas[:-1])])
    image = _mean(gpu, scene, 1 << 16, max_bounces=0)
    np.testing.assert_allclose(image, [*((before * alphas) @ glow), 1], rtol=0.01)


def test_passing_is_no_bounce(gpu: Renderer) -> None:
    stack = [{**SHAPES["quad"], "origin": [-1, -1, 0.1 * i], "material": "veil"} for i in range(1, 31)]
    lamp = {**FLOOR, "material": "lamp"}
    scene = _scene([lamp, *stack], {"alpha": 0.05})
    scene["materials"]["lamp"] = {"type": "diffuse", "albedo": 0, "emission": 4}
    image = _mean(gpu, scene, 1 << 14, max_bounces=0)
    np.testing.assert_allclose(image, [*[4 * 0.95**30] * 3, 1], rtol=0.02)
    made = picture(gpu, scene, 256)
    depth = made.read("depth")
    met = (4 - 0.1 * np.arange(30, 0, -1)) * 0.05 * 0.95 ** np.arange(30)
    assert depth.mean() == pytest.approx(float(met.sum() + 4 * 0.95**30), rel=2e-3)


@pytest.mark.parametrize(
    ("alpha", "cutoff", "met"), [(0.3, 0.5, 0), (0.5, 0.5, 1), (0.7, 0.5, 1), (0, 0, 1), (1, 1, 1), (0.99, 1, 0)]
)
def test_cutoff_decides(gpu: Renderer, alpha: float, cutoff: float, met: int) -> None:
    veil = {**SHAPES["sphere"], "material": "veil"}
    image = _mean(gpu, _scene([veil], {"alpha": alpha, "alpha_cutoff": cutoff}), 16)
    assert image[3] == met


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_furnace_with_veils_stays_white(gpu: Renderer, estimator: str) -> None:
    """White surfaces of any alpha in a constant sky are invisible, as the paths that pass and those that bounce meet
    the same radiance."""
    shapes = [{**shape, "material": "veil"} for shape in SHAPES.values()]
    scene = _scene(shapes, {"albedo": 1, "alpha": 0.4}, environment={"type": "constant", "radiance": 1},
                   camera={"position": [0, 0, 4], "target": [0, 0, 0]})  # fmt: skip
    image = render(gpu, scene, 256, max_bounces=64, roulette_depth=64, estimator=estimator)
    assert image[..., :3].mean() == pytest.approx(1, abs=3e-3)


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_lamp_of_half_alpha_gives_half_the_light(gpu: Renderer, estimator: str) -> None:
    lamp = {**SHAPES["quad"], "material": "veil", "u": [0, 2, 0], "v": [2, 0, 0]}
    full, half = (
        _mean(gpu, _scene([FLOOR, lamp], {"emission": 2, "alpha": alpha}, camera=ASKEW), 1 << 15, estimator=estimator)
        for alpha in (1, 0.5)
    )
    np.testing.assert_allclose(half[:3], full[:3] / 2, rtol=0.02)


def test_a_lamp_in_clear_glass_is_found_by_every_third_path(gpu: Renderer) -> None:
    """Seen head-on, glass reflects 4 %: by that chance alone a small lamp in it would be a cluster of white dots."""
    glass = {"type": "principled", "transmission": 1, "ior": 1.5, "roughness": 0, "base_color": 1}
    pane = {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "material": "glass"}
    lamp = {"type": "quad", "origin": [-9, -9, 8], "u": [0, 18, 0], "v": [18, 0, 0], "material": "lamp"}
    materials = {"glass": glass, "lamp": {"type": "diffuse", "albedo": 0, "emission": 25}}
    scene = document([pane, lamp], materials, camera={"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 5})
    one = render(gpu, scene, 1, width=128, height=128, max_bounces=4)[..., 0]
    assert (one > 0).mean() == pytest.approx(1 / 3, abs=0.02)
    assert one.mean() == pytest.approx(0.04 * 25, rel=0.05)
    many = render(gpu, scene, 64, width=32, height=32, max_bounces=4)[..., 0]
    assert many.mean() == pytest.approx(0.04 * 25, rel=0.005)
