"""Numbers without a closed form of the model `microfacet`: factors of distributions, and visible areas of facets.

D is written as exp(log_factor + log_shape), with the integral of D cos over the hemisphere equal to 1. Integrals run
over x = log(tan theta_m), in which every distribution is smooth, whatever its width: dtheta = sin cos dx.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from gpu.layout.microfacet_records import Distribution

INTERVALS = 32  # on the axis of directions, each with a cubic
# Rows of a table for all alphas, at equal steps of log(alpha + ROW_OFFSETS): many, because with a gamma of 10 gtr
# changes greatly within a small change of alpha near 1.
ROWS, ROWS_GTR = 192, 400
ROW_OFFSETS = {Distribution.PHONG: 2.0}  # 0 for the others
CLOSED_FACTOR = (Distribution.PHONG, Distribution.BECKMANN, Distribution.GGX, Distribution.GTR)
CLOSED_MASKING = (Distribution.BECKMANN, Distribution.GGX)
_REACH = 14.0  # of integrals in x beyond the bulk of D; the rest is a share of about exp(-14)
_LEAST_X, _MOST_X = -35.0, 25.0  # beyond these, sin^2 and cos^2 leave nothing of any D
_POINTS = np.array([0, 1 / 3, 2 / 3, 1])  # of a cubic
_CUBIC = np.linalg.inv(_POINTS[:, None] ** np.arange(4))  # from its values there to its coefficients


def _quadrature(end: float, panels: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss and Legendre, eight to a panel, on 0..end."""
    x, w = np.polynomial.legendre.leggauss(8)
    step = end / panels
    nodes = step * (np.arange(panels)[:, None] + 0.5 * (1 + x))
    return nodes.ravel(), np.tile(0.5 * step * w, panels)


_WHOLE, _WHOLE_WEIGHTS = _quadrature(_MOST_X - _LEAST_X, 240)
_UNIT, _UNIT_WEIGHTS = _quadrature(1.0, 60)


def log_shape(distribution: Distribution, x: np.ndarray, alpha: float, gamma: float) -> np.ndarray:
    """log D without its factor, at tan theta_m = exp(x)."""
    tan2 = np.exp(2 * x)
    sin2, log_cos2 = tan2 / (1 + tan2), -np.log1p(tan2)
    match distribution:
        case Distribution.PHONG:
            return np.asarray(0.5 * alpha * log_cos2)
        case Distribution.BECKMANN:
            return np.asarray(-tan2 / alpha**2 - 2 * log_cos2)
        case Distribution.GGX:
            return log_shape(Distribution.GTR, x, alpha, 2.0)
        case Distribution.GTR if alpha <= 1:
            return np.asarray(-gamma * np.log1p(sin2 * (1 / alpha**2 - 1)))
        case Distribution.GTR:
            return np.asarray(-gamma * np.log1p(np.exp(log_cos2) * (alpha**2 - 1)))
        case Distribution.ABC:
            return np.asarray(-gamma * np.log1p(alpha * sin2 / (1 + np.exp(0.5 * log_cos2))))
        case Distribution.SGD:
            return np.asarray(-tan2 / alpha - gamma * np.log1p(tan2 / alpha**2) - 2 * log_cos2)
        case Distribution.GAUSSIAN:
            return np.asarray(-((np.arctan(np.exp(x)) / alpha) ** 2))


@lru_cache(maxsize=1024)
def log_factor(distribution: Distribution, alpha: float, gamma: float) -> float:
    """The logarithm of D / exp(log_shape)."""
    return _bulk(distribution, alpha, gamma)[0]


@lru_cache(maxsize=1024)
def _bulk(distribution: Distribution, alpha: float, gamma: float) -> tuple[float, float]:
    """The log_factor, and the median of x where facets count by D cos."""
    x = _LEAST_X + _WHOLE
    shares = _WHOLE_WEIGHTS * np.exp(log_shape(distribution, x, alpha, gamma) - 4 * np.logaddexp(x, -x) / 2)
    sums = np.cumsum(shares)  # cos^2 sin^2 = exp(-2 log(e^x + e^-x))
    return float(-np.log(2 * np.pi * sums[-1])), float(x[np.searchsorted(sums, 0.5 * sums[-1])])


def seen_area(distribution: Distribution, alpha: float, gamma: float, sin: np.ndarray, cos: np.ndarray) -> np.ndarray:
    """The projected area of the facets that face a direction w: the integral of D(m) max(0, w.m) over the hemisphere.

    G1 is cos over this. If no facet faced away, the area would be cos. Facets beyond theta_m = 90 degrees - theta do
    at some azimuths, and leaving those out adds 2 q (sqrt(1 - r^2) - r acos r), integrated over the azimuth, with q =
    sin sin_m and r = cot / tan_m.
    """
    factor, median = _bulk(distribution, alpha, gamma)
    cot = np.maximum(cos / np.maximum(sin, 1e-300), np.exp(median - 12))  # less changes nothing
    first = np.log(np.minimum(cot, 1e12))[:, None]
    length = np.maximum(max(median, 0.0) + _REACH - first, 0.0)
    root = np.sqrt(length) * _UNIT  # y = root^2 takes the square root out of the integrand's beginning
    y = root**2
    x, r = first + y, np.exp(-y)
    across = np.sqrt(-np.expm1(-2 * y))
    more = across - r * np.arctan2(across, r)
    # sin^3 cos of the facets = exp(3 x) / (1 + exp(2 x))^2
    log_density = factor + log_shape(distribution, x, alpha, gamma) + 3 * x - 2 * np.logaddexp(0.0, 2 * x)
    integral = (np.exp(log_density) * more * 2 * root) @ _UNIT_WEIGHTS * np.sqrt(length[:, 0])
    return np.asarray(cos + 2 * sin * integral)


@lru_cache(maxsize=2048)
def row(distribution: Distribution, alpha: float, gamma: float, masks: bool) -> np.ndarray:
    """(texels, 4) float32: the row of a table, see `gpu.layout.microfacet_records`. Not to be written to.

    The axis of directions is log((sin / far + cos) / (cos + near sin)): logarithmic in the tangent between the
    directions in which facets begin to hide each other and 90 degrees, linear beyond both. Cubics stay within 1e-4 of
    the area where `near` is a tenth of the facets' median slope, or `far` of its inverse, whichever is below 0.1.
    """
    factor, median = _bulk(distribution, alpha, gamma)
    near, far = min(1.0, 0.1 * np.exp(median)), min(1.0, 0.1 * np.exp(-median))
    width = -np.log(near * far)
    head = np.array([[factor, near, far, INTERVALS / width]], np.float32)
    if not masks:
        return head
    places = np.linspace(0, 1, 3 * INTERVALS + 1)
    grown = np.exp(places * width)  # (sin / far + cos) / (cos + near sin)
    sin, cos = far * (grown - 1), 1 - near * far * grown
    cos[-1] = 0.0
    size = np.hypot(sin, cos)
    area = seen_area(distribution, alpha, gamma, sin / size, cos / size)
    values = area[3 * np.arange(INTERVALS)[:, None] + np.arange(4)]
    return np.concatenate([head, (values @ _CUBIC.T).astype(np.float32)])


def row_alphas(distribution: Distribution, low: float, high: float) -> Sequence[float]:
    """The alphas of the rows of a table for this range."""
    offset = ROW_OFFSETS.get(distribution, 0.0)
    count = ROWS_GTR if distribution == Distribution.GTR else ROWS
    alphas = np.exp(np.linspace(np.log(low + offset), np.log(high + offset), count)) - offset
    found: list[float] = np.clip(alphas, low, high).tolist()
    return found
