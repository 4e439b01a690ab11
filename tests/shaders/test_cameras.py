"""Cameras without a lens: parallel rays and panoramas, against what closed forms say is where in the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.document import parse_scene
from service.problems import InvalidDocument
from tests.rendering import Images, document, render

FLAT = {"type": "diffuse", "albedo": 0, "emission": 1}
FROM = {"position": [3, 2, 10], "target": [3, 2, 0]}
BOX = {"filter": "box", "width": 64, "height": 32}


def ball(x: float, y: float, z: float, radius: float) -> dict[str, Any]:
    return {"type": "sphere", "center": [x, y, z], "radius": radius, "material": "m"}


def orthographic(height: float, **more: Any) -> dict[str, Any]:
    return FROM | {"type": "orthographic", "height": height} | more


def test_parallel_rays_show_things_as_large_at_any_distance(gpu: Renderer) -> None:
    balls = [ball(1, 2, 5, 1), ball(5, 2, -2000, 1)]
    shown = render(gpu, document(balls, {"m": FLAT}, camera=orthographic(4)), 64, max_bounces=0, **BOX)[..., 0]
    near, far = shown[:, :32], shown[:, 32:]
    area = np.pi / (4 / 32) ** 2
    assert abs(near.sum() / area - 1) < 0.01 and abs(far.sum() / area - 1) < 0.01
    middles = [np.average(np.arange(32), weights=half.sum(0)) for half in (near, far)]
    assert middles[0] == pytest.approx(15.5, abs=0.1) and middles[1] == pytest.approx(15.5, abs=0.1)
    depth = render(gpu, document(balls, {"m": FLAT}, camera=orthographic(4)), 1, "depth", max_bounces=0, **BOX)
    assert depth[16, 16] == pytest.approx(4, abs=0.02) and depth[16, 48] == pytest.approx(2009, abs=0.1)


def test_parallel_rays_do_not_meet_what_is_behind_the_camera(gpu: Renderer) -> None:
    scene = document([ball(3, 2, 12, 1)], {"m": FLAT}, camera=orthographic(4))
    assert render(gpu, scene, 4, max_bounces=0, **BOX).max() == 0


def test_each_parallel_ray_begins_in_its_own_body(gpu: Renderer) -> None:
    """Half of the picture's rays begin in a body that absorbs."""
    water = {"type": "principled", "transmission": 1, "ior": 1, "roughness": 0, "base_color": 1}
    water |= {"attenuation_color": [0.5, 0.5, 0.5], "attenuation_distance": 4}
    body = {"type": "box", "min": [-3, -8, 4], "max": [3, 12, 12], "material": "water"}
    sky = {"type": "constant", "radiance": 1}
    scene = document([body], {"water": water}, camera=orthographic(4), environment=sky)
    shown = render(gpu, scene, 16, max_bounces=8, **BOX)[..., 0]
    assert np.allclose(shown[:, 33:], 1, atol=1e-4)
    assert np.allclose(shown[:, :31], 0.5 ** (6 / 4), atol=1e-3), "6 m within it"


def test_a_panorama_of_an_environment_is_its_image(gpu: Renderer) -> None:
    image = np.random.default_rng(5).uniform(0.1, 1, (32, 64, 3)).astype(np.float32)
    sky = {"type": "image", "asset": "sha256:sky"}
    camera = {"position": [0, 0, 0], "target": [0, 0, -1], "type": "panorama"}
    scene = document([], {}, camera=camera, environment=sky)
    assets = Images(**{"sha256:sky": image})
    shown = render(gpu, scene, 1024, assets=assets, **BOX)[..., :3]
    inner = slice(4, 28)
    assert np.abs(shown[inner] - smoothed(image)[inner]).max() < 0.02
    turned = scene | {"camera": camera | {"target": [1, 0, 0]}}
    shown = render(gpu, turned, 1024, assets=assets, **BOX)[..., :3]
    assert np.abs(shown[inner] - np.roll(smoothed(image), -16, 1)[inner]).max() < 0.02, "+X is a quarter to the right"


def smoothed(image: np.ndarray) -> np.ndarray:
    """The mean over each texel of what is interpolated between texels: 1/8, 3/4, 1/8 along each axis."""
    across = (np.roll(image, 1, 1) + 6 * image + np.roll(image, -1, 1)) / 8
    above, below = np.concatenate([across[:1], across[:-1]]), np.concatenate([across[1:], across[-1:]])
    out: np.ndarray = (above + 6 * across + below) / 8
    return out


def test_the_target_is_in_the_middle_of_a_panorama(gpu: Renderer) -> None:
    camera = {"position": [1, 1, 1], "target": [4, 3, -2], "type": "panorama"}
    shown = render(gpu, document([ball(4, 3, -2, 0.3)], {"m": FLAT}, camera=camera), 64, max_bounces=0, **BOX)[..., 0]
    rows, columns = np.indices(shown.shape)
    assert np.average(rows, weights=shown) == pytest.approx(15.5, abs=0.05)
    assert np.average(columns, weights=shown) == pytest.approx(31.5, abs=0.05)


def test_a_panorama_sees_a_room_of_one_colour_everywhere(gpu: Renderer) -> None:
    camera = {"position": [0, 0, 0], "target": [0.3, 0.2, -1], "type": "panorama"}
    scene = document([ball(0, 0, 0, 5)], {"m": FLAT | {"emission_sides": "both"}}, camera=camera)
    shown = render(gpu, scene, 4, max_bounces=0, width=64, height=32, filter="blackman_harris")
    assert np.all(shown[..., 0] == 1), "the poles too, where filters reach beyond the picture"


@pytest.mark.parametrize(
    ("fields", "pointer", "says"),
    [
        ({"type": "orthographic"}, "/camera/height", "required"),
        ({"type": "orthographic", "height": 0}, "/camera/height", "must be above 0"),
        ({"type": "orthographic", "height": 1, "aperture_radius": 0.1}, "/camera/aperture_radius", ""),
        ({"type": "panorama", "vfov": 40}, "/camera/vfov", ""),
        ({"height": 4}, "/camera/height", ""),
        ({"type": "fisheye"}, "/camera/type", "orthographic"),
        ({"type": "panorama", "target": [3, 2, 10]}, "/camera", "must differ"),
    ],
)
def test_what_belongs_to_another_camera_is_refused(fields: dict[str, Any], pointer: str, says: str) -> None:
    with pytest.raises(InvalidDocument) as refused:
        parse_scene(document([], {}, camera=FROM | fields))
    error = refused.value.errors[0]
    assert error.pointer == pointer and says in error.detail
