"""The tables that travel with the package are those that its code computes."""

from __future__ import annotations

import numpy as np
import pytest

from gpu.tables import energy
from gpu.tables.build.energy_fit import between, fitted, raised
from gpu.tables.build.energy_quadrature import albedos
from gpu.tables.build.energy_tables import AXES


def test_shapes_and_ranges() -> None:
    t = energy.tables()
    assert t.albedo.shape == (*energy.ALBEDO_SHAPE, 4) and t.mean.shape == (*energy.MEAN_SHAPE, 4)
    assert t.stretched.shape == (*energy.STRETCHED_SHAPE, 4) and t.sheen.shape == energy.SHEEN_SHAPE
    for table in (t.albedo, t.mean, t.stretched, t.sheen):
        assert table.dtype == np.float32 and table.min() >= 0 and table.max() <= 1


@pytest.mark.parametrize(("e", "r", "m"), [(0, 10, 31), (5, 20, 12), (15, 15, 20), (9, 25, 25)])
def test_nodes_are_what_quadrature_says(e: int, r: int, m: int) -> None:
    a = float(energy.roughness_nodes()[r]) ** 2
    expected = albedos(float(energy.mu_nodes()[m]), 1.0, a, a, float(energy.eta_nodes()[e]), 48)
    kept = energy.tables().albedo[e, r, m]
    # What is put back may be too little by the curvature between nodes, too much by the quadrature's error only.
    put_back = np.array([expected[0] - kept[0], kept[2] - expected[2], kept[3] - expected[3]])
    assert (put_back > -0.015).all() and (put_back < 3e-3).all()
    assert -3e-3 <= kept[1] - expected[1] < 0.02  # never too low


@pytest.mark.parametrize("at", [(3, 7, 9, 5, 4), (6, 3, 12, 13, 10), (12, 5, 6, 0, 16), (9, 7, 12, 8, 2)])
def test_nodes_of_stretched_lobes_are_what_quadrature_says(at: tuple[int, ...]) -> None:
    e, s, r, p, m = (places[k] for places, k in zip(map(_places, range(5)), at, strict=True))
    expected = albedos(float(m), float(p), float(r * r / s), float(r * r * s), float(e), 60)
    kept = energy.tables().stretched[at]
    put_back = np.array([expected[0] - kept[0], kept[2] - expected[2], kept[3] - expected[3]])
    assert (put_back > -0.05).all() and (put_back < 6e-3).all()


@pytest.mark.parametrize("at", [(3, 7, 9, 5, 6), (6, 3, 14, 12, 9), (14, 5, 6, 1, 15), (9, 7, 17, 8, 5)])
def test_between_nodes_of_stretched_lobes_little_is_missing(at: tuple[int, ...]) -> None:
    f = np.array([0.3, 0.6, 0.45, 0.7, 0.2])
    counts = zip(at, f, energy.STRETCHED_SHAPE, strict=True)
    e, s, r, p, m = (float(axis(np.array((k + x) / (n - 1)))) for (k, x, n), axis in zip(counts, AXES, strict=True))
    expected = albedos(m, p, r * r / s, r * r * s, e, 60)
    cell = energy.tables().stretched[tuple(slice(k, k + 2) for k in at)]
    kept = between(cell, f).ravel()
    put_back = np.array([expected[0] - kept[0], kept[2] - expected[2], kept[3] - expected[3]])
    assert (put_back > -0.02).all() and (put_back < 4e-3).all()


def test_a_fit_errs_to_both_sides_and_stays_above() -> None:
    """Of a curved function: nodes that lie on it interpolate to one side of it."""

    def wave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.asarray(0.5 + 0.4 * np.sin(5 * x[:, None]) * np.cos(4 * y), np.float32)

    fractions = [np.zeros(2), *[np.array(f) for f in ((0.5, 0.5), (0.25, 0.75), (0.7, 0.1), (0.5, 0))]]
    places = [[(np.arange(9 - (x > 0)) + x) / 8 for x in f] for f in fractions]
    samples = [(f, wave(*at)) for f, at in zip(fractions, places, strict=True)]
    nodes = samples[0][1]

    def errors(values: np.ndarray) -> np.ndarray:
        return np.concatenate([(between(values, f) - wanted).ravel() for f, wanted in samples])

    fit = fitted(nodes, samples, 0.004)
    assert np.square(errors(fit)).mean() < 0.7 * np.square(errors(nodes)).mean()
    assert errors(nodes).min() < -0.02 and errors(fit).min() > -0.012
    assert errors(raised(fit, samples, 0.005)).min() > -0.0051


def _places(axis: int) -> np.ndarray:
    return np.asarray(AXES[axis](np.linspace(0, 1, energy.STRETCHED_SHAPE[axis])))


def test_a_mirror_loses_nothing() -> None:
    t = energy.tables()
    np.testing.assert_allclose(t.albedo[:, 0, :, 0], 1, atol=1e-4)
    np.testing.assert_allclose(t.mean[:, 0, 0, 2:], 0, atol=1e-4)
