"""A thin film by transfer matrices and colorimetry's tables: what `gpu/tables/film.py` stands for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import qmc

# Wavelengths in nm, the CIE 1931 observer's x, y and z, and illuminant D65 [CIE 018:2019; ISO/CIE 11664-2:2022].
TABLE = np.loadtxt(Path(__file__).with_name("cie_1931_d65.csv"), delimiter=",")
REC709 = np.array([[0.64, 0.33, 0.03], [0.3, 0.6, 0.1], [0.15, 0.06, 0.79]]).T  # x, y and z of the primaries


@cache
def weights() -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths in steps of 1 nm, and the weight of each in linear Rec.709 under D65, where white is 1.

    The observer is interpolated by cubics, the illuminant by lines [CIE 015:2018]."""
    wavelengths = np.arange(TABLE[0, 0], TABLE[-1, 0] + 1)
    observer = CubicSpline(TABLE[:, 0], TABLE[:, 1:4])(wavelengths)
    seen = observer * np.interp(wavelengths, TABLE[:, 0], TABLE[:, 4])[:, None]
    colors = seen @ np.linalg.inv(REC709 * np.linalg.solve(REC709, seen.sum(0))).T
    return wavelengths, colors / colors.sum(0)


def reflectance(
    cosine: float, thickness: float, film: float, base: complex | np.ndarray, outer: float = 1.0
) -> np.ndarray:
    """The unpolarised reflectance (rgb) of a film of so many nm, by the layer's matrix [Born & Wolf 1999, 1.6].

    `base` may have an index for each channel. `cosine` is in air, whatever is on the film."""
    wavelengths, seen = weights()
    indices = np.broadcast_to(np.asarray(base, complex), (3,))
    out = np.zeros(3)
    for channel, index in enumerate(indices):
        q0, q1, q2 = (np.sqrt(n * n - 1 + cosine * cosine + 0j) for n in (outer, film, index))
        delta = 2 * np.pi * q1 * thickness / wavelengths
        for p in (0, 1):
            y0, y1, y2 = (q / n ** (2 * p) for q, n in ((q0, outer), (q1, film), (q2, index)))
            electric = np.cos(delta) - 1j * np.sin(delta) * y2 / y1
            magnetic = y2 * np.cos(delta) - 1j * np.sin(delta) * y1
            amplitude = (y0 * electric - magnetic) / (y0 * electric + magnetic)
            out[channel] += 0.5 * float(abs(amplitude) ** 2 @ seen[:, channel])
    return np.clip(out, 0, 1)


def metal_index(f0: np.ndarray, edge: np.ndarray) -> np.ndarray:
    """n + i k of a metal of reflectance f0 head-on with that edge tint [Gulbrandsen 2014]."""
    root = np.sqrt(f0)
    n = edge * (1 - f0) / (1 + f0) + (1 - edge) * (1 + root) / (1 - root)
    return np.asarray(n + 1j * np.sqrt(np.maximum(0, ((n + 1) ** 2 * f0 - (n - 1) ** 2) / (1 - f0))))


def draw(records: np.ndarray) -> None:
    """Put films on materials: low-discrepancy draws of weight, thickness up to a micrometre and index up to 3."""
    u = qmc.Sobol(3, seed=5).random(len(records))
    records["film_weight"], records["film_thickness"], records["film_ior"] = u[:, 0], 1000 * u[:, 1], 1 + 2 * u[:, 2]


def surest_gains(
    albedo: Callable[[np.ndarray, np.ndarray, int], tuple[np.ndarray, np.ndarray]], m: np.ndarray, asks: np.ndarray
) -> np.ndarray:
    """Of the brightest of these materials under films, from above: `albedo` less four of its errors."""
    draw(m)
    first = np.argsort(-albedo(m, asks, 256)[0])[:96]
    again, error = albedo(m[first], asks[first], 1 << 14)
    return np.sort(again - 4 * error)[::-1]
