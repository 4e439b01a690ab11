"""Kernels filter the colours of a texture of opacity only where some material reads its opacity from them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, SceneEdit
from gpu.arrays import SceneArrays
from gpu.kernels import features
from service.document import parse_scene
from service.pack import pack
from tests.rendering import Images, document

RNG = np.random.default_rng(9)
IMAGES = {
    "color": RNG.integers(0, 256, (4, 4, 3)).astype(np.uint8),
    "mask": RNG.integers(0, 256, (4, 4, 4)).astype(np.uint8),
}
TEXTURES = {"color": {"asset": "color"}, "mask": {"asset": "mask"}}
COLORED = {"type": "principled", "base_color": {"texture": "color"}, "roughness": {"texture": "mask", "channel": "g"}}


def veiled(channel: str) -> dict[str, Any]:
    return {"type": "diffuse", "albedo": 0.5, "alpha": {"texture": "mask", "channel": channel}}


def packed(*materials: dict[str, Any]) -> SceneArrays:
    balls = [
        {"type": "sphere", "center": [1.5 * k, 0, 0], "radius": 0.7, "material": f"m{k}"}
        for k in range(len(materials))
    ]
    named = {f"m{k}": material for k, material in enumerate(materials)}
    scene = document(balls, named, textures=TEXTURES, environment={"type": "constant", "radiance": 1})
    return pack(parse_scene(scene), Images(**IMAGES)).arrays


@pytest.mark.parametrize(("channels", "in_alpha"), [("a", 1), ("aa", 1), ("r", 0), ("ar", 0)])
def test_opacity_is_known_to_be_in_alpha(channels: str, in_alpha: int) -> None:
    arrays = packed(COLORED, *map(veiled, channels))
    assert features.counts(arrays)["TEXTURE_OPACITY_IN_ALPHA"] == in_alpha


def test_an_edit_to_another_channel_gets_another_kernel(gpu: Renderer) -> None:
    """In place, to the bit what a scene packed anew shows."""
    pictures = []
    before, after = packed(veiled("a")), packed(veiled("g"))
    assert before.textures is not None and after.textures is not None
    for arrays, words in ((before, after.textures.words), (after, None), (before, None)):
        scene = gpu.load(arrays)
        picture = gpu.picture(scene, RenderSettings(16, 16, max_bounces=2))
        picture.trace(60.0, 1)
        if words is not None:
            scene.edit(SceneEdit(texture_words=words).apply(arrays))
        picture.reset()
        picture.trace(60.0, 4)
        pictures.append(picture.read())
        picture.release()
        scene.release()
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
