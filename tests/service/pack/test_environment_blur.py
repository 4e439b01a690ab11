"""Blurred environments: the kernel is what it says, keeps the light, and costs nothing where it is 0."""

from __future__ import annotations

import numpy as np
import pytest

from gpu.tables.alias_table import solid_angles
from service.pack.lights.environment_blur import CUBE_FACES, MOST_WIDTH, blur_cube, blur_image
from tests.documents import Shelf, packed, picture, refused, sphere

SKY = picture(np.random.default_rng(4).random((16, 32, 3)) ** 4)
FACE = picture(np.random.default_rng(5).random((8, 8, 3)))
IMAGE = {"type": "image", "asset": "sha256:sky"}
CUBE = {"type": "cubemap", "assets": dict.fromkeys(CUBE_FACES, "sha256:face")}


def directions(height: int, width: int) -> np.ndarray:
    """Of texel centres, (height, width, 3), by the contract's formulas."""
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    polar = (np.arange(height)[:, None] + 0.5) / height * np.pi
    x, y, z = np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)
    return np.stack(np.broadcast_arrays(x, y, z), axis=2)


@pytest.mark.parametrize("environment", [IMAGE, CUBE])
def test_no_blur_changes_nothing(environment):
    shelf = Shelf(sky=SKY, face=FACE)
    plain, zero, some = (
        packed(sphere(), environment={**environment, **more}, assets=shelf).arrays.environment
        for more in ({}, {"blur": 0}, {"blur": 20})
    )
    assert plain.cube == zero.cube == (environment is CUBE)
    for name in ("texels", "probability", "cells"):
        assert getattr(plain, name).tobytes() == getattr(zero, name).tobytes()
    assert not some.cube and some.texels.tobytes() != plain.texels.tobytes()
    assert some.texels.std() < 0.5 * plain.texels.std()


@pytest.mark.parametrize("degrees", [12, 60])
def test_blur_is_a_convolution_over_the_sphere(degrees):
    """At the poles and across the seam as elsewhere; summed here texel by texel."""
    texels = SKY.pixels
    blurred = blur_image(texels, degrees)
    solid = np.repeat(solid_angles(16, 32), 32)
    cosine = directions(*blurred.shape[:2]).reshape(-1, 3) @ directions(16, 32).reshape(-1, 3).T
    kernel = np.exp((cosine - 1) / np.radians(degrees) ** 2) * solid
    expected = kernel @ texels.reshape(-1, 3) / kernel.sum(axis=1, keepdims=True)
    assert blurred.shape == texels.shape
    assert blurred.reshape(-1, 3) == pytest.approx(expected, rel=1e-5)


def test_reducing_a_picture_first_hardly_shows():
    """Its texels are a quarter of the blur then."""
    texels = picture(np.random.default_rng(6).random((180, 360, 3)) ** 8).pixels
    blurred = blur_image(texels, 10)
    assert blurred.shape == (128, 256, 3)  # powers of two: kernels are compiled for those or for others
    cosine = directions(128, 256)[::7, ::7].reshape(-1, 3) @ directions(180, 360).reshape(-1, 3).T
    kernel = np.exp((cosine - 1) / np.radians(10) ** 2) * np.repeat(solid_angles(180, 360), 360)
    expected = kernel @ texels.reshape(-1, 3) / kernel.sum(axis=1, keepdims=True)
    assert blurred[::7, ::7].reshape(-1, 3) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("degrees", [1e-6, 0.7, 9, 90])
def test_blur_keeps_the_light(degrees):
    sun = np.ones((90, 180, 3), np.float32)
    assert blur_image(sun, degrees) == pytest.approx(1, abs=1e-6)
    sun[20, 31] = 1e6
    blurred = blur_image(sun, degrees)
    before, after = ((x[..., 0] * solid_angles(*x.shape[:2])[:, None]).sum() for x in (sun, blurred))
    assert after == pytest.approx(before, rel=1e-4) and blurred.min() >= 1 - 1e-6


def test_a_cube_is_blurred_like_the_picture_of_the_same_light():
    def radiance(d: np.ndarray) -> np.ndarray:
        lamp = 40 * np.exp(60 * (d @ np.array([0.48, 0.6, -0.64]) - 1))
        return np.stack([1 + d[..., 0] + lamp, 1 + d[..., 1] + lamp, 1 + d[..., 2] + lamp], axis=-1)

    t = (2 * np.arange(64) + 1) / 64 - 1
    faces = []
    for ahead, right, down in CUBE_FACES.values():
        d = np.array(ahead) + np.multiply.outer(t, down)[:, None] + np.multiply.outer(t, right)
        faces.append(radiance(d / np.linalg.norm(d, axis=2, keepdims=True)).astype(np.float32))
    of_cube = blur_cube(faces, 6)
    of_image = blur_image(radiance(directions(*of_cube.shape[:2])).astype(np.float32), 6)
    assert of_cube == pytest.approx(of_image, rel=0.02, abs=0.06)


def test_the_faces_of_a_cube_lie_where_the_contract_says():
    """With s to the right and t down from 0 to 1."""
    said = {
        "px": lambda s, t: (1, 1 - 2 * t, 1 - 2 * s),
        "nx": lambda s, t: (-1, 1 - 2 * t, 2 * s - 1),
        "py": lambda s, t: (2 * s - 1, 1, 2 * t - 1),
        "ny": lambda s, t: (2 * s - 1, -1, 1 - 2 * t),
        "pz": lambda s, t: (2 * s - 1, 1 - 2 * t, 1),
        "nz": lambda s, t: (1 - 2 * s, 1 - 2 * t, -1),
    }
    for name, (ahead, right, down) in CUBE_FACES.items():
        for s, t in ((0.5, 0.5), (0.2, 0.9)):
            ours = np.array(ahead) + (2 * s - 1) * np.array(right) + (2 * t - 1) * np.array(down)
            assert ours == pytest.approx(said[name](s, t))


def test_a_blurred_picture_has_a_bounded_size():
    assert blur_image(np.ones((1500, 3000, 3), np.float32), 0.01).shape == (MOST_WIDTH // 2, MOST_WIDTH, 3)
    assert blur_image(np.ones((1500, 3000, 3), np.float32), 15).shape == (64, 128, 3)


@pytest.mark.parametrize(
    ("environment", "pointer"),
    [
        ({**IMAGE, "blur": -1}, "/environment/blur"),
        ({**CUBE, "blur": 91}, "/environment/blur"),
        ({"type": "constant", "radiance": 1, "blur": 5}, "/environment/blur"),
    ],
)
def test_wrong_blurs_are_refused(environment, pointer):
    assert refused(sphere(), environment=environment) == [pointer]
