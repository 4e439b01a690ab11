"""Statistics for tests about light: chi-square, z, and the level for many cases at once."""

from __future__ import annotations

import math

import numpy as np
from scipy import stats


def sidak(level: float, cases: int) -> float:
    """The level of each of `cases` independent tests that gives all of them together `level`."""
    return 1 - (1 - level) ** (1 / cases)


def chi_square(observed: np.ndarray, expected: np.ndarray, least: float = 5.0) -> float:
    """p-value of counts against expected counts; cells expecting fewer than `least` are pooled, rarest first."""
    order = np.argsort(expected.ravel())
    o, e = observed.ravel()[order].astype(float), expected.ravel()[order].astype(float)
    pooled = int(np.searchsorted(np.cumsum(e), least)) + 1 if (e < least).any() else 0
    while pooled < len(e) and e[pooled] < least:
        pooled += 1
    if pooled:
        o = np.concatenate([[o[:pooled].sum()], o[pooled:]])
        e = np.concatenate([[e[:pooled].sum()], e[pooled:]])
    if (o[e == 0] > 0).any():
        return 0.0
    keep = e > 0
    o, e = o[keep], e[keep]
    statistic = float(((o - e) ** 2 / e).sum())
    return float(stats.chi2.sf(statistic, max(1, len(e) - 1)))


def z_test(values: np.ndarray, expected: float) -> float:
    """p-value of the mean of independent `values` being `expected`."""
    error = values.std(ddof=1) / math.sqrt(values.size)
    if error == 0:
        return 1.0 if math.isclose(float(values.mean()), expected, rel_tol=1e-5) else 0.0
    return float(2 * stats.norm.sf(abs(float(values.mean()) - expected) / error))
