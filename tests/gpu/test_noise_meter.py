"""The noise meter against the real error, which pixels it draws, and that it disturbs nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.layout import METER_REPLICATES
from gpu.layout.bindings import Slot
from gpu.picture.noise_meter import FROM, around, draw, inclusion, squared_error
from tests.gpu.noisy_scenes import FLOOR, SCENES, SHAPES, luminance, under_a_lamp
from tests.rendering import Images, document, picture

FOG = {"type": "constant", "radiance": 0.3, "medium": {"scattering": [0.1, 0.15, 0.2], "absorption": 0.02}}
SKIN = {"type": "principled", "base_color": [0.8, 0.5, 0.4], "subsurface": 1, "subsurface_radius": [0.2, 0.1, 0.05]}
TURNED = {"fog": under_a_lamp(FLOOR) | {"environment": FOG}, "skin": under_a_lamp(SKIN)}  # by particles
SEEN = SCENES | TURNED


@pytest.mark.parametrize("name", [*SCENES, *(pytest.param(name, marks=pytest.mark.slow) for name in TURNED)])
def test_it_tells_the_truth(gpu: Renderer, name: str) -> None:
    """Within 20 % from 16 samples on, for both samplers; over two seeds, for a picture's own error scatters too."""
    settings: dict[str, Any] = {"width": 64, "height": 64, "max_bounces": 4, "filter": "blackman_harris"}
    assets: Any = Images()
    halves = [luminance(picture(gpu, SEEN[name], 600, assets, seed=s, **settings)) for s in (11, 12)]
    reference, doubt = (halves[0] + halves[1]) / 2, ((halves[0] - halves[1]) ** 2).mean() / 4
    for sampler in ("sobol", "independent"):
        made = [picture(gpu, SEEN[name], 1, assets, sampler=sampler, seed=s, **settings) for s in (1, 2)]
        for samples in (16, 64):
            squares = []
            for one in made:
                one.trace(600, samples)
                squares.append(((luminance(one) - reference) ** 2).mean() - doubt)
            error = np.sqrt(np.mean(squares)) / reference.mean()
            assert np.mean([one.noise() or 0.0 for one in made]) == pytest.approx(error, rel=0.2), (sampler, samples)


def test_nothing_black_and_tiny(gpu: Renderer) -> None:
    lit = document(SHAPES, {"ball": FLOOR, "floor": FLOOR}, environment={"type": "constant", "radiance": 1})
    for size in ((1, 1), (3, 2), (70, 1)):
        made = picture(gpu, lit, 1, width=size[0], height=size[1])
        assert made.noise() is None
        for samples in (2, FROM - 1, FROM, 40):
            made.trace(60, samples)
            noise = made.noise()
            assert noise is not None and 0 <= noise < 10
    dark = picture(gpu, document(SHAPES, {"ball": FLOOR, "floor": FLOOR}), 20)
    assert dark.noise() == 0


@pytest.mark.parametrize("radiance", [1e-20, 1e20])
def test_it_knows_no_scale(gpu: Renderer, radiance: float) -> None:
    def noise(radiance: float, samples: int) -> float:
        sky = {"type": "constant", "radiance": radiance}
        scene = document(SHAPES, {"ball": FLOOR, "floor": FLOOR}, environment=sky)
        measured = picture(gpu, scene, samples, max_bounces=3).noise()
        assert measured is not None
        return measured

    for samples in (4, 20):
        assert noise(radiance, samples) == pytest.approx(noise(1, samples), rel=1e-3)


def test_the_cut_of_the_work_does_not_show(gpu: Renderer) -> None:
    made = [picture(gpu, SCENES["rough metal"], 1, width=48, height=40) for _ in range(2)]
    made[0].trace(600, 50)
    for samples in range(2, 51):
        made[1].trace(0.0, samples)
        while made[1].samples < samples:
            made[1].trace(0.0, samples)
    assert np.array_equal(made[0].read(), made[1].read()) and made[0].noise() == made[1].noise()


def test_pixels_are_drawn_by_their_weights() -> None:
    weights = np.zeros((40, 50))
    weights[20, 5:45] = 1  # a thin bright edge carries all that is known
    drawn = np.concatenate([draw(weights, (50, 40), 1, 200, seed) for seed in range(200)])
    seen, first = np.zeros((40, 50)), drawn[:, 0] % 1 == 0
    np.add.at(seen, (drawn[:, 1].astype(int), drawn[:, 0].astype(int)), 1 / 200)
    assert seen[20, 5:45] == pytest.approx(100 / 40 + 0.05, rel=0.02)  # half of all go there
    assert seen[:20].mean() == pytest.approx(0.05, rel=0.05)
    assert first.sum() / 200 == pytest.approx(40 + 0.05 * 1960, rel=0.02)  # the edge always, the others once at most
    assert drawn[first, 2].sum() / 200 == pytest.approx(2000, rel=0.02)  # each stands for as many as its chance says
    numbers = (drawn[:, 0] % 1) * METER_REPLICATES
    assert set(numbers) == {0, 1, 2} and (np.diff(numbers)[~first[1:]] == 1).all()
    assert (drawn[:, 1] == 20)[~first].all()


def test_of_several_estimates_the_mean_counts() -> None:
    """Each with its own variance: the expected square of the difference is the picture's, whatever their number."""
    rng = np.random.default_rng(1)
    places = np.array([[3, 2, 1], [3.125, 2, 1], [3.25, 2, 1], [7, 2, 1], [9, 5, 4], [0, 0, 0]])
    trials = 4000
    seen, other = rng.normal(0, 2, (trials, 4)).repeat([3, 1, 1, 1], axis=1), rng.normal(0, 2, (trials, 6))
    found = [squared_error(places, *both) for both in zip(seen, other, strict=True)]
    assert np.mean(found) == pytest.approx(4 * (1 + 1 + 4), rel=0.08)
    assert squared_error(places[-1:], np.ones(1), np.zeros(1)) == 0


@pytest.mark.parametrize("sampler", ["sobol", "independent"])
def test_estimates_of_a_pixel_differ(gpu: Renderer, sampler: str) -> None:
    made = picture(gpu, SCENES["rough metal"], 24, width=64, height=64, sampler=sampler)
    places, sums = made._meter._vectors(Slot.MOMENTS), made._meter._vectors(Slot.SUM)
    again = np.flatnonzero(places[:, 0] % 1 > 0)
    assert len(again) > 20 and (places[:, 3] == 24).all()
    differ = (sums[again] != sums[again - 1]).any(axis=1) & (places[again, 1] == places[again - 1, 1])
    assert differ.sum() > 20, "but for those beside the lamp's edge, where all samples are alike"


def test_blocks_at_the_rim_have_fewer_pixels() -> None:
    drawn = draw(np.ones((3, 4)), (7, 5), 2, 35, 0)
    assert drawn[:, 0].max() <= 6 and drawn[:, 1].max() <= 4
    assert len(drawn) <= 12 and drawn[:, 2].sum() == pytest.approx(35)


def test_chances_sum_to_the_count_and_end_at_one() -> None:
    shares = np.array([1000.0, 100.0, 1.0, 1.0, 1.0, 1.0])
    times = inclusion(shares, 6, most=4)
    assert times.sum() == pytest.approx(6) and times[0] == 4 and times[1] < 4
    chances = inclusion(shares, 3)
    assert chances.sum() == pytest.approx(3) and chances[:2] == pytest.approx(1)
    assert inclusion(np.ones(5), 5) == pytest.approx(1)


def test_a_place_weighs_as_its_neighbours_do() -> None:
    values = np.random.default_rng(3).random((5, 7)).astype(np.float32)
    means = [[values[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].mean() for x in range(7)] for y in range(5)]
    assert around(values) == pytest.approx(np.array(means), rel=1e-6)
    assert around(values[:1, :1]) == pytest.approx(values[:1, :1]), "no neighbours"
