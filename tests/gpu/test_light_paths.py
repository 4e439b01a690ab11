"""Pictures whose caustics are traced from the lights: their bits, their estimated error, and the choice of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gpu import Band, Picture, Renderer, RenderSettings
from gpu.kernels import features
from gpu.kernels.caustics import MOST_TARGETS, sources, targets
from gpu.kernels.deltas import may_be_specular
from gpu.picture.light_paths import samples_with_paths
from service.document import parse_scene
from service.pack import pack
from tests.gpu.bits import assert_same, beside, saved
from tests.rendering import Images, document, picture

SETTINGS: dict[str, Any] = {"width": 48, "height": 37, "max_bounces": 6, "filter": "blackman_harris"}
GLASS = {"type": "principled", "transmission": 1, "roughness": 0, "base_color": [1, 1, 1]}
FLOOR = {"type": "quad", "origin": [-4, -1, 4], "u": [8, 0, 0], "v": [0, 0, -8], "material": "floor"}
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 0.6, "material": "ball"}
LAMP = {"type": "point", "position": [-1.5, 3, 1], "intensity": 40}


def scene(ball: dict[str, Any] = GLASS, **more: Any) -> dict[str, Any]:
    materials = {"ball": ball, "floor": {"type": "diffuse", "albedo": 0.5}}
    camera = {"position": [0, 1.5, 5], "target": [0, -0.5, 0]}
    return document([BALL, FLOOR], materials, **{"camera": camera, "lights": [LAMP], **more})


@pytest.fixture
def made(gpu: Renderer) -> Callable[[int], Picture]:
    return lambda samples: picture(gpu, scene(), samples, caustics="light", **SETTINGS)


def test_the_cut_into_slices_changes_no_bit(made: Callable[[int], Picture]) -> None:
    whole, cut = made(80), made(1)
    while cut.samples < 80:
        cut.trace(0.0, 80)
    assert cut.traces_caustics and cut._light.radiance(0, 48 * 37).max() > 0.1
    assert_same(cut, whole)


def test_a_block_of_several_renderers(made: Callable[[int], Picture]) -> None:
    whole, home = made(64), made(8)
    helper = beside(home)
    home.block.share(10, 64)
    band = Band(8, 56, 10, 27)
    while not helper.block.trace_band(band, 1.0):
        pass
    home.block.write_band(band, helper.block.read_band(band))
    while not home.block.own_done:
        home.trace(1.0, 64)
    home.block.complete()
    home.trace(600.0, 64)
    assert home.samples == 64
    assert_same(home, whole)


def test_a_picture_that_was_saved_between_its_paths_of_light(made: Callable[[int], Picture]) -> None:
    whole, first = made(40), made(1)
    is_between = False
    while not is_between:  # where a slice has time for all paths of a pass, it is so in another one
        assert first.samples < 40
        first.trace(0.0, 40)
        counted = first._light.even + first._light.odd
        ends = first.samples, first.samples + first.under_way[0]
        before, after = (48 * 37 * sum(samples_with_paths(end)) for end in ends)
        is_between = first.samples > 8 and first.under_way[1] >= 37 and before <= counted < after
    kept = saved(first)
    second = beside(first)
    assert second.fits(kept)
    second.restore(kept)
    assert (second._light.even, second._light.odd) == (first._light.even, first._light.odd)
    assert np.array_equal(second.read(), first.read())
    second.trace(600.0, 40)
    assert_same(second, whole)


def test_a_picture_is_right_before_a_pass_is_complete(gpu: Renderer) -> None:
    """The sums are divided by the number of paths that they have, whether or not all pixels have theirs."""
    large = SETTINGS | {"width": 192, "height": 148}
    under_way, whole = (picture(gpu, scene(), 16, caustics="light", **large) for _ in range(2))
    while not 148 + 74 <= under_way.under_way[1] < 296:
        assert under_way.samples == 16
        under_way.trace(0.0, 24)
    brought, expected = (p._light.radiance(0, 192 * 148).mean() for p in (under_way, whole))
    assert brought == pytest.approx(expected, rel=0.02)


def test_the_estimated_error_is_that_of_independent_pictures(gpu: Renderer) -> None:
    """The mean of the estimates over 12 seeds, beside the variance between what their paths of light bring."""
    light, estimates = [], []
    for seed in range(12):
        one = picture(gpu, scene(), 24, caustics="light", seed=seed, **SETTINGS)
        luminance, squared = one._light.squared_error()
        light.append(luminance)
        estimates.append(squared.mean())
        one.release()
    assert np.mean(estimates) == pytest.approx(np.var(light, axis=0, ddof=1).mean(), rel=0.25)


def test_the_noise_counts_both(made: Callable[[int], Picture]) -> None:
    one = made(32)
    light, squared = one._light.squared_error()
    error, mean = one._readout._meter.error(one._sums, True, one.scene.arrays.radiance_scale)
    assert one.noise() == pytest.approx(np.sqrt(error**2 + squared.mean()) / (mean + light.mean()))
    assert one.display().shape == (37, 48, 4) and one.read("variance").max() > 0


@pytest.mark.parametrize("caustics", ["light", "paths"])
@pytest.mark.parametrize("most", [None, 480], ids=["whole", "parts"])
def test_a_frame_is_put_together_on_the_device(
    gpu: Renderer, monkeypatch: pytest.MonkeyPatch, caustics: str, most: int | None
) -> None:
    """As from what is read, summed in numpy and shown in the picture's place: the same bits, but with a guess, which
    is averaged in another order. From 9 samples on a block is open."""
    made = picture(gpu, scene(), 0, caustics=caustics, **SETTINGS)
    if most:
        monkeypatch.setattr(made._dispatcher, "most_pixels", most)
    camera = made.scene.arrays.camera
    rng = np.random.default_rng(5)
    guess = gpu.prior(rng.random((37, 48, 4), np.float32), camera)
    small = rng.random((10, 12, 4), np.float32)
    guess.correct(camera, small, small, 4.0)
    read = made._readout.color
    reads: list[str] = []
    monkeypatch.setattr(made._readout, "color", lambda: reads.append("color") or read())
    for samples in (1, 3, 9, 20):
        made.trace(600.0, samples)
        assert made.samples == samples and made._sums.open is (samples > 8)
        values = read()
        with monkeypatch.context() as on_gpu:
            on_gpu.setattr(made._dispatcher, "is_software", False)
            np.testing.assert_array_equal(read(), values)
        for dtype in ("u1", "f4"):
            np.testing.assert_array_equal(made.display(dtype=dtype), made.display(dtype=dtype, color=values))
        found, expected = (made.display(dtype="f4", prior=guess, color=each) for each in (None, values))
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6)
        found, expected = (made.display(prior=guess, color=each).astype(int) for each in (None, values))
        assert np.abs(found - expected).max() <= 1
        without = made.display(dtype="f4")
        assert np.abs(without - made.display(dtype="f4", prior=guess)).max() > 0.01, "the guess counts"
    if caustics == "light":
        brought = made._light.radiance(0, 48 * 37)
        alone = values.copy()
        alone[..., :3] -= brought.reshape(37, 48, 3)
        assert np.abs(made.display(color=alone).astype(int) - made.display()).max() > 10, "so do the caustics"
    assert not reads, "nothing of it comes down"
    guess.release()


def arrays(document_: dict[str, Any]) -> Any:
    return pack(parse_scene(document_), Images()).arrays


def chosen(document_: dict[str, Any], caustics: str = "auto", **settings: Any) -> bool:
    made = RenderSettings(**{"width": 64, "height": 64, **settings}, caustics=caustics)
    return bool(features.defines(features.flags(arrays(document_)), made)["CAUSTICS"])


def test_what_is_chosen() -> None:
    sky = {"type": "constant", "radiance": 1}
    matte, gloss = {"type": "diffuse", "albedo": 0.5}, {**GLASS, "roughness": 0.2}
    lamp = {**BALL, "material": "lamp", "center": [0, 4, 0]}
    wide = [{"type": "directional", "direction": [0, -1, 0], "irradiance": 1, "angular_diameter": 40}]
    assert chosen(scene()) and chosen(scene(), "light")
    assert (
        not chosen(scene(), "paths") and not chosen(scene(), adaptive=True) and not chosen(scene(), filter_glossy=0.1)
    )
    assert not chosen(scene(matte)) and not chosen(scene(matte), "light") and not chosen(scene(gloss), "light")
    assert not chosen(scene(lights=[], environment=sky)) and not chosen(scene(lights=[], environment=sky), "light")
    assert not chosen(scene(lights=wide)) and chosen(scene(lights=wide), "light")
    assert not chosen(scene(), width=4096, height=2048)
    for radius, small in ((0.2, True), (1.5, False)):
        lit = scene(lights=[])
        lit["materials"]["lamp"] = {**matte, "emission": 5}
        lit["shapes"].append({**lamp, "radius": radius})
        assert chosen(lit) is small and chosen(lit, "light")


def test_scenes_without_caustics_keep_their_kernel() -> None:
    plain = arrays(scene({"type": "diffuse", "albedo": 0.5}))
    raised = features.flags(plain)
    kernels = [features.defines(raised, RenderSettings(64, 64, caustics=c)) for c in ("light", "paths", "auto")]
    assert kernels[0] == kernels[1] == kernels[2] and not any("CAUSTICS" in name for name in raised)


def test_targets_hold_all_shapes_that_mirror() -> None:
    rng = np.random.default_rng(3)
    centers = rng.uniform(-5, 5, (60, 3))
    balls = [{**BALL, "center": c.tolist(), "radius": 0.1 + 0.2 * rng.random()} for c in centers]
    box = {"type": "box", "min": [6, 0, 0], "max": [7, 1, 3], "material": "ball"}
    many = arrays(
        document([*balls, box, FLOOR], {"ball": GLASS, "floor": {"type": "diffuse", "albedo": 0.5}}, lights=[LAMP])
    )
    found = targets(many, may_be_specular(many.materials))
    assert len(found) == MOST_TARGETS
    inside = [
        (np.linalg.norm(found[:, :3] - s["center"], axis=1) + s["radius"] <= found[:, 3] * 1.0001).any()
        for s in many.spheres
    ]
    assert all(inside)
    corner = np.array([7, 1, 3]) - np.asarray(many.origin)
    assert (np.linalg.norm(found[:, :3] - corner, axis=1) <= found[:, 3]).any()
    assert sources(many).chances.sum() == pytest.approx(1)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"caustics": "paths"}, "the caustics of lamps without extent are missing; settings.caustics"),
        ({"caustics": "light"}, "the caustics of lamps without extent are there where they are seen directly"),
    ],
)
def test_a_warning_says_what_is_missing(gpu: Renderer, settings: dict[str, Any], said: str) -> None:
    (warned,) = picture(gpu, scene(), 1, **SETTINGS, **settings).warnings
    assert warned.startswith(said)
