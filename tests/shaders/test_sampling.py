"""The sampler and the warps: stratified as promised, distributed as promised."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats as scipy_stats
from scipy.stats import qmc

from gpu import FILTERS, Renderer
from gpu.picture import filters
from tests import stats
from tests.probing import Prober, prober_of
from tests.shaders.numbers import N, draw


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


@pytest.mark.parametrize("k", [4, 8, 10])
@pytest.mark.parametrize("seed", [0, 1, 12345])
def test_sobol_is_stratified_in_every_elementary_interval(prober: Prober, k: int, seed: int) -> None:
    for start in (0, 1 << k):  # every aligned block of 2^k samples, not the first one alone
        u = draw(prober, 0, start + (1 << k), seed=seed)[start:, :2]
        for a in range(k + 1):
            cells = np.floor(u * [1 << a, 1 << (k - a)]).astype(int)
            assert len(np.unique(cells[:, 0] * (1 << (k - a)) + cells[:, 1])) == 1 << k


def test_sobol_beats_independent_and_matches_scipys_scramble(prober: Prober) -> None:
    def errors(draws: object) -> float:
        # An integrand with a slanted edge: mean of x + y < 0.8
        return float(np.sqrt(np.mean([((u.sum(1) < 0.8).mean() - 0.32) ** 2 for u in draws])))  # type: ignore[attr-defined]

    ours = errors(draw(prober, 0, 256, seed=s)[:, :2] for s in range(64))
    plain = errors(draw(prober, 0, 256, sampler=1, seed=s)[:, :2] for s in range(64))
    owen = errors(qmc.Sobol(2, scramble=True, rng=s).random(256) for s in range(64))
    assert ours < 0.35 * plain
    assert ours < 1.5 * owen


@pytest.mark.parametrize("pair", [0, 3])
@pytest.mark.parametrize("corner", [(0, 0), (6, 4), (2, 130)])
def test_four_neighbours_fill_each_others_gaps(prober: Prober, corner: tuple[int, int], pair: int) -> None:
    pixels = [(corner[0] + i % 2, corner[1] + i // 2) for i in range(4)]
    drawn = np.stack([draw(prober, 0, 64, pixel=pixel, pair=pair)[:, :2] for pixel in pixels])
    for k in range(7):
        together = drawn[:, : 1 << k].reshape(-1, 2)
        for axis in (0, 1):
            assert len(np.unique(np.floor(together[:, axis] * len(together)))) == len(together), (k, axis)


def _edge_errors(prober: Prober, samples: int, **more: int) -> np.ndarray:
    """(blocks, 16): of pixels in blocks of 4 x 4, in the share of x + y / 2 < 0.7."""
    corners = [(4 * i, 4 * (i % 5)) for i in range(30)]
    pixels = [[(x + i % 4, y + i // 4) for i in range(16)] for x, y in corners]
    drawn = lambda pixel: draw(prober, 0, samples, pixel=pixel, **more)[:, :2]  # noqa: E731
    return np.array([[(drawn(p) @ [1, 0.5] < 0.7).mean() - 0.45 for p in block] for block in pixels])


@pytest.mark.parametrize("samples", [1, 4, 16, 64])
def test_neighbours_errors_cancel(prober: Prober, samples: int) -> None:
    errors = _edge_errors(prober, samples)
    alone = _edge_errors(prober, samples, adaptive=1)
    assert (errors**2).mean() == pytest.approx((alone**2).mean(), rel=0.3), "to each pixel it is all the same"
    assert (errors.mean(axis=1) ** 2).mean() < 0.5 * (errors**2).mean() / 16
    assert (alone.mean(axis=1) ** 2).mean() > 0.5 * (alone**2).mean() / 16, "adaptive counts want them independent"


@pytest.mark.parametrize("sampler", [0, 1])
def test_pixels_pairs_and_replicates_are_independent(prober: Prober, sampler: int) -> None:
    base = draw(prober, 0, 4096, sampler)[:, :2]
    others = [
        draw(prober, 0, 4096, sampler, pixel=(4, 7)),
        draw(prober, 0, 4096, sampler, pixel=(7, 3)),
        draw(prober, 0, 4096, sampler, pair=3),
        draw(prober, 0, 4096, sampler, replicate=1),
        draw(prober, 0, 4096, sampler, seed=1),
    ]
    for other in others:
        for axis in (0, 1):
            assert abs(np.corrcoef(base[:, 0], other[:, axis])[0, 1]) < 0.06


@pytest.mark.parametrize("sampler", [0, 1])
def test_numbers_are_uniform_and_below_one(prober: Prober, sampler: int) -> None:
    u = np.concatenate([draw(prober, 0, 1024, sampler, seed=s)[:, :2] for s in range(32)])
    assert (u >= 0).all()
    assert (u < 1).all()
    counts = np.histogram2d(u[:, 0], u[:, 1], [32, 32], [[0, 1], [0, 1]])[0]
    expected = np.full_like(counts, len(u) / 1024)
    if sampler:
        assert stats.chi_square(counts, expected) > 1e-4
    else:
        assert (counts == expected).all()  # 1024 samples fill 32 x 32 cells once each


WARPS = {
    "disk": (1, lambda a: (np.hypot(a[:, 0], a[:, 1]) ** 2, np.arctan2(a[:, 1], a[:, 0]) / (2 * np.pi) + 0.5)),
    "cosine": (2, lambda a: (1 - a[:, 2] ** 2, np.arctan2(a[:, 1], a[:, 0]) / (2 * np.pi) + 0.5)),
    "sphere": (3, lambda a: (0.5 + 0.5 * a[:, 2], np.arctan2(a[:, 1], a[:, 0]) / (2 * np.pi) + 0.5)),
    "hemisphere": (4, lambda a: (a[:, 2], np.arctan2(a[:, 1], a[:, 0]) / (2 * np.pi) + 0.5)),
    # A uniform triangle b1 + b2 < 1: s = b1 + b2 has distribution s^2, and b1 / s is uniform.
    "triangle": (5, lambda a: ((a[:, 0] + a[:, 1]) ** 2, a[:, 0] / np.maximum(a[:, 0] + a[:, 1], 1e-12))),
}


@pytest.mark.parametrize("name", WARPS)
def test_warps_have_their_density(prober: Prober, name: str) -> None:
    """Each warp, mapped back to the unit square by its own distribution function, is uniform there."""
    what, inverse = WARPS[name]
    x, y = inverse(draw(prober, what, N, sampler=1))
    counts = np.histogram2d(x, y, [24, 24], [[0, 1], [0, 1]])[0]
    assert counts.sum() == N
    assert stats.chi_square(counts, np.full_like(counts, N / counts.size)) > stats.sidak(1e-3, len(WARPS))


@pytest.mark.parametrize("name", FILTERS)
def test_filters_have_their_profile(prober: Prober, name: str) -> None:
    a = draw(prober, 6, N, sampler=1, filter_name=name)
    radius = filters.RADIUS[name]
    edges = np.linspace(-radius, radius, 41)
    fine = np.linspace(-radius, radius, 40 * 200 + 1)
    middle = 0.5 * (fine[1:] + fine[:-1])
    share = filters.profile(name, middle).reshape(40, 200).sum(1)
    for axis in (0, 1):
        counts = np.histogram(a[:, axis], edges)[0]
        assert counts.sum() == N
        assert stats.chi_square(counts, share / share.sum() * N) > stats.sidak(1e-3, 2 * len(FILTERS))
    assert abs(scipy_stats.skew(a[:, 0])) < 0.05
