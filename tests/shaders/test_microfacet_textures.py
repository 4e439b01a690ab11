"""A picture of `microfacet` whose alpha is an image: each part of it as with the number that the image has there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from tests.rendering import Images, document, picture

LOW, HIGH = 0.2, 0.9  # at the left and at the right
IMAGES = Images(halves=np.repeat([[[LOW]] * 4 + [[HIGH]] * 4], 8, axis=0).astype(np.float32))
LIGHT = {"type": "directional", "direction": [0.3, 0.2, -1], "irradiance": 3}
TEXTURE = {"alpha": {"texture": "halves"}}


def seen(gpu: Renderer, shape: dict[str, Any], alpha: dict[str, Any]) -> np.ndarray:
    material = {"type": "microfacet", "fresnel": "none", **shape, **alpha}
    wall = {"type": "quad", "origin": [-2, -2, 0], "u": [4, 0, 0], "v": [0, 4, 0], "material": "m"}
    textures = {"halves": {"asset": "halves", "wrap": "clamp"}}
    scene = document([wall], {"m": material}, lights=[LIGHT], **({"textures": textures} if alpha is TEXTURE else {}))
    return picture(gpu, scene, 16, IMAGES).read()[..., :3]


@pytest.mark.parametrize(
    "shape",
    [
        {"distribution": "ggx"},
        {"distribution": "beckmann", "geometry": "smith_correlated"},
        {"distribution": "gtr", "gamma": 1.5},
        {"distribution": "sgd", "gamma": 0.7},
        {"distribution": "gaussian", "geometry": "kelemen"},
        {"distribution": "phong", "geometry": "neumann"},
    ],
    ids=lambda shape: shape["distribution"],
)
def test_each_half_is_that_of_its_number(gpu: Renderer, shape: dict[str, Any]) -> None:
    """Tables between two rows are within half a percent of those made for the number."""
    both = seen(gpu, shape, TEXTURE)
    left, right = (seen(gpu, shape, {"alpha": alpha}) for alpha in (LOW, HIGH))
    width = both.shape[1]
    for half, one in ((slice(0, width * 3 // 8), left), (slice(width * 5 // 8, width), right)):
        assert one[:, half].max() > 0.01
        np.testing.assert_allclose(both[:, half], one[:, half], rtol=5e-3, atol=1e-5)
    assert np.abs(left - right).max() > 0.1 * right.max()
