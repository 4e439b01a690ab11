"""float32 as a GPU's driver may compute it: GLSL 4.30, 4.7.1, lets it contract products and sums and round divisions
and roots worse than IEEE 754 does. Shaders' arithmetic is replayed with it in numpy, in whichever way is worst."""

from __future__ import annotations

import numpy as np

DIVISION_ULPS, ROOT_ULPS = 2.5, 2.0  # at most; the second one of 1 / inversesqrt, which is a GPU's root


def fma(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """a * b + c rounded once: the product of two float32 is exact in float64."""
    return (a.astype(np.float64) * b.astype(np.float64) + c.astype(np.float64)).astype(np.float32)


class Driver:
    """Without `contracts`, every product is rounded. `worst` is the share of the bounds by which divisions and roots
    are off, to either side at random."""

    def __init__(self, contracts: bool, worst: float = 1.0, seed: int = 1) -> None:
        self.contracts, self._worst = contracts, worst
        self._rng = np.random.default_rng(seed)

    def add_product(self, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        """a * b + c."""
        return fma(a, b, c) if self.contracts else np.asarray(a * b + c)

    def difference(self, a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
        """a * b - c * d."""
        return self.add_product(a, b, -(c * d))

    def dot(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Of vectors (n, 3): (n, 1)."""
        a, b = np.broadcast_arrays(a, b)
        out = a[:, :1] * b[:, :1]
        for k in (1, 2):
            out = self.add_product(a[:, k : k + 1], b[:, k : k + 1], out)
        return out

    def cross(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        parts = [self.difference(a[:, i], b[:, j], a[:, j], b[:, i]) for i, j in ((1, 2), (2, 0), (0, 1))]
        return np.stack(parts, axis=1)

    def divide(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return self._off(np.asarray(a).astype(np.float64) / b, DIVISION_ULPS)

    def root(self, a: np.ndarray) -> np.ndarray:
        return self._off(np.sqrt(a.astype(np.float64)), ROOT_ULPS)

    def normalize(self, a: np.ndarray) -> np.ndarray:
        return self.divide(a, self.root(self.dot(a, a)))

    def _off(self, exact: np.ndarray, ulps: float) -> np.ndarray:
        """The result off by so many units in the last place, half a unit of which is its rounding."""
        near = exact.astype(np.float32)
        if self._worst == 0.0:
            return near
        side = self._rng.choice([-1.0, 1.0], exact.shape) * self._worst * (ulps - 0.5)
        with np.errstate(invalid="ignore"):
            return (exact + side * np.spacing(np.abs(near)).astype(np.float64)).astype(np.float32)
