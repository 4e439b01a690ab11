"""Tone maps against their published forms, encodings of AOVs, and curves at the ends of their range."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import TONE_MAPS, NothingRendered, Picture, Renderer, RenderSettings
from gpu.picture.display import encode, srgb
from service.document import parse_scene
from service.pack import pack
from tests.rendering import Images, document, picture


def _neutral(c: np.ndarray) -> np.ndarray:
    """Khronos PBR Neutral, from its specification."""
    low = c.min(-1, keepdims=True)
    c = c - np.where(low < 0.08, low - 6.25 * low**2, 0.04)
    peak = c.max(-1, keepdims=True)
    pressed = 1 - 0.24**2 / (np.maximum(peak, 0.76) + 0.24 - 0.76)
    g = 1 - 1 / (0.15 * (peak - pressed) + 1)
    return np.where(peak < 0.76, c, c * pressed / np.maximum(peak, 1e-9) * (1 - g) + pressed * g)


def _aces(c: np.ndarray) -> np.ndarray:
    a = np.array([[0.59719, 0.35458, 0.04823], [0.076, 0.90834, 0.01566], [0.0284, 0.13383, 0.83777]])
    b = np.array([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]])
    y = c @ a.T
    return ((y * (y + 0.0245786) - 0.000090537) / (y * (0.983729 * y + 0.432951) + 0.238081)) @ b.T


CURVES: dict[str, Any] = {
    "linear": lambda c: c,
    "exponential": lambda c: 1 - np.exp(-c),
    "reinhard": lambda c: c / (1 + c),
    "aces": _aces,
    "pbr_neutral": _neutral,
}


@pytest.fixture(scope="module")
def patches(gpu: Renderer) -> Picture:
    """64 emitting quads of many colours and powers, one pixel each or more; no environment."""
    rng = np.random.default_rng(4)
    materials, shapes = {}, []
    for k in range(64):
        x, y = k % 8 - 4, k // 8 - 4
        emission = 10 ** rng.uniform(-2.5, 1.5) * (np.ones(3) if k % 4 == 0 else rng.uniform(0.02, 1, 3))
        materials[f"m{k}"] = {"type": "diffuse", "albedo": 0, "emission": emission.tolist()}
        shapes.append({"type": "quad", "origin": [x, y, 0], "u": [0.9, 0, 0], "v": [0, 0.9, 0], "material": f"m{k}"})
    camera = {"position": [0, 0, 10], "target": [0, 0, 0], "vfov": 44}
    return picture(gpu, document(shapes, materials, camera=camera), 4, width=64, height=64, max_bounces=0)


@pytest.mark.parametrize("tone_map", CURVES)
@pytest.mark.parametrize("exposure", [0.0, 1.5, -2.0])
def test_tone_maps_are_their_formula(patches: Picture, tone_map: str, exposure: float) -> None:
    linear = patches.read().astype(float)
    straight = linear[..., :3] / np.maximum(linear[..., 3:], 1e-9)
    expected = srgb(CURVES[tone_map](straight * 2**exposure))
    floats = patches.display(tone_map=tone_map, exposure=exposure, dtype="f4")
    np.testing.assert_allclose(floats[..., :3], expected, atol=2e-5)
    np.testing.assert_allclose(floats[..., 3], linear[..., 3], atol=1e-6)
    assert np.abs(patches.display(tone_map=tone_map, exposure=exposure) / 255 - floats).max() < 0.51 / 255


def test_agx_keeps_greys_grey_and_in_order(patches: Picture) -> None:
    shown = patches.display(tone_map="agx", dtype="f4")
    linear = patches.read()
    grey = (linear[..., 3] == 1) & (np.ptp(linear[..., :3], axis=2) < 1e-6)
    greys, order = shown[grey][:, :3], np.argsort(linear[grey][:, 0])
    assert np.ptp(greys, axis=1).max() < 0.008
    assert (np.diff(greys[order, 1]) >= -1e-6).all()
    assert np.ptp(greys) > 0.5


@pytest.mark.parametrize("tone_map", TONE_MAPS)
@pytest.mark.parametrize("radiance", [0.0, 1e-20, 1.0, 1e20])
def test_curves_end_in_their_limits(gpu: Renderer, tone_map: str, radiance: float) -> None:
    scene = document([], environment={"type": "constant", "radiance": [radiance, 0, radiance]})
    made = picture(gpu, scene, 2, width=8, height=8, max_bounces=0)
    for exposure in (-60.0, 0.0, 60.0):
        shown = made.display(tone_map=tone_map, exposure=exposure, dtype="f4")
        assert np.isfinite(shown).all()
        assert (shown >= 0).all()
        assert (shown <= 1).all()
    made.release()


def test_aovs_are_shown(patches: Picture) -> None:
    depth = patches.display("depth")
    assert depth[..., 0].max() == 255
    covered = patches.read()[..., 3] == 1
    normal = patches.display("normal")[covered][0]
    assert abs(int(normal[2]) - 255) <= 1
    assert abs(int(normal[0]) - 128) <= 1
    assert patches.display("albedo").shape == (64, 64, 4)


def test_nothing_before_the_first_sample(gpu: Renderer) -> None:
    loaded = gpu.load(pack(parse_scene(document([])), Images()).arrays)
    made = gpu.picture(loaded, RenderSettings(8, 8))
    assert made.noise() is None
    with pytest.raises(NothingRendered):
        made.read()
    with pytest.raises(NothingRendered):
        made.display()


def test_thin_lens_blurs_by_its_circle_of_confusion(gpu: Renderer) -> None:
    """A small lamp at twice the focus distance spreads over a disk as wide as the lens, and keeps its light."""
    lamp = {"type": "sphere", "center": [0, 0, 0], "radius": 0.01, "material": "lamp"}
    materials = {"lamp": {"type": "diffuse", "albedo": 0, "emission": 100}}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 10, "focus_distance": 2}
    size = {"width": 64, "height": 64, "max_bounces": 0}
    images = [
        picture(gpu, document([lamp], materials, camera={**camera, "aperture_radius": a}), 4096, **size).read()
        for a in (0.0, 0.1)
    ]
    assert images[1][..., 0].sum() == pytest.approx(images[0][..., 0].sum(), rel=0.02)
    y, x = np.mgrid[:64, :64] + 0.5
    pixel = 2 * 4 * np.tan(np.radians(5)) / 64
    r = np.hypot(x - 32, y - 32) * pixel
    lit = images[1][..., 0] > 0
    assert r[lit].max() == pytest.approx(0.1, abs=0.01 + 1.5 * pixel)
    inner = images[1][..., 0][r < 0.08]
    assert inner.std() / inner.mean() < 0.2  # the disk is evenly lit


def test_clamp_bounds_indirect_light_only(gpu: Renderer) -> None:
    floor = {"type": "quad", "origin": [-2, -1, 2], "u": [4, 0, 0], "v": [0, 0, -4], "material": "m"}
    wall = {"type": "quad", "origin": [-2, -1, -1], "u": [4, 0, 0], "v": [0, 3, 0], "material": "m"}
    light = {"type": "point", "position": [0, -0.9, -0.9], "intensity": 5}
    scene = document([floor, wall], {"m": {"type": "diffuse", "albedo": 0.8}}, lights=[light])
    direct = picture(gpu, scene, 64, max_bounces=1).read()
    full = picture(gpu, scene, 64, max_bounces=4).read()
    clamped = picture(gpu, scene, 64, max_bounces=4, clamp=0.05).read()
    assert (picture(gpu, scene, 64, max_bounces=1, clamp=0.05).read() == direct).all()
    assert direct[..., :3].sum() < clamped[..., :3].sum() < 0.97 * full[..., :3].sum()


def test_ids_are_told_apart_by_colour() -> None:
    ids = np.arange(9, dtype=np.float32).reshape(3, 3, 1)
    shown = encode("shape_id", ids).reshape(9, 4)
    assert (shown[0] == [0, 0, 0, 255]).all()
    apart = np.abs(shown[:, None, :3].astype(int) - shown[None, :, :3]).max(axis=2)
    assert (apart + 255 * np.eye(9)).min() > 30
