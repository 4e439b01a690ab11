"""The table of films against the series that it stands for, over all films that a document may ask for."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from gpu.tables import film
from tests import film as exact


def _looked_up(zeta: np.ndarray, path: np.ndarray) -> np.ndarray:
    """The series (n, 3) by the table, as shaders/bsdf/lobes/base/film.glsl and a texture unit find it."""
    table, gap = film.table()[..., :3].astype(float), 1 - np.abs(zeta)
    places = 0.5 + 0.5 * np.sign(zeta) * (1 - np.sqrt(gap)), 1 - np.exp(-path / film.FADING)
    at = [place * (n - 1) for place, n in zip(places, film.SHAPE, strict=True)]
    (i, j), (a, b) = ([np.clip(x.astype(int), 0, n - 2) for x, n in zip(at, film.SHAPE, strict=True)], (None, None))
    a, b = (at[0] - i)[:, None], (at[1] - j)[:, None]
    low, high = (table[k, j] * (1 - b) + table[k, j + 1] * b for k in (i, i + 1))
    return np.asarray((zeta / gap)[:, None] * (low * (1 - a) + high * a))


def _reflectances(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """By the series and by the table, and the indices of the films, of draws u (n, 5): films of 3 nm to 10 um and
    index 1 to 4, on indices 1 to 4, or on what lies over them, too; cosines from 0.02."""
    cosine, thickness = 0.02 + 0.98 * u[:, 0], 10 ** (3.5 * u[:, 1] - 2.5)
    outer, index, base = np.maximum(1, 2.5 * u[:, 2]), 1 + 3 * u[:, 3], 1 + 3 * u[:, 4]
    base = np.where(u[:, 4] < 0.2, outer, base)
    q = [np.sqrt(n * n - 1 + cosine * cosine) for n in (outer, index, base)]
    path, by_series, by_table = 2 * thickness * q[1], np.ones((len(u), 3)), np.ones((len(u), 3))
    for p in (0, 2):
        u0, u1, u2 = (each / n**p for each, n in zip(q, (outer, index, base), strict=True))
        a, b = 4 * u0 * u1 / (u0 + u1) ** 2, 4 * u1 * u2 / (u1 + u2) ** 2
        zeta, passed = (u0 - u1) * (u2 - u1) / ((u0 + u1) * (u1 + u2)), (a * b / (a + b - a * b))[:, None]
        by_series -= passed * (0.5 + film.series(zeta, path))
        by_table -= passed * (0.5 + _looked_up(zeta, path))
    return by_series, by_table, index


def test_reflectances_are_those_of_the_series() -> None:
    """Within 0.001, but for films that hardly differ from a vacuum, at grazing angles: those within 0.002."""
    by_series, by_table, index = _reflectances(qmc.Sobol(5, seed=3).random(1 << 16))
    off = np.abs(by_table - by_series).max(1)
    assert off[index > 1.01].max() < 1e-3, off.max()
    assert off.max() < 2e-3 and np.quantile(off, 0.99) < 3e-4


def test_faint_films_are_as_exact_as_bright_ones() -> None:
    """Soap reflects 8 % at most: the error is small beside that, not beside 1."""
    n = 1 << 12
    path = np.linspace(0.08, 12, n)
    zeta = np.full(n, (0.33 / 2.33) ** 2)
    wanted = film.series(zeta, path)
    assert np.abs(_looked_up(zeta, path) - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_waves_are_those_of_the_observer() -> None:
    """W is 1 at 0, and that of white light at every other path."""
    wavelengths, seen = exact.weights()
    np.testing.assert_allclose(film.AMPLITUDES.sum(0), 1, atol=1e-6)
    for path in (0.1, 0.3, 0.7, 1.5, 3.0, 20.0):
        wanted = np.cos(2e3 * np.pi * path / wavelengths) @ seen
        found = (film.AMPLITUDES * np.exp(film.EXPONENTS * path)).sum(0).real
        np.testing.assert_allclose(found, wanted, atol=0.02)


def test_films_fade_to_their_mean() -> None:
    table = film.table()
    assert np.isfinite(table).all() and (table[:, -1] == 0).all()
    assert np.abs(_looked_up(np.array([0.5, -0.9]), np.array([40.0, 40.0]))).max() < 1e-6
