"""A guess at an edited picture: right where the edit changes nothing, better than a small picture elsewhere."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.picture import prior
from service.document import parse_scene
from service.pack.parameters import pack_camera
from tests.rendering import picture
from tests.serving import SCENE

SIZE = {"width": 96, "height": 64, "max_bounces": 3}
SMALL = {**SIZE, "width": 24, "height": 16}


CAMERA = pack_camera(parse_scene(SCENE).camera)


def edited(**changes: Any) -> dict[str, Any]:
    scene = copy.deepcopy(SCENE)
    scene["materials"]["ball"] |= changes
    return scene


def shown(gpu: Renderer, scene: dict[str, Any], samples: int, **more: Any) -> np.ndarray:
    return picture(gpu, scene, samples, **more).read()


def linear(gpu: Renderer, full: Any, guess: Any) -> np.ndarray:
    return full.display(tone_map="linear", dtype="f4", prior=guess)


def decoded(values: np.ndarray) -> np.ndarray:
    c = values[..., :3].astype(np.float64)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def test_what_an_edit_leaves_alone_stays(gpu: Renderer) -> None:
    before, small = shown(gpu, SCENE, 32, **SIZE), shown(gpu, SCENE, 1, **SMALL)
    guess = gpu.prior(before, CAMERA)
    guess.correct(CAMERA, small, small, 8.0)
    found = linear(gpu, picture(gpu, SCENE, 0, **SIZE), guess)
    guess.release()
    np.testing.assert_allclose(decoded(found), np.clip(before[..., :3], 0, 1), atol=2e-5)


def enlarged(values: np.ndarray) -> np.ndarray:
    """(4 height, 4 width, channels): bilinear, with centres at whole numbers and a half."""
    for axis in (0, 1):
        count = values.shape[axis]
        at = np.clip((np.arange(4 * count) + 0.5) / 4 - 0.5, 0, count - 1)
        low = np.minimum(at.astype(int), count - 2)
        share = (at - low).reshape([-1 if each == axis else 1 for each in range(3)])
        values = np.take(values, low, axis) * (1 - share) + np.take(values, low + 1, axis) * share
    return values


def test_a_change_is_enlarged_bilinearly(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    before, small = np.full((64, 96, 4), 0.25, np.float32), rng.random((16, 24, 4), np.float32)
    change = np.zeros((16, 24, 4), np.float32)
    change[..., :3] = rng.random((16, 24, 3), np.float32) * 0.5
    change[4:9, 7:15, 3] = 1.0
    monkeypatch.setattr(prior, "change", lambda *_: change)
    monkeypatch.setattr(prior, "_blurred", lambda values: values)
    guess = gpu.prior(before, CAMERA)
    guess.correct(CAMERA, small, small, 1.0)
    found = decoded(linear(gpu, picture(gpu, SCENE, 0, **SIZE), guess))
    guess.release()
    added, replaced = enlarged(change)[..., :3], enlarged(change)[..., 3:]
    expected = before * (1 - replaced) + enlarged(small) * replaced
    expected[..., :3] += added * (1 - replaced)
    np.testing.assert_allclose(found, np.clip(expected[..., :3] / expected[..., 3:], 0, 1), atol=3e-4)


def test_it_is_averaged_with_samples(gpu: Renderer) -> None:
    before, small = shown(gpu, SCENE, 8, **SIZE), shown(gpu, SCENE, 1, **SMALL)
    after = picture(gpu, edited(base_color=[0.1, 0.2, 0.6]), 4, **SIZE)
    guess = gpu.prior(before, CAMERA)
    guess.correct(CAMERA, small, small, 8.0)
    found = linear(gpu, after, guess)
    guess.release()
    expected = (4 * after.read() + 8 * before) / 12
    np.testing.assert_allclose(decoded(found), np.clip(expected[..., :3], 0, 1), atol=2e-5)


@pytest.mark.parametrize("changes", [{"roughness": 0.6}, {"base_color": [0.1, 0.2, 0.6]}, {"metallic": 1.0}])
def test_it_errs_half_as_much_as_an_enlarged_small_picture(gpu: Renderer, changes: dict[str, Any]) -> None:
    scene, size = edited(**changes), {**SIZE, "width": 256, "height": 192}
    small = {**size, "width": 64, "height": 48}
    truth = np.clip(shown(gpu, scene, 128, **size)[..., :3], 0, 1)
    first = shown(gpu, scene, 1, **small)
    guess = gpu.prior(shown(gpu, SCENE, 64, **size), CAMERA)
    guess.correct(CAMERA, shown(gpu, SCENE, 1, **small), first, 1.0)
    found = decoded(linear(gpu, picture(gpu, scene, 0, **size), guess))
    guess.release()

    def error(values: np.ndarray) -> float:
        return float(np.sqrt(np.mean((np.clip(values[..., :3], 0, 1) - truth) ** 2)))

    assert error(found) < 0.6 * error(enlarged(first))


def test_another_camera_sees_the_same_things(gpu: Renderer) -> None:
    """Matte shapes look the same from all sides: where both cameras see them, the old picture is right."""
    scene, size = copy.deepcopy(SCENE), {**SIZE, "width": 256, "height": 192}
    scene["materials"]["ball"] = {"type": "diffuse", "albedo": [0.8, 0.3, 0.2]}
    kept = picture(gpu, scene, 64, **size)
    kept.trace_guides(most=1)
    guess = gpu.prior(kept.read(), kept.scene.arrays.camera, kept.depth())
    scene["camera"] = {**scene["camera"], "position": [0.5, 0.3, 3.9]}
    after, first = picture(gpu, scene, 128, **size), picture(gpu, scene, 1, **{**size, "width": 64, "height": 48})
    camera = after.scene.arrays.camera
    assert guess.serves(camera)
    _, seen = guess._warp(camera)
    known = seen[..., 3] >= 0
    assert 0.6 < known.mean() < 1.0
    off = np.abs(seen[..., :3] - after.read()[..., :3]).max(axis=2)[known]
    assert np.median(off) < 0.01 and np.quantile(off, 0.95) < 0.08
    guess.correct(camera, None, first.read(), 1.0)
    found = decoded(linear(gpu, picture(gpu, scene, 0, **size), guess))
    guess.release()
    truth = np.clip(after.read()[..., :3], 0, 1)

    def error(values: np.ndarray) -> float:
        return float(np.sqrt(np.mean((np.clip(values[..., :3], 0, 1) - truth) ** 2)))

    assert error(found) < 0.5 * error(enlarged(first.read()))


def test_without_depth_no_other_camera_is_served(gpu: Renderer) -> None:
    guess = gpu.prior(np.zeros((16, 16, 4), np.float32), CAMERA)
    other = CAMERA.copy()
    other["position"] += 1
    assert guess.serves(CAMERA) and not guess.serves(other)
    guess.release()


def test_averages_leave_out_what_nobody_knows() -> None:
    pixels = np.ones((6, 8, 4), np.float32)
    pixels[:2, :4] = (0, 0, 0, -1)
    pixels[2:4, :2] = (5, 5, 5, 1)
    small, known = prior.averages(pixels, 2, 3)
    np.testing.assert_allclose(known[..., 0], [[0, 1], [1, 1], [1, 1]])
    np.testing.assert_allclose(small[..., 0], [[0, 1], [3, 1], [1, 1]])


def test_numbers_that_are_not_finite_change_nothing() -> None:
    before = np.zeros((16, 16, 4), np.float32)
    after = before.copy()
    after[3, 3, :3] = np.inf
    after[9, 9, 0] = np.nan
    found = prior.change(before, after)
    assert np.isfinite(found).all() and (found[..., 3] >= 0).all() and (found[..., 3] <= 1).all()
