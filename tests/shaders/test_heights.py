"""A height's normal is that of the surface which it displaces, on every shape that has texture coordinates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from tests.normal_maps import facing
from tests.rendering import Images, document, render
from tests.shaders.textured import BALL, BARE, BOX, QUAD, at, on_ball

N = 8
ALONG = (np.arange(N, dtype=np.float32) + 0.5) / N
RIGHT = np.broadcast_to(ALONG, (N, N)).copy()  # grows along u, to 1 over the image
UP = np.flipud(RIGHT.T).copy()  # row 0 is at the top
WAVE = np.sin(2 * np.pi * ALONG)[None, :].repeat(N, 0).astype(np.float32)
IMAGES = Images(
    **{name: image[..., None].repeat(3, 2) for name, image in (("right", RIGHT), ("up", UP), ("wave", WAVE))},
    bent=facing(0.6, 0, 0.8),
)
TEXTURES = {name: {"asset": name, "wrap": "clamp"} for name in ("right", "up", "bent")}


def seen(gpu: Renderer, shape: Any, place: Any, away: Any, texture: Any, **material: Any) -> np.ndarray:
    """The shading normal at a place, on the outward side. The height is `texture` times 0.3 m."""
    height = {"texture": "t", "scale": 0.3}
    scene = document([shape], {"m": {"type": "diffuse", "albedo": 1, "height": height, **material}},
                     textures={"t": texture, **TEXTURES}, camera=at(place, away, (0.01, 1, 0.01)))  # fmt: skip
    return render(gpu, scene, 1, "normal", assets=IMAGES, width=8, height=8).mean((0, 1))


def tilted(n: Any, u: Any, slope: float) -> np.ndarray:
    """The normal n of a surface that rises by `slope` along u."""
    out = np.array(n, float) - slope * np.array(u, float)
    return out / np.linalg.norm(out)


MESH = {
    **BARE, "vertices": [[-1, -1, 0], [1, -1, 0], [1, 3, 0], [-1, 3, 0]], "faces": [[0, 1, 2], [0, 2, 3]],
    "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]],
}  # fmt: skip
P, EAST = on_ball(1, 0, 0)[0], [0, 0, -1]
LENGTHS = [
    # shape, place, from where, which way u and v grow there, and how far for a unit; outward
    (QUAD, [0.3, 0.2, 0], [0, 0, 3], [1, 0, 0], 2, [0, 1, 0], 2, [0, 0, 1]),
    (QUAD, [0.3, 0.2, 0], [0, 0, -3], [1, 0, 0], 2, [0, 1, 0], 2, [0, 0, 1]),
    ({**QUAD, "transform": {"scale": [-3, 1, 1]}}, [0.3, 0.2, 0], [0, 0, 3], [-1, 0, 0], 6, [0, 1, 0], 2, [0, 0, 1]),
    (BOX, [1, 0.5, 1], [4, 0, 0], EAST, 6, [0, 1, 0], 4, [1, 0, 0]),
    (BOX, [0.5, 2, 1], [0, 4, 0.01], [1, 0, 0], 2, [0, 0, -1], 6, [0, 1, 0]),
    (BALL, P, [2, 0, 0], EAST, 4 * math.pi, [0, 1, 0], 2 * math.pi, [1, 0, 0]),
    ({**BALL, "transform": {"scale": [1, 2, 1]}}, P, [2, 0, 0], EAST, 4 * math.pi, [0, 1, 0], 4 * math.pi, [1, 0, 0]),
    (MESH, [0.3, 0.2, 0], [0, 0, 3], [1, 0, 0], 2, [0, 1, 0], 4, [0, 0, 1]),
    ({**MESH, "transform": {"scale": 2}}, [0.3, 0.2, 0], [0, 0, 3], [1, 0, 0], 4, [0, 1, 0], 8, [0, 0, 1]),
]  # fmt: skip


@pytest.mark.parametrize(("shape", "place", "away", "u", "per_u", "v", "per_v", "n"), LENGTHS)
def test_a_ramp_is_a_tilted_plane(
    gpu: Renderer, shape: Any, place: Any, away: Any, u: Any, per_u: float, v: Any, per_v: float, n: Any
) -> None:
    side = np.sign(np.dot(away, n))
    for name, along, length in (("right", u, per_u), ("up", v, per_v)):
        got = seen(gpu, shape, place, away, {"asset": name, "wrap": "clamp"})
        np.testing.assert_allclose(got, side * tilted(n, along, 0.3 / length), atol=1e-6)


@pytest.mark.parametrize(
    ("placing", "u", "v"),
    [
        ({"scale": [0.5, 1]}, 0.5, 0),
        ({"scale": [-1, 1], "offset": [1, 0]}, -1, 0),
        ({"rotation": 90, "offset": [1, 0]}, 0, -1),  # u' is 1 - v
        ({"rotation": 30, "scale": [0.5, 0.25], "offset": [0.3, 0.1]}, 0.5 * math.cos(math.pi / 6), -0.125),
        ({"scale": [0, 1], "offset": [0.5, 0]}, 0, 0),
    ],
)
def test_a_textures_transform_turns_its_slopes(gpu: Renderer, placing: Any, u: float, v: float) -> None:
    got = seen(gpu, QUAD, [0.1, 0.2, 0], [0, 0, 3], {"asset": "right", "wrap": "clamp", **placing})
    expected = np.array([-0.15 * u, -0.15 * v, 1])
    np.testing.assert_allclose(got, expected / np.linalg.norm(expected), atol=1e-6)


def test_a_repeated_image_has_no_edge(gpu: Renderer) -> None:
    """The slope of a sine over one period, at the seam as in the middle, and between the texels."""
    for x in (-0.99, -0.4, 0.13, 0.999):
        got = seen(gpu, QUAD, [x, 0.2, 0], [0, 0, 3], {"asset": "wave"})
        slope = 0.3 / 2 * 2 * math.pi * math.cos(math.pi * (x + 1))  # eight samples tell it within a tenth
        np.testing.assert_allclose(-got[0] / got[2], slope, atol=0.1 * 0.3 * math.pi)


def test_the_channel_and_the_scale_decide_and_the_midlevel_does_not(gpu: Renderer) -> None:
    plane = [0.1, 0.2, 0], [0, 0, 3], {"asset": "bent"}
    assert seen(gpu, QUAD, *plane) == pytest.approx([0, 0, 1], abs=1e-6)  # a single colour
    place = [0.1, 0.2, 0], [0, 0, 3], {"asset": "right", "wrap": "clamp"}
    deep = seen(gpu, QUAD, *place, height={"texture": "t", "scale": -0.6, "midlevel": 0.1, "channel": "b"})
    np.testing.assert_allclose(deep, tilted([0, 0, 1], [1, 0, 0], -0.3), atol=1e-6)
    none = seen(gpu, QUAD, *place, height={"texture": "t", "scale": 1, "shading": False})
    np.testing.assert_allclose(none, [0, 0, 1], atol=1e-6)


def test_what_is_computed_has_slopes_too(gpu: Renderer) -> None:
    place = [0.1, 0.2, 0], [0, 0, 3]
    ramp = {"type": "ramp", "input": "v", "stops": [{"position": 0, "color": 0}, {"position": 1, "color": 1}]}
    np.testing.assert_allclose(seen(gpu, QUAD, *place, ramp), tilted([0, 0, 1], [0, 1, 0], 0.15), atol=1e-5)
    # Solid noise needs no texture coordinates: its slopes are those between the colours beside the place.
    noise = {"type": "noise", "scale": [3, 2, 1], "octaves": 2, "contrast": 1}
    bare = {name: value for name, value in MESH.items() if name != "uvs"}

    def value(x: float, y: float) -> float:
        scene = document([bare], {"m": {"type": "diffuse", "albedo": {"texture": "t"}}}, textures={"t": noise},
                         camera=at([x, y, 0], [0, 0, 3], (0.01, 1, 0.01)))  # fmt: skip
        return float(render(gpu, scene, 1, "albedo", width=8, height=8)[..., 0].mean())

    x, y, e = 0.1, 0.2, 0.02
    slopes = [value(x + e, y) - value(x - e, y), value(x, y + e) - value(x, y - e)]
    got = seen(gpu, bare, *place, noise)
    np.testing.assert_allclose(-got[:2] / got[2], 0.3 / (2 * e) * np.array(slopes), atol=5e-3)
    assert np.hypot(*got[:2]) > 0.05


def test_a_normal_map_lies_on_the_relief(gpu: Renderer) -> None:
    place = [0.1, 0.2, 0], [0, 0, 3], {"asset": "up", "wrap": "clamp"}
    got = seen(gpu, QUAD, *place, normal_map={"texture": "bent"})
    n = tilted([0, 0, 1], [0, 1, 0], 0.15)
    np.testing.assert_allclose(got, 0.6 * np.array([1, 0, 0]) + 0.8 * n, atol=1e-3)


STEEP = Images(t=np.random.default_rng(3).random((16, 16, 3)).astype(np.float32))


@pytest.mark.parametrize(
    "material",
    [
        {"type": "diffuse", "albedo": 1},
        {"type": "principled", "metallic": 1, "base_color": 1, "roughness": 0.3},
        {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0},
    ],
    ids=["diffuse", "metal", "glass"],
)
def test_a_white_furnace_stays_white_under_steep_heights(gpu: Renderer, material: Any) -> None:
    """Slopes of 2: what a lobe sends below the surface comes back, as under normal maps."""
    bumpy = {**material, "height": {"texture": "t", "scale": 0.6}}
    scene = document([BALL], {"m": bumpy}, textures={"t": {"asset": "t", "scale": [2, 1]}},
                     environment={"type": "constant", "radiance": 1, "background": False},
                     camera={"position": [1, 1, 7], "target": [0, 0, 0], "vfov": 36})  # fmt: skip
    image = render(gpu, scene, 64, assets=STEEP, max_bounces=600)
    white = image[image[..., 3] == 1][:, :3]
    error = white.std() / np.sqrt(len(white))
    assert white.mean() + 3 * error > 0.99 and white.mean() - 3 * error < 1.003, (white.mean(), error)


@pytest.mark.parametrize("maps", [{}, {"normal_map": {"texture": "bent"}}], ids=["alone", "beside a normal map"])
def test_a_coat_lies_on_the_relief(gpu: Renderer, maps: Any) -> None:
    """A lamp mirrored in the coat alone is where the tilted plane mirrors it, whatever bends the base."""
    coated = {"type": "principled", "base_color": 0, "specular": 0, "clearcoat": 1, "clearcoat_roughness": 0, **maps}
    ball = {"type": "sphere", "center": [2 * 0.96, 0, 2 * 0.28], "radius": 0.2, "material": "lamp"}

    def shot(**more: Any) -> float:
        lamp = {"type": "diffuse", "albedo": 0, "emission": 1}
        scene = document([QUAD, ball], {"m": {**coated, **more}, "lamp": lamp},
                         textures=TEXTURES, camera=at([0, 0, 0], [0, 0, 3]))  # fmt: skip
        return float(render(gpu, scene, 16, assets=IMAGES, width=8, height=8)[..., :3].mean())

    assert shot() == 0
    assert shot(height={"texture": "right", "scale": -1.5}) > 0.02  # the normal is (0.6, 0, 0.8)
