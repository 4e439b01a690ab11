"""The colour of half spaces by transport theory: what `gpu/tables/half_space.py` inverts, and its constants."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander
from scipy.optimize import least_squares

NODES = 64


def h_function(albedos: np.ndarray, mu: float) -> np.ndarray:
    """Chandrasekhar's H(mu), 0 < mu <= 1, of isotropic media with these albedos (n,) of single scattering.

    By 1 / H(mu) = sqrt(1 - albedo) + albedo / 2 int_0^1 x H(x) / (mu + x) dx, whose iteration converges for an albedo
    of 1, too [1960, "Radiative transfer", section 38].
    """
    nodes, weights = leggauss(NODES)
    x, weights = (nodes + 1.0) / 2.0, weights / 2.0
    root, half = np.sqrt(1.0 - albedos)[:, None], albedos[:, None] / 2.0
    kernel = weights * x / (x[:, None] + x)
    h = np.ones((len(albedos), NODES))
    for _ in range(100):
        h = (h + 1.0 / (root + half * (h @ kernel.T))) / 2.0
    there: np.ndarray = 1.0 / (root[:, 0] + half[:, 0] * (h @ (weights * x / (mu + x))))
    return there


def shown(albedos: np.ndarray) -> np.ndarray:
    """The colour, head-on under a constant sky, of half spaces that scatter evenly with these albedos."""
    out: np.ndarray = 1.0 - h_function(albedos, 1.0) * np.sqrt(1.0 - albedos)
    return out


def shown_by_doubling(albedo: float, g: float) -> float:
    """The same for the phase function of Henyey and Greenstein.

    A thin layer is doubled until nothing comes through it [van de Hulst 1980, "Multiple light scattering", ch. 4];
    what the phase function has beyond the quadrature's terms counts as going on straight [Wiscombe 1977, delta-M].
    """
    nodes, weights = leggauss(32)
    x, weights = (
        np.append((nodes + 1.0) / 2.0, 1.0),
        np.append(weights / 2.0, 0.0),
    )  # and head-on, which sends nothing
    terms = np.arange(64)
    straight = g**64
    moments = (2 * terms + 1) * (g**terms - straight) / (1.0 - straight)
    albedo *= (1.0 - straight) / (1.0 - albedo * straight)
    waves = legvander(x, 63)
    onwards, back = (waves * moments) @ waves.T, (waves * moments * (-1.0) ** terms) @ waves.T
    one, thin = np.eye(len(x)), 5e-7
    lost = one + thin / x[:, None] * (one - albedo / 2.0 * onwards * weights)
    turned = thin / x[:, None] * (albedo / 2.0 * back * weights)
    step = np.linalg.solve(lost, turned)
    through = np.linalg.inv(lost - turned @ step)
    reflected, passed = 2.0 * through @ turned @ np.linalg.inv(lost), 2.0 * through - one
    while passed.max() > 1e-9:
        between = passed @ np.linalg.inv(one - reflected @ reflected)
        reflected, passed = reflected + between @ reflected @ passed, between @ passed
    return float(reflected[-1].sum())


def constants() -> tuple[np.ndarray, np.ndarray]:
    """`NUMERATOR` and `DENOMINATOR` of `gpu.tables.half_space`.

    Of all fractions of these degrees this one has the least largest error of a colour, relative to the colour near
    black, and to what it lacks near white.
    """
    root = (1.0 - np.cos(np.pi * (np.arange(1000) + 0.5) / 1000)) / 2.0
    c = shown(1.0 - root**2)
    weight = -np.gradient(c, root) / np.minimum(c + 0.02, 1.02 - c)

    def errors(p: np.ndarray) -> np.ndarray:
        fraction = (1.0 - c) * (1.0 + c * (p[0] + c * p[1])) / (1.0 + c * (p[2] + c * p[3]))
        out: np.ndarray = (fraction - root) * weight
        return out

    p, often = np.array([1.5, 0.0, 4.0, 3.0]), np.ones_like(root)
    for _ in range(200):  # Lawson's iteration
        p = least_squares(lambda p, often=often: errors(p) * often, p).x
        off = np.abs(errors(p))
        often *= (off / off.max() + 0.02) ** 0.05
    return p[:2], p[2:]
