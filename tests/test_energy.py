"""The tables that travel with the package are those that its code computes."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import energy
from gpu.energy_quadrature import albedos
from gpu.energy_tables import AXES


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
    assert (put_back > -0.07).all() and (put_back < 4e-3).all()


def _places(axis: int) -> np.ndarray:
    return np.asarray(AXES[axis](np.linspace(0, 1, energy.STRETCHED_SHAPE[axis])))


def test_a_mirror_loses_nothing() -> None:
    t = energy.tables()
    np.testing.assert_allclose(t.albedo[:, 0, :, 0], 1, atol=1e-4)
    np.testing.assert_allclose(t.mean[:, 0, 0, 2:], 0, atol=1e-4)
