"""The tables that travel with the package are those that its code computes."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import energy
from gpu.energy_tables import _albedos


def test_shapes_and_ranges() -> None:
    t = energy.tables()
    assert t.albedo.shape == (*energy.ALBEDO_SHAPE, 4) and t.mean.shape == (*energy.MEAN_SHAPE, 4)
    assert t.alike.shape == (*energy.ASPECT_SHAPE, 4) and t.sheen.shape == energy.SHEEN_SHAPE
    for table in (t.albedo, t.mean, t.alike, t.sheen):
        assert table.dtype == np.float32 and table.min() >= 0 and table.max() <= 1


@pytest.mark.parametrize(("e", "r", "m"), [(0, 10, 31), (5, 20, 12), (15, 15, 20), (9, 25, 25)])
def test_nodes_are_what_quadrature_says(e: int, r: int, m: int) -> None:
    a = float(energy.roughness_nodes()[r]) ** 2
    expected = _albedos(float(energy.mu_nodes()[m]), 1.0, a, a, float(energy.eta_nodes()[e]), 48)
    kept = energy.tables().albedo[e, r, m]
    np.testing.assert_allclose(kept[[0, 2, 3]], np.array(expected)[[0, 2, 3]], atol=3e-3)
    assert -3e-3 <= kept[1] - expected[1] < 0.02  # never too low


def test_a_mirror_loses_nothing() -> None:
    t = energy.tables()
    np.testing.assert_allclose(t.albedo[:, 0, :, 0], 1, atol=1e-4)
    np.testing.assert_allclose(t.mean[:, 0, 0, 2:], 0, atol=1e-4)
