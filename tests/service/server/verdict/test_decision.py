"""The tests behind a verdict, on numbers: false alarms whatever the noise is like, and what is found."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import stats

from service.server.verdict.decision import Decision, decide
from service.server.verdict.evidence import Estimate, Evidence, blocks
from service.server.verdict.regions import p_map, regions

Noise = Callable[[Any, Any], Any]

# Samples whose mean a and b share. Fireflies and two values deceive a test that trusts the variance of few samples.
NOISES: dict[str, Noise] = {
    "exponential": lambda rng, shape: rng.exponential(1, shape),
    "one channel": lambda rng, shape: np.repeat(rng.exponential(1, (*shape[:-1], 1)), 3, axis=-1),
    "two values": lambda rng, shape: (rng.random(shape) < 0.5) * 1.0,
    "fireflies": lambda rng, shape: 0.1 * rng.random(shape) + (rng.random(shape) < 0.003) * 300.0,
    "no mean": lambda rng, shape: rng.pareto(1.0, shape),
}
PAIRS = 60
LEVEL = 0.05


def estimate(samples: np.ndarray) -> Estimate:
    """Of (samples, height, width, 3)."""
    count = len(samples)
    variance = samples.var(axis=0, ddof=1) / count if count > 1 else np.zeros(samples.shape[1:])
    return Estimate(samples.mean(axis=0), variance, count)


def evidence(
    noise: Noise, rng: np.random.Generator, size: int, samples: int, groups: int, change: Any = lambda mean: mean
) -> Evidence:
    """Of pictures that are independent of each other; `change` makes b's samples of what a's would be."""

    def pair() -> tuple[Estimate, Estimate]:
        shape = (samples, size, size, 3)
        return estimate(noise(rng, shape)), estimate(change(noise(rng, shape)))

    found = Evidence(*pair())
    for _ in range(groups - 1):
        found.add(*pair())
    return found


def most_alarms(cases: int, level: float) -> int:
    """More come by chance once in a thousand runs of such a test."""
    return int(stats.binom.isf(1e-3, cases, level))


@pytest.mark.parametrize("name", NOISES)
@pytest.mark.parametrize(("size", "samples", "groups"), [(16, 1, 1), (16, 4, 1), (24, 16, 1), (16, 4, 16)])
def test_false_alarms_come_no_more_often_than_stated(name: str, size: int, samples: int, groups: int) -> None:
    rng = np.random.default_rng(groups)
    found = [decide(evidence(NOISES[name], rng, size, samples, groups)).p_value for _ in range(PAIRS)]
    assert sum(p < LEVEL for p in found) <= most_alarms(PAIRS, LEVEL)


def test_a_test_that_trusts_the_variance_of_few_samples_alarms_always() -> None:
    """Which is why there is none here: this is what the tests above are able to see."""
    rng = np.random.default_rng(0)
    alarms = 0
    for _ in range(20):
        pair = evidence(NOISES["two values"], rng, 16, 4, 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.abs(pair.b.mean - pair.a.mean) / np.sqrt(pair.a.variance + pair.b.variance)
        alarms += bool(2 * stats.norm.sf(np.nanmax(z)) * z.size < LEVEL)
    assert alarms > 15


def test_one_side_of_few_samples_is_not_more_certain_than_the_other_one_says() -> None:
    """Eight samples a pixel miss light that comes with one sample in a thousand, whose variance the other side
    knows."""
    rng, alarms = np.random.default_rng(3), 0
    for _ in range(PAIRS):
        few, many = ((rng.random((n, 16, 16, 3)) < 1e-3) * 1000.0 for n in (8, 2048))
        alarms += decide(Evidence(estimate(few), estimate(many))).p_value < LEVEL
    assert alarms <= most_alarms(PAIRS, LEVEL)


@pytest.mark.parametrize("alike", [False, True])
def test_light_that_one_side_seldom_finds_is_not_missing(alike: bool) -> None:
    """As of two estimators, one of which finds a lamp with one sample in two hundred; also where nobody says that
    there are two."""
    rng, alarms = np.random.default_rng(6), 0
    for _ in range(20):
        found = None
        for _ in range(16):
            steady, seldom = rng.normal(1, 0.1, (4, 16, 16, 3)), (rng.random((4, 16, 16, 3)) < 0.005) * 200.0
            if found is None:
                found = Evidence(estimate(steady), estimate(seldom), alike)
            else:
                found.add(estimate(steady), estimate(seldom))
        assert found is not None
        alarms += decide(found).p_value < LEVEL
    assert alarms <= most_alarms(20, LEVEL)


def test_equal_pictures_do_not_differ() -> None:
    same = estimate(np.random.default_rng(0).exponential(1, (8, 20, 30, 3)))
    found = Evidence(same, same)
    found.add(same, same)
    decision = decide(found)
    assert decision.p_value == 1.0
    assert regions(p_map(decision.levels, found.shape, 0.001), 0.001) == []


def test_rounding_is_no_difference() -> None:
    rng = np.random.default_rng(0)
    a = estimate(rng.exponential(1, (64, 32, 32, 3)))
    assert decide(Evidence(a, Estimate(a.mean * (1 + 4e-6), a.variance, a.samples))).p_value == 1.0
    assert decide(Evidence(a, Estimate(a.mean * (1 + 1e-4), a.variance, a.samples))).p_value < 1e-9


def test_a_mean_shift_of_a_percent_is_found_in_noise_of_nine() -> None:
    """No small region shows it, but the whole picture does."""
    found = evidence(NOISES["exponential"], np.random.default_rng(1), 64, 16, 16, lambda samples: 1.01 * samples)
    decision = decide(found)
    assert decision.p_value < 1e-3
    assert min(level.p.min() for level in decision.levels if level.side <= 8) > 0.05


def test_a_change_that_the_same_seeds_share_needs_few_samples() -> None:
    rng = np.random.default_rng(1)
    a = estimate(rng.exponential(1, (4, 32, 32, 3)))
    assert decide(Evidence(a, Estimate(1.002 * a.mean, a.variance, 4))).p_value < 1e-9


def differing(change: Any, size: int = 32, groups: int = 16) -> tuple[Decision, list[Any]]:
    found = evidence(NOISES["exponential"], np.random.default_rng(2), size, 16, groups, change)
    decision = decide(found)
    return decision, regions(p_map(decision.levels, found.shape, 0.001), 0.001)


def test_a_pixel_is_found_where_it_is() -> None:
    def brighter(samples: Any) -> Any:
        samples[:, 5, 7] *= 3
        return samples

    decision, found = differing(brighter)
    assert decision.p_value < 1e-6
    assert [(each.x, each.y, each.width, each.height) for each in found] == [(7, 5, 1, 1)]


def test_two_places_are_two_regions() -> None:
    def changed(samples: Any) -> Any:
        samples[:, 2:8, 2:8] *= 2
        samples[:, 20:28, 16:30] *= 0.5
        return samples

    decision, found = differing(changed)
    assert len(found) == 2 and decision.p_value <= min(each.p_value for each in found) < 1e-9
    for each in found:
        inside = (2, 2, 8, 8) if each.x < 12 else (16, 20, 30, 28)
        assert each.x >= inside[0] - 2 and each.x + each.width <= inside[2] + 2
        assert each.y >= inside[1] - 2 and each.y + each.height <= inside[3] + 2


def test_a_pattern_of_both_signs_is_found_where_its_sum_is_nothing() -> None:
    """A fifth of a pixel's error in each group: no pixel and no sum of pixels shows it, all products together do."""
    signs = np.where(np.indices((64, 64)).sum(axis=0) % 2, 1.0, -1.0)[None, :, :, None]
    found = evidence(NOISES["exponential"], np.random.default_rng(4), 64, 16, 8, lambda each: each + 0.1 * signs)
    assert decide(found).p_value < 1e-6


def test_a_colour_of_equal_luminance_is_found() -> None:
    def redder(samples: Any) -> Any:
        return samples + np.array([0.7152, -0.2126, 0.0]) * 0.2

    decision, _ = differing(redder)
    assert decision.p_value < 1e-9


def test_looks_are_paid_for() -> None:
    found = evidence(NOISES["exponential"], np.random.default_rng(5), 32, 16, 2, lambda each: 1.1 * each)
    once, four_times = decide(found).p_value, decide(found, looks=4).p_value
    assert once < 1e-3 and four_times == pytest.approx(4 * once)


def test_values_near_the_end_of_float32_are_no_error() -> None:
    a = estimate(np.full((2, 9, 5, 3), 1e38))
    with np.errstate(all="raise"):
        assert decide(Evidence(a, a)).p_value == 1.0
        assert decide(Evidence(a, Estimate(0 * a.mean, a.variance, 2))).p_value < 1e-3


def test_blocks_at_the_edges_are_smaller() -> None:
    values = np.arange(15.0).reshape(3, 5)
    assert blocks(values, 2).tolist() == [[12, 20, 13], [21, 25, 14]]
