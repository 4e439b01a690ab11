"""What the denoiser takes away, and what it must leave alone: alpha, lamps, black, scale."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import Renderer, denoise
from tests.rendering import document, picture

SIZE = 64


def noisy(level: float = 0.5, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Truth, a noisy picture of it, and guides: two halves of different albedo under a light that falls off."""
    rng = np.random.default_rng(seed)
    albedo = np.where(np.arange(SIZE)[None, :, None] < SIZE // 2, 0.2, 0.8) * np.ones((SIZE, SIZE, 3))
    truth = albedo * np.linspace(0.3, 1, SIZE)[:, None, None]
    color = np.ones((SIZE, SIZE, 4), np.float32)
    color[..., :3] = truth * rng.gamma(1 / level**2, level**2, truth.shape)
    normal = np.broadcast_to(np.float32([0, 0, 1]), truth.shape)
    return truth, color, albedo.astype(np.float32), normal


def rmse(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean((a[..., :3].astype(float) - b[..., :3]) ** 2)))


@pytest.mark.parametrize("fine", [False, True])
def test_takes_the_noise_and_leaves_the_edge(fine: bool) -> None:
    truth, color, albedo, normal = noisy()
    smooth = denoise.denoise(color, albedo, normal, fine)
    assert denoise.missing() is None
    assert rmse(smooth, truth) < 0.2 * rmse(color, truth)
    edge = slice(SIZE // 2 - 2, SIZE // 2 + 2)
    assert rmse(smooth[:, edge], truth[:, edge]) < 0.4 * rmse(color[:, edge], truth[:, edge])


def test_gives_the_same_bits_again() -> None:
    _, color, albedo, normal = noisy()
    once = denoise.denoise(color, albedo, normal)
    assert all(np.array_equal(denoise.denoise(color, albedo, normal), once) for _ in range(3))


@pytest.mark.parametrize("power", [-60, -30, 30, 60])
def test_knows_no_scale(power: int) -> None:
    """2^66 is 1e20, the most radiance there is; the library alone fails below 1e-10."""
    _, color, albedo, normal = noisy()
    scaled = color * np.float32([2.0**power] * 3 + [1])
    expected = denoise.denoise(color, albedo, normal)[..., :3] * np.float32(2.0**power)
    assert denoise.denoise(scaled, albedo, normal)[..., :3] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("radiance", [1e6, 1e20])
def test_lamps_keep_their_radiance(radiance: float) -> None:
    truth, color, albedo, normal = noisy()
    color[20:24, 20:24, :3] = radiance
    smooth = denoise.denoise(color, albedo, normal)
    assert np.array_equal(smooth[20:24, 20:24], color[20:24, 20:24])
    assert np.isfinite(smooth).all() and (smooth >= 0).all()
    assert rmse(smooth[40:], truth[40:]) < 0.3 * rmse(color[40:], truth[40:])


def test_alpha_is_left_alone_and_nothing_stays_nothing() -> None:
    truth, color, albedo, normal = noisy()
    normal = normal.copy()
    for array in (color, albedo, normal):
        array[:16] = 0  # nothing is hit there
        array[16] *= np.float32(0.25)  # and an edge between
    smooth = denoise.denoise(color, albedo, normal)
    assert np.array_equal(smooth[..., 3], color[..., 3])
    assert (smooth[:16] == 0).all()
    assert (smooth[16, :, :3] / 0.25 - truth[16]).max() < 0.1  # no bright fringe


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (5, 7), (300, 1)])
def test_tiny_pictures_come_back_as_they_are(shape: tuple[int, int]) -> None:
    color = np.random.default_rng(1).random((*shape, 4), np.float32)
    guide = np.ones((*shape, 3), np.float32)
    assert np.array_equal(denoise.denoise(color, guide, guide), color)


def test_black_stays_black() -> None:
    color, guide = np.zeros((SIZE, SIZE, 4), np.float32), np.zeros((SIZE, SIZE, 3), np.float32)
    assert np.array_equal(denoise.denoise(color, guide, guide), color)


ROOM = {
    "environment": {"type": "constant", "radiance": 0.2},
    "lights": [{"type": "point", "position": [1, 3, 2], "intensity": 20}],
    "materials": {"red": {"type": "diffuse", "albedo": [0.7, 0.2, 0.1]}, "floor": {"type": "diffuse", "albedo": 0.6}},
}
SHAPES = [
    {"type": "sphere", "center": [0, 0, 0], "radius": 0.8, "material": "red"},
    {"type": "quad", "origin": [-6, -0.8, 6], "u": [12, 0, 0], "v": [0, 0, -12], "material": "floor"},
]


def test_a_rendered_picture_gains(gpu: Renderer) -> None:
    scene = document(SHAPES, **ROOM)
    size = {"width": 64, "height": 64, "max_bounces": 4}
    reference = picture(gpu, scene, 2048, seed=9, **size).read()
    few = picture(gpu, scene, 4, **size)
    smooth = denoise.denoise(few.read(), *few.guides(denoise.GUIDE_SAMPLES))
    assert rmse(smooth, reference) < 0.5 * rmse(few.read(), reference)


def test_guides_do_not_depend_on_who_asked_before(gpu: Renderer) -> None:
    one, other = (picture(gpu, document(SHAPES, **ROOM), 40, width=40, height=24) for _ in range(2))
    before = one.read("normal")
    early = one.guides(16)
    assert np.array_equal(one.read("normal"), before)
    assert all(np.array_equal(a, b) for a, b in zip(early, other.guides(16), strict=True))
    one.trace_guides(0.0)  # all of them, begun and not finished
    assert all(np.array_equal(a, b) for a, b in zip(early, one.guides(16), strict=True))


def test_display_of_another_colour(gpu: Renderer) -> None:
    made = picture(gpu, document(SHAPES, **ROOM), 7, width=40, height=24)
    own = made.read()
    assert np.abs(made.display(color=own).astype(int) - made.display()).max() <= 1
    assert made.display(color=own * np.float32([0, 0, 0, 1]))[..., :3].max() == 0
    assert np.array_equal(made.read(), own)
