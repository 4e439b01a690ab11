"""The albedo of single scattering by which much of a medium shows a colour.

Media that documents give by a colour have it from here, and walks under surfaces by `shaders/path/half_space.glsl`,
which has the same formula with these constants. An index-matched half space of a medium that scatters evenly shows
1 - H(1) sqrt(1 - albedo) head-on under a constant sky, with Chandrasekhar's H [1960, "Radiative transfer", section
38]. `root` is the inverse of that as a fraction of two polynomials, which shows every colour within 1.1e-5, dark
ones within 0.013 % of themselves, and what white lacks within 0.013 % of it; tests/half_spaces.py has H, and makes
the constants.

Another mean cosine g counts by the similarity relation: scattering counts 1 - g times. Against half spaces of
Henyey and Greenstein's phase function that is within 0.037 of the colour for g from -0.5 to 0.7, within 0.05 up to
0.95, and furthest off around a colour of 0.2.
"""

from __future__ import annotations

import numpy as np

# 1 + a c + b c^2 for a colour c, over and under the fraction.
NUMERATOR = (1.559855, 0.061367)
DENOMINATOR = (3.818356, 2.803097)


def root(color: np.ndarray) -> np.ndarray:
    """sqrt(1 - albedo) for colours in [0, 1], where g is 0."""
    c = np.asarray(color, np.float64)
    (a, b), (d, e) = NUMERATOR, DENOMINATOR
    out: np.ndarray = (1.0 - c) * (1.0 + c * (a + c * b)) / (1.0 + c * (d + c * e))
    return out


def single_scattering_albedo(color: np.ndarray, g: float) -> np.ndarray:
    """The share of light that is scattered, not absorbed, where it meets a particle: in [0, 1], for g in (-1, 1)."""
    lost = root(color) ** 2
    out: np.ndarray = (1.0 - lost) / (1.0 - g * lost)
    return out
