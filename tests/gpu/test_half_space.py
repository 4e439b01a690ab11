"""The albedo by which a half space shows a colour: against Chandrasekhar's, on the host and in a kernel."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import Renderer
from gpu.layout.bindings import Slot
from gpu.tables import half_space
from tests import half_spaces
from tests.probing import prober_of

COLORS = np.concatenate([[1e-6, 1e-4, 0.001], np.arange(0.01, 0.995, 0.01), [0.999, 1 - 1e-4, 1 - 1e-6]])


def test_the_constants_are_those_of_the_best_fraction() -> None:
    for found, given in zip(half_spaces.constants(), (half_space.NUMERATOR, half_space.DENOMINATOR), strict=True):
        np.testing.assert_allclose(found, given, atol=5e-5)


def test_half_spaces_show_the_colour_by_chandrasekhar() -> None:
    shown = half_spaces.shown(half_space.single_scattering_albedo(COLORS, 0.0))
    error = np.abs(shown - COLORS)
    assert error.max() < 1.1e-5
    assert (error / COLORS).max() < 1.3e-4 and (error / (1 - COLORS)).max() < 1.3e-4


def test_some_values_of_chandrasekhar() -> None:
    """Albedos of single scattering whose half space shows the colour, by H to all digits."""
    expected = {0.01: 0.06258, 0.1: 0.45487, 0.2: 0.68575, 0.5: 0.93817, 0.8: 0.99388, 0.9: 0.99866, 0.99: 0.99999}
    for color, albedo in expected.items():
        assert half_space.single_scattering_albedo(np.array(color), 0.0) == pytest.approx(albedo, abs=2e-5)


def test_the_first_order_is_that_of_single_scattering() -> None:
    """A dark half space shows albedo / 2 int_0^1 x / (1 + x) dx = albedo (1 - ln 2) / 2."""
    albedo = half_space.single_scattering_albedo(np.array(1e-6), 0.0)
    assert albedo * (1 - np.log(2)) / 2 == pytest.approx(1e-6, rel=2e-4)


@pytest.mark.parametrize("g", [-0.9, 0.0, 0.6, 0.99])
def test_black_and_white_are_exact(g: float) -> None:
    assert half_space.single_scattering_albedo(np.array([0.0, 1.0]), g).tolist() == [0, 1]
    rising = half_space.single_scattering_albedo(COLORS, g)
    assert (np.diff(rising) > 0).all() and rising[0] > 0 and rising[-1] < 1


def test_doubling_agrees_with_h() -> None:
    albedos = np.array([0.1, 0.6, 0.95, 0.999])
    found = [half_spaces.shown_by_doubling(albedo, 0.0) for albedo in albedos]
    np.testing.assert_allclose(found, half_spaces.shown(albedos), atol=1e-6)


@pytest.mark.parametrize(("g", "within"), [(-0.5, 0.037), (0.3, 0.02), (0.7, 0.037), (0.95, 0.05)])
def test_the_similarity_relation_is_as_good_as_is_said(g: float, within: float) -> None:
    colors = np.array([0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 0.9, 0.98])
    albedos = half_space.single_scattering_albedo(colors, g)
    shown = np.array([half_spaces.shown_by_doubling(albedo, g) for albedo in albedos])
    assert np.abs(shown - colors).max() < within
    assert np.abs(shown - colors)[-2:].max() < 0.004


@pytest.mark.parametrize("g", [-0.5, 0.0, 0.7])
def test_kernels_have_the_same_function(gpu: Renderer, g: float) -> None:
    asks = np.zeros((len(COLORS), 4), np.float32)
    asks[:, :3] = np.stack([COLORS, COLORS**2, 1 - COLORS], axis=1)
    raised = frozenset({"HAS_ATTENUATION", "HAS_SCATTERING", "HAS_WALKS"})
    (out,) = prober_of(gpu).run("half_space.comp", len(asks), {Slot.SUM: asks}, raised=raised, g=g)
    expected = half_space.single_scattering_albedo(asks[:, :3], g)
    np.testing.assert_allclose(out[:, :3], expected, rtol=2e-6, atol=1.5e-6)
