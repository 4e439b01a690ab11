"""Shapes whose emission is a texture are lights like others: each place sends what it shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.document import parse_scene
from service.pack import pack
from tests.light_trees import nodes_of, ways
from tests.rendering import Images, document, render

STRIPES = np.zeros((2, 4, 3), np.float32)
STRIPES[:, 0], STRIPES[:, 2] = [8, 2, 0], [0, 1, 6]
ASSETS = Images(s=STRIPES)
LAMP = {"type": "diffuse", "albedo": 0, "emission": {"texture": "s", "factor": 2}}
FLOOR = {"type": "quad", "origin": [-9, 0, 9], "u": [18, 0, 0], "v": [0, 0, -18], "material": "floor"}
OVER = {"type": "quad", "origin": [-1, 2, -1], "u": [2, 0, 0], "v": [0, 0, 2], "material": "lamp"}  # facing down
RECTANGLE = {
    "type": "mesh", "material": "lamp", "vertices": [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]],
    "faces": [[0, 1, 2], [0, 2, 3]], "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]],
}  # fmt: skip
SHAPES = {
    "quad": OVER,
    "mesh": RECTANGLE,
    "sphere": {"type": "sphere", "center": [0, 2, 0], "radius": 0.8, "material": "lamp"},
    "ellipsoid": {"type": "sphere", "center": [0, 2, 0], "radius": 0.8, "material": "lamp",
                  "transform": {"scale": [1.2, 1, 0.7]}},
    "box": {"type": "box", "min": [-0.5, 1.5, -0.5], "max": [0.5, 2.5, 0.5], "material": "lamp"},
}  # fmt: skip
DOWN = {"position": [0, 0.9, 0.3], "target": [0.4, 0, 0.2], "vfov": 70}


def scene_of(shape: dict[str, Any], **lamp: Any) -> dict[str, Any]:
    return document([FLOOR, shape], {"floor": {"type": "diffuse", "albedo": 0.5}, "lamp": {**LAMP, **lamp}},
                    textures={"s": {"asset": "s"}}, camera=DOWN)  # fmt: skip


@pytest.mark.parametrize("shape", ["quad", "mesh"])
@pytest.mark.parametrize("estimator", ["mis", "light"])
def test_the_light_on_a_floor_is_the_sum_over_the_lamp(gpu: Renderer, shape: str, estimator: str) -> None:
    camera = {"position": [0.4, 1, 0.3], "target": [0.4, 0, 0.3], "up": [0, 0, 1], "vfov": 0.01}
    scene = {**scene_of(SHAPES[shape]), "camera": camera}
    got = render(gpu, scene, 4096, assets=ASSETS, width=8, height=8, estimator=estimator)[..., :3].mean((0, 1))
    n = 400
    u, v = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n)
    x = (u * 4 - 0.5) % 4
    share = (x % 1)[..., None]
    columns = STRIPES[0].astype(float)
    emitted = 2 * ((1 - share) * columns[x.astype(int)] + share * columns[(x.astype(int) + 1) % 4])
    to = np.stack([2 * u - 1 - 0.4, 0 * u + 2, 2 * v - 1 - 0.3], -1)
    d2 = (to**2).sum(-1)
    want = 0.5 / np.pi * (emitted * (to[..., 1] ** 2 / d2**2)[..., None]).sum((0, 1)) * 4 / n**2
    np.testing.assert_allclose(got, want, rtol=0.01)


CUT = {"emission_sides": "both", "alpha": {"texture": "s", "channel": "r"}}
PAIRS = [
    *(pytest.param(shape, {}, marks=[pytest.mark.slow] * (shape in ("ellipsoid", "sphere"))) for shape in SHAPES),
    ("sphere", CUT),
    *(pytest.param(shape, CUT, marks=pytest.mark.slow) for shape in ("quad", "ellipsoid")),
]


@pytest.mark.parametrize(("shape", "more"), PAIRS)
def test_estimators_agree(gpu: Renderer, shape: str, more: Any) -> None:
    """Sampled or met, weighed or not: the same light."""
    scene = scene_of(SHAPES[shape], **more)
    means = {}
    for estimator in ("mis", "light", "bsdf"):
        samples = 1024 if estimator == "bsdf" else 256
        image = render(gpu, scene, samples, assets=ASSETS, width=16, height=16, estimator=estimator, max_bounces=2)
        means[estimator] = image[..., :3].mean((0, 1))
    for mean in means.values():
        np.testing.assert_allclose(mean, means["mis"], rtol=0.03, err_msg=str(means))


@pytest.mark.parametrize("shape", ["quad", "mesh"])
def test_a_black_texture_makes_no_lamp(gpu: Renderer, shape: str) -> None:
    """Files of glTF are full of them. Red alone where there is none is black, too."""
    black = Images(s=np.zeros((2, 2, 3), np.uint8), g=np.array([[[0, 9, 9]]], np.uint8))
    for asset, factor in (("s", 1), ("g", [1, 0, 0])):
        scene = scene_of(SHAPES[shape], emission={"texture": "s", "factor": factor})
        scene |= {"textures": {"s": {"asset": asset}}, "environment": {"type": "constant", "radiance": 1}}
        arrays = pack(parse_scene(scene), black).arrays
        assert len(arrays.lights) == 1 and np.isfinite(arrays.lights["probability"]).all()
        lit, plain = (render(gpu, one, 8, assets=black) for one in (scene, scene_of(
            SHAPES[shape], emission=0) | {"environment": scene["environment"]}))  # fmt: skip
        np.testing.assert_allclose(lit, plain, rtol=1e-4)


def test_dark_triangles_are_rarely_picked() -> None:
    """Ten thousand triangles of which the bright stripe covers a quarter: they get the picks."""
    n = 70
    x, z = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    at = np.arange((n + 1) * n).reshape(n, n + 1)[:, :-1].reshape(-1)
    faces = np.concatenate([np.stack([at, at + 1, at + n + 2], 1), np.stack([at, at + n + 2, at + n + 1], 1)])
    mesh = {
        "type": "mesh", "material": "lamp", "faces": faces.tolist(),
        "uvs": np.stack([x, z], -1).reshape(-1, 2).tolist(),
        "vertices": np.stack([x, 0 * x, z], -1).reshape(-1, 3).tolist(),
    }  # fmt: skip
    stripe = np.zeros((4, 64, 3), np.float32)
    stripe[:, 16:32] = 5
    arrays = pack(parse_scene(scene_of(mesh)), Images(s=stripe)).arrays
    uvs = arrays.triangle_uvs[arrays.lights["index"]].mean(1)
    bright = (uvs[:, 0] > 0.25) & (uvs[:, 0] < 0.5)
    shares = nodes_of(arrays.light_tree).intensity[[way[-1] for way in ways(arrays)]]
    assert shares[bright].sum() > 0.85 * shares.sum()
    assert (arrays.lights["probability"] > 0).all(), "none may be missed for good"
