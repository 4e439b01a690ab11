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


def test_lights_are_sampled_as_they_are_found(gpu: Renderer) -> None:
    layers = {"coat_weight": 1, "coat_color": [0.9, 0.4, 0.2], "coat_roughness": 0.2, "fuzz_weight": 0.5}
    lamp = {**GLOW, **layers, "emission_luminance": 68300}
    made = {"m": {"type": "diffuse", "albedo": 0.6}, "lamp": lamp}
    panel = {"type": "quad", "origin": [-1.8, -1, 0.2], "u": [0, 0, 1], "v": [0, 2, 0], "material": "lamp"}
    mesh = {"type": "mesh", "vertices": [[1.5, -1, 0.2], [1.5, 1, 0.2], [1.5, 0, 1]], "faces": [[0, 2, 1]],
            "material": "lamp"}  # fmt: skip
    shapes = [QUAD, ball("lamp", (0, 0, 0.8), 0.3), panel, mesh]
    assert_estimators_agree(gpu, document(shapes, made, camera={"position": [0, -3, 3], "target": [0, 0, 0]}))
