"""Reflectance of a thin film, as a table that all materials share: light that goes to and fro in it interferes.

Airy's series for the exact interfaces [Born & Wolf 1999, section 7.6] knows the materials by zeta alone, the product
of the two interfaces' amplitudes. Its m-th term has zeta^m W(m x) for a path difference x, where W is the integral of
exp(2 pi i x / wavelength) as the CIE 1931 observer sees it under D65, in linear Rec.709, where white is 1. W is a sum
of decaying waves here, W(x) = sum_j a_j exp(p_j x), so that the series are geometric and thick films fade to their
mean colour as they do to the eye. Four waves a channel keep reflectances within a quarter of 0.02 R + 0.004 of the
integral; tests/film.py has that, and shows where they come from. The kernels' side is
`shaders/bsdf/lobes/base/film.glsl`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

_DECAY = (  # 1/um, of each wave in red, green and blue
    (0.94786, 0.84141, 2.31745),
    (0.94645, 0.78747, 1.13654),
    (0.98369, 0.90601, 0.85588),
    (0.71419, 0.74375, 0.79310),
)
_TURN = (  # radians/um
    (9.98584, 9.83138, 10.39202),
    (10.29759, 10.67065, 11.08482),
    (11.86229, 11.95010, 13.52702),
    (14.12226, 14.11445, 14.69414),
)
_REAL = (
    (-4.99502, 0.09183, -0.04295),
    (7.81645, -0.14833, -0.31470),
    (-2.08684, 1.28754, 1.36023),
    (0.26541, -0.23104, -0.00258),
)
_IMAGINARY = (
    (3.28195, -0.28272, 0.17205),
    (-3.44058, 1.28285, -0.32505),
    (0.16468, -1.05442, 0.95011),
    (-0.00605, 0.05429, -0.79711),
)
EXPONENTS = -np.array(_DECAY) + 1j * np.array(_TURN)  # p_j (wave, channel)
AMPLITUDES = np.array(_REAL) + 1j * np.array(_IMAGINARY)  # a_j

FADING = 2.0  # um: paths in the table are even steps of 1 - exp(-x / FADING), the last of which is endless
# Numbers of zetas and paths. Reflectances of films of 3 nm to 10 um and all legal indices lie within 0.0005 of the
# series; only near grazing angles, with an index below 1.01 or a path below 0.06 um, one in 10 000 is off by more
# than 0.001, by 0.0015 at most.
SHAPE = (129, 2048)


def series(zeta: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Airy's series (..., 3), its real part, for a path difference in um: sum_m zeta^m W(m path)."""
    shifted = np.asarray(zeta)[..., None, None] * np.exp(EXPONENTS * np.asarray(path)[..., None, None])
    summed: np.ndarray = (AMPLITUDES * shifted / (1 - shifted)).real.sum(-2)
    return summed


def zeta_nodes() -> np.ndarray:
    """The real zetas of the table, from -1 to 1: the roots of their distances to the nearer end are even."""
    u = np.linspace(-1, 1, SHAPE[0])
    return np.asarray(np.sign(u) * (1 - (1 - np.abs(u)) ** 2))


@lru_cache(maxsize=1)
def table() -> np.ndarray:
    """(zeta, path, 4) float32: the series over zeta, times 1 - |zeta|, which bounds it; the last channel is 0."""
    # Rows at -1, 0 and 1 are 0 / 0; the table is continuous, and their neighbours at this distance have the limits.
    inner = np.clip(zeta_nodes(), -1 + 1e-7, 1 - 1e-7)
    inner[SHAPE[0] // 2] = 1e-7
    paths = -FADING * np.log1p(-np.linspace(0, 1, SHAPE[1])[:-1])
    out = np.zeros((*SHAPE, 4), np.float32)
    for row, zeta in zip(out, inner, strict=True):
        row[:-1, :3] = series(np.asarray(zeta), paths) * ((1 - abs(zeta)) / zeta)
    return out
