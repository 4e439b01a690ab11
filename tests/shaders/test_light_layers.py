"""Emission that lies under coat and fuzz, where a model says so."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from tests.extremes.scenes import ball
from tests.rendering import assert_estimators_agree, document, render

Doc = dict[str, Any]
GLOW = {"type": "openpbr", "base_weight": 0, "specular_weight": 0, "emission_luminance": 683}
COATED = {"type": "principled", "base_color": 0, "specular": 0, "emission": 1}
QUAD = {"type": "quad", "origin": [-9, -9, 0], "u": [18, 0, 0], "v": [0, 18, 0], "material": "m"}


def seen(gpu: Renderer, material: Doc, cosine: float, samples: int = 16, **more: Any) -> np.ndarray:
    """Radiance of the surface at that angle."""
    camera = {"position": [4 * math.sqrt(1 - cosine**2), 0, 4 * cosine], "target": [0, 0, 0], "vfov": 0.02}
    image = render(gpu, document([QUAD], {"m": material}, camera=camera, **more), samples, width=8, height=8)
    return np.asarray(image[..., :3].mean((0, 1)))


@pytest.mark.parametrize("weight", [0.6, 1])
def test_a_smooth_coat_takes_what_it_reflects_and_absorbs(gpu: Renderer, weight: float) -> None:
    color = np.array([0.9, 0.5, 0.2])
    coat = {"coat_weight": weight, "coat_roughness": 0, "coat_ior": 1.6, "coat_color": color.tolist()}
    for c in (1, 0.6, 0.2):
        t = math.sqrt(1 - (1 - c * c) / 1.6**2)
        f = 0.5 * (((c - 1.6 * t) / (c + 1.6 * t)) ** 2 + ((1.6 * c - t) / (1.6 * c + t)) ** 2)
        expected = (1 - weight * f) * (1 - weight + weight * color ** (0.5 / t))
        np.testing.assert_allclose(seen(gpu, {**GLOW, **coat}, c), expected, rtol=1e-4)


def reflectance(c: float, n: float = 1.5) -> float:
    """The unpolarised one of a boundary at cosine c."""
    t = math.sqrt(1 - (1 - c * c) / n**2)
    return 0.5 * (((c - n * t) / (c + n * t)) ** 2 + ((n * c - t) / (n * c + t)) ** 2)


@pytest.mark.parametrize(("coat", "roughness"), [(1, 0), (0.5, 0.5), (0.3, 1)])
@pytest.mark.parametrize("textured", [False, True])
def test_a_clearcoat_takes_what_it_reflects_at_the_view(
    gpu: Renderer, coat: float, roughness: float, textured: bool
) -> None:
    """By the index that the coat has; KHR_materials_clearcoat writes Schlick's reflectance, which is 0.04 off at
    most. Roughness changes nothing, here as there."""
    plain = {"t": {"type": "checker", "a": coat, "b": coat}} if textured else {}
    m = {**COATED, "clearcoat": {"texture": "t"} if textured else coat, "clearcoat_roughness": roughness}
    for degrees in (0, 60, 80, 85):
        c = math.cos(math.radians(degrees))
        found = seen(gpu, m, c, textures=plain)
        np.testing.assert_allclose(found, 1 - coat * reflectance(c), rtol=1e-4)
        np.testing.assert_allclose(found, 1 - coat * (0.04 + 0.96 * (1 - c) ** 5), atol=0.04)


def test_without_both_nothing_is_dimmed(gpu: Renderer) -> None:
    """The course notes' model has a coat that leaves what is under it alone."""
    for m in ({**COATED}, {**COATED, "sheen": 1}, {"type": "disney", "base_color": 0, "specular": 0, "clearcoat": 1,
                                                   "emission": 1}):  # fmt: skip
        np.testing.assert_allclose(seen(gpu, m, 0.2), 1, rtol=1e-5)


def test_a_coat_lies_on_the_outer_side_of_a_body_and_on_both_of_a_sheet(gpu: Renderer) -> None:
    below = {"camera": {"position": [0, 0, -4], "target": [0, 0, 0], "vfov": 0.02}}
    glow = {**COATED, "clearcoat": 1, "emission_sides": "both"}
    for m, expected in ((glow, 0.96), ({**glow, "transmission": 1, "ior": 1.5}, 1.0)):
        scene = document([QUAD], {"m": m}, **below)
        found = render(gpu, scene, 4, width=8, height=8, max_bounces=0)[..., :3].mean()
        assert found == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    "layers",
    [{"coat_weight": 1, "coat_roughness": 0.5}, {"fuzz_weight": 0.8}, {"coat_weight": 0.7, "fuzz_weight": 1}],
)
def test_what_layers_reflect_they_take(gpu: Renderer, layers: Doc) -> None:
    """A surface that shines as its surroundings do is as bright as they are under any white layer."""
    for c in (1, 0.3):
        sky = {"type": "constant", "radiance": 1}
        found = seen(gpu, {**GLOW, **layers}, c, 1024, environment=sky)
        np.testing.assert_allclose(found, 1, atol=0.01)
        assert seen(gpu, {**GLOW, **layers}, c).max() < 0.99


def test_a_coated_lamp_in_a_sky_as_bright_as_it_is_as_bright_or_darker(gpu: Renderer) -> None:
    """Equal where the coat is smooth; a rough one reflects less at slanting angles than it takes."""
    sky = {"type": "constant", "radiance": 1}
    for roughness, least in ((0, 0.995), (0.5, 0.55)):
        m = {**COATED, "clearcoat": 1, "clearcoat_roughness": roughness}
        for c in (1, 0.3, 0.1):
            assert least < seen(gpu, m, c, 1024, environment=sky).mean() < 1.003


LAMPS = [
    {**GLOW, "coat_weight": 1, "coat_color": [0.9, 0.4, 0.2], "coat_roughness": 0.2, "fuzz_weight": 0.5,
     "emission_luminance": 68300},
    {**COATED, "clearcoat": 1, "clearcoat_roughness": 0.3, "emission": 100},
]  # fmt: skip


@pytest.mark.parametrize("lamp", LAMPS, ids=["openpbr", "principled"])
def test_lights_are_sampled_as_they_are_found(gpu: Renderer, lamp: Doc) -> None:
    made = {"m": {"type": "diffuse", "albedo": 0.6}, "lamp": lamp}
    panel = {"type": "quad", "origin": [-1.8, -1, 0.2], "u": [0, 0, 1], "v": [0, 2, 0], "material": "lamp"}
    mesh = {"type": "mesh", "vertices": [[1.5, -1, 0.2], [1.5, 1, 0.2], [1.5, 0, 1]], "faces": [[0, 2, 1]],
            "material": "lamp"}  # fmt: skip
    shapes = [QUAD, ball("lamp", (0, 0, 0.8), 0.3), panel, mesh]
    assert_estimators_agree(gpu, document(shapes, made, camera={"position": [0, -3, 3], "target": [0, 0, 0]}))
