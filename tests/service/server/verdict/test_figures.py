"""The figures of a comparison beside those of others: FLIP's own program, formulas written out, the renderer."""

from __future__ import annotations

import numpy as np
import pytest

from service.colorimetry import decode_srgb
from service.server.verdict import figures as made
from service.server.verdict.figures import flip
from service.server.verdict.regions import drawn


def blurred(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """A picture with edges and slopes, (height, width, 3) of 0 to 1."""
    values = rng.random((*shape, 3))
    for axis in (0, 1):
        values = sum(np.roll(values, k, axis) for k in range(5)) / 5
    values[: shape[0] // 2] = np.round(values[: shape[0] // 2] * 4) / 4
    return np.asarray(values)


@pytest.mark.parametrize("noise", [0.02, 0.3])
def test_flip_is_that_of_its_authors(noise: float) -> None:
    theirs = pytest.importorskip("flip_evaluator")
    rng = np.random.default_rng(0)
    a = blurred(rng, (48, 70)).astype(np.float32)
    b = np.clip(a + noise * rng.standard_normal(a.shape), 0, 1).astype(np.float32)
    expected, mean, _ = theirs.evaluate(a, b, "LDR", inputsRGB=True, applyMagma=False, parameters={"ppd": 67.0})
    ours = flip(decode_srgb(a.astype(float)), decode_srgb(b.astype(float)))
    assert ours.mean() == pytest.approx(mean, abs=1e-5)
    assert np.abs(ours - np.asarray(expected).reshape(48, 70, -1)[..., 0]).max() < 1e-4
    assert flip(a.astype(float), a.astype(float)).max() == 0


def test_ssim_is_that_of_its_formula() -> None:
    """One window written out, in the middle of a picture of its size."""
    rng = np.random.default_rng(1)
    a, b = rng.random((2, 11, 11))
    x = np.arange(-5, 6)
    weights = np.exp(-(x[:, None] ** 2 + x**2) / (2 * 1.5**2))
    weights /= weights.sum()
    ma, mb = (weights * a).sum(), (weights * b).sum()
    va, vb = (weights * a**2).sum() - ma**2, (weights * b**2).sum() - mb**2
    cov = (weights * a * b).sum() - ma * mb
    expected = (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) / ((ma**2 + mb**2 + 1e-4) * (va + vb + 9e-4))
    padded_a, padded_b = (np.pad(each, 40, mode="edge") for each in (a, b))
    assert made.ssim_map(padded_a, padded_b)[45, 45] == pytest.approx(expected)
    assert made.ssim(a, a) == pytest.approx(1.0)


def test_figures_of_a_known_difference() -> None:
    """Grey below the shoulder of the tone map stays as it is, less an offset that both share."""
    a = np.full((12, 16, 3), 0.5)
    b = a.copy()
    b[:6] += 0.1
    found = made.figures(a, b)
    assert found.mean_difference == pytest.approx(0.05) and found.rmse == pytest.approx(0.1 * 0.5**0.5)
    step = made.encode_srgb(np.array(0.56)) - made.encode_srgb(np.array(0.46))
    assert found.psnr == pytest.approx(-10 * np.log10(step**2 / 2))
    equal = made.figures(a, a)
    assert (equal.mean_difference, equal.rmse, equal.psnr, equal.flip) == (0, 0, None, 0)
    assert equal.ssim == pytest.approx(1)


def test_maps_show_where() -> None:
    a = np.full((8, 8, 3), 0.2)
    b, p = a.copy(), np.ones((8, 8))
    b[2, 3] += 0.3
    p[2, 3] = 1e-9
    for kind in ("p", "flip", "heat"):
        shown = drawn(kind, a, b, p, 0.001)
        assert shown.shape == (8, 8, 3) and shown.dtype == np.uint8
        assert np.unravel_index(shown.sum(axis=2).argmax(), (8, 8)) == (2, 3), kind
    assert drawn("p", a, b, p, 0.001)[p == 1].max() == 0
    difference = drawn("difference", a, b, p, 0.001)
    assert (difference[2, 3] == 255).all() and (difference[p == 1] == 128).all()
    assert drawn("heat", a, a, p, 0.001).max() == 4  # magma's own black
