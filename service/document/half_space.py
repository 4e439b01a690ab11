"""The albedo of single scattering that gives much of a medium its colour."""

from __future__ import annotations

from functools import cache

import numpy as np

COSINES, STEPS = 64, 257


def single_scattering_albedo(color: float, g: float) -> float:
    """The share of light that a medium scatters where it meets a particle, so that an index-matched half space of it
    shows `color` at normal incidence under a constant sky; all in [0, 1], g in (-1, 1).

    For g = 0 that is the inverse of 1 - H(1) sqrt(1 - albedo) with Chandrasekhar's H [1960, "Radiative transfer",
    section 38]; another g counts by the similarity relation, by which scattering counts 1 - g times.
    """
    shown, albedos = _half_space()
    alike = float(np.interp(color, shown, albedos))
    return alike / (1.0 - g + g * alike)


@cache
def _half_space() -> tuple[np.ndarray, np.ndarray]:
    """What half spaces show, and the albedos of single scattering that they have; both rise from 0 to 1."""
    root = np.linspace(1.0, 0.0, STEPS)  # sqrt(1 - albedo), in which the colour is almost straight
    albedos = 1.0 - root**2
    return 1.0 - h_function(albedos, 1.0) * root, albedos


def h_function(albedos: np.ndarray, mu: float) -> np.ndarray:
    """Chandrasekhar's H(mu), 0 < mu <= 1, of isotropic media with these albedos (n,) of single scattering.

    By 1 / H(mu) = sqrt(1 - albedo) + albedo / 2 int_0^1 x H(x) / (mu + x) dx, whose iteration converges for an albedo
    of 1, too.
    """
    nodes, weights = np.polynomial.legendre.leggauss(COSINES)
    x, weights = (nodes + 1.0) / 2.0, weights / 2.0
    root, half = np.sqrt(1.0 - albedos)[:, None], albedos[:, None] / 2.0
    kernel = weights * x / (x[:, None] + x)
    h = np.ones((len(albedos), COSINES))
    for _ in range(100):
        h = (h + 1.0 / (root + half * (h @ kernel.T))) / 2.0
    there: np.ndarray = 1.0 / (root[:, 0] + half[:, 0] * (h @ (weights * x / (mu + x))))
    return there
