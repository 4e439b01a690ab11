"""How wide the peak of a distribution of facets is, and the parameter that makes that of another one as wide.

Each has a parameter of its own kind: a width, an exponent, an inverse width."""

from __future__ import annotations

import math
from collections.abc import Callable

# How fast D falls off at its peak, log D = log D(0) - slope theta^2, by alpha and gamma; alpha by slope and gamma.
_PEAKS: dict[str, tuple[Callable[[float, float], float], Callable[[float, float], float]]] = {
    "phong": (lambda n, g: n / 2, lambda s, g: 2 * s),
    "beckmann": (lambda a, g: 1 / a**2 - 2, lambda s, g: (s + 2) ** -0.5),
    "ggx": (lambda a, g: 2 / a**2 - 2, lambda s, g: (s / 2 + 1) ** -0.5),
    "gtr": (lambda a, g: g / a**2 - g, lambda s, g: (s / g + 1) ** -0.5),
    "abc": (lambda a, g: a * g / 2, lambda s, g: 2 * s / (g or 1)),
    "sgd": (lambda a, g: 1 / a + g / a**2 - 2, lambda s, g: _sgd(s, g)),
    "gaussian": (lambda a, g: 1 / a**2, lambda s, g: s**-0.5),
}
_FLATTEST = 1e-3  # a slope; below it, and above 0, all peaks are flat


def _sgd(slope: float, gamma: float) -> float:
    if gamma == 0:
        return 1 / (slope + 2)
    return 2 / (math.sqrt(1 + 4 * gamma * (slope + 2)) - 1) * gamma


def same_width(before: str, alpha: float, gamma: float, after: str, gamma_after: float) -> float:
    """The alpha with which the peak of `after` is as wide as that of `before`, two distributions; it may be out of
    range."""
    slope = max(_PEAKS[before][0](alpha, gamma), _FLATTEST)
    return _PEAKS[after][1](slope, gamma_after)
