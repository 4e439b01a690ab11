"""Lights are asked several times for each sample, where they are what is noisy: the same picture, with less noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.kernels import source
from tests.probing import prober_of
from tests.rendering import Images, document, picture
from tests.shaders.numbers import draw

SKY = Images(sky=np.random.default_rng(8).exponential(1, (8, 16, 3)).astype(np.float32) ** 3)
ROOM = [
    {"type": "sphere", "center": [0, 0, 0], "radius": 0.9, "material": "ball"},
    {"type": "quad", "origin": [-3, -1, 3], "u": [6, 0, 0], "v": [0, 0, -6], "material": "floor"},
    {"type": "quad", "origin": [-0.5, 1.6, -0.5], "u": [1, 0, 0], "v": [0, 0, 1], "material": "lamp"},
]
MATTE, METAL = {"type": "diffuse", "albedo": 0.7}, {"type": "principled", "metallic": 1}
GLASS = {"type": "principled", "transmission": 1, "roughness": 0.3}


def room(ball: dict[str, Any], floor: dict[str, Any] = MATTE) -> dict[str, Any]:
    materials = {"ball": ball, "floor": floor, "lamp": {"type": "diffuse", "albedo": 0, "emission": 6}}
    return document(list(ROOM), materials, environment={"type": "image", "asset": "sky", "background": False})


@pytest.mark.parametrize("doublings", [1, 2])
def test_parts_are_a_sequence_of_as_many_more(gpu: Renderer, doublings: int) -> None:
    assert np.array_equal(*(draw(prober_of(gpu), 0, 64, doublings=parts) for parts in (doublings, 0)))


@pytest.mark.parametrize("ball", [{**METAL, "roughness": 0.4}, GLASS], ids=["metal", "glass"])
def test_it_shows_the_same_picture(gpu: Renderer, ball: dict[str, Any]) -> None:
    """As weighed against paths that find the lights by themselves."""
    means, errors = [], []
    for estimator in ("mis", "bsdf"):
        made = picture(gpu, room(ball), 1500, SKY, estimator=estimator, sampler="independent", max_bounces=3)
        means.append(made.read()[..., :3].reshape(8, 4, 8, 4, 3).mean((1, 3)))
        errors.append(made.read("variance").reshape(8, 4, 8, 4, 3).mean((1, 3)) / 16)
    z = (means[1] - means[0]) / np.sqrt(errors[0] + errors[1] + 1e-12)
    assert np.sqrt((z**2).mean()) < 1.35
    assert abs(means[1].mean() / means[0].mean() - 1) < 0.01


def pictures(gpu: Renderer, scene: dict[str, Any], samples: int, **settings: Any) -> tuple[np.ndarray, np.ndarray]:
    """As it is, and by a renderer whose lights are asked once."""
    read = source._read

    def changed(name: str, folders: Any) -> str:
        text = read(name, folders)
        assert name != "path/direct.glsl" or "&& surface_is_broad(s)" in text
        return text.replace("&& surface_is_broad(s)", "&& false")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(source, "_read", changed)
        patch.setattr(source, "_packaged", lambda entry: source._Assembly((source.SHADERS,)).make(entry))
        with Renderer() as renderer:
            once = picture(renderer, scene, samples, SKY, **settings).read()[..., :3]
    return picture(gpu, scene, samples, SKY, **settings).read()[..., :3], once


def test_matte_surfaces_gain(gpu: Renderer) -> None:
    scene = room(MATTE)
    scene["shapes"].pop()  # a ball under the sky alone
    truth = picture(gpu, scene, 2048, SKY, seed=5).read()[..., :3]
    often, once = (((made - truth) ** 2).mean() for made in pictures(gpu, scene, 16, seed=3))
    assert often < 0.35 * once


@pytest.mark.llvmpipe
@pytest.mark.exact  # two texts of a kernel that LLVM rounds alike
def test_mirrors_and_glass_are_not_asked_again(gpu: Renderer) -> None:
    """Their noise is from elsewhere: bit for bit what it was."""
    for ball in ({**METAL, "roughness": 0.1}, GLASS):
        assert np.array_equal(*pictures(gpu, room(ball, ball), 4, max_bounces=4))


@pytest.mark.llvmpipe
def test_a_sky_that_is_the_same_everywhere_is_not_asked_again(gpu: Renderer) -> None:
    scene = room(MATTE)
    scene["environment"] = {"type": "constant", "radiance": 1}
    assert np.array_equal(*pictures(gpu, scene, 4))
