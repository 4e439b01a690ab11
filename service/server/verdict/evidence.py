"""Evidence about two pictures: sums over independent groups of samples, from which the tests are made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from service.colorimetry import LUMINANCE

Array = npt.NDArray[np.float64]

# Tested are luminance, red and blue: green is a combination of these. Columns weigh red, green and blue.
CHANNELS = np.array([LUMINANCE, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).T
# Of the values: two kernels may round the same picture differently [measured at up to 2e-6 with other feature flags].
ROUNDING = 1e-5
MOST = 1e100  # squares and sums of what is larger would leave float64; a picture's own numbers end at 3e38
PIXEL_BYTES = 640  # that comparing takes for each pixel at its most, in the figures [measured: 606]


@dataclass(frozen=True)
class Estimate:
    """A picture as rendered so far: mean radiance and the variance of that mean, (height, width, 3) each, of
    `samples` samples a pixel. The variance is that of independent samples, which those of a low-discrepancy sampler
    are not: it is too large for them, and 0 where there is one sample only."""

    mean: Array
    variance: Array
    samples: int

    @staticmethod
    def of(color: npt.NDArray[np.float32], variance: npt.NDArray[np.float32], samples: int) -> Estimate:
        """From the layers as the renderer gives them: alpha, with which colour is multiplied, is left out."""
        return Estimate(color[..., :3].astype(np.float64), variance[..., :3].astype(np.float64), samples)


class Sum:
    """One side: independent estimates of one picture, weighed by their samples."""

    def __init__(self, estimate: Estimate) -> None:
        self.samples = estimate.samples
        self._mean = estimate.mean * estimate.samples
        self._variance = estimate.variance * float(estimate.samples) ** 2

    def add(self, estimate: Estimate) -> None:
        self.samples += estimate.samples
        self._mean += estimate.mean * estimate.samples
        self._variance += estimate.variance * float(estimate.samples) ** 2

    @property
    def mean(self) -> Array:
        return self._mean / self.samples

    @property
    def variance(self) -> Array:
        """Variance of the mean, per pixel."""
        return self._variance / float(self.samples) ** 2


class Evidence:
    """Both sides, and their differences where groups of both have the same seeds."""

    def __init__(self, a: Estimate, b: Estimate, alike: bool = True) -> None:
        """`alike`: whether both sides find light in the same ways. Those of two estimators do not, so that one may be
        noisy where the other one is not."""
        self.a, self.b, self.alike = Sum(a), Sum(b), alike
        self.groups = 1
        self.paired = True  # each side has as many groups as the other, and they were added together
        difference = (b.mean - a.mean) @ CHANNELS
        self._squares = pyramid_of_squares(difference)
        self._even = difference * a.samples

    def add(self, a: Estimate, b: Estimate) -> None:
        """Another group of samples of both, with a seed of its own, the same for both."""
        self.a.add(a)
        self.b.add(b)
        difference = (b.mean - a.mean) @ CHANNELS
        for level, more in enumerate(pyramid_of_squares(difference)):
            self._squares[level] += more
        if self.groups % 2 == 0:
            self._even += difference * a.samples
        self.groups += 1

    def add_to(self, side: str, estimate: Estimate) -> None:
        """More samples of one side, "a" or "b"; the other one stays as it is."""
        (self.a if side == "a" else self.b).add(estimate)
        self.paired, self.groups = False, 1

    @property
    def brightness(self) -> Array:
        """The mean of both, by channel."""
        return np.asarray(0.5 * (np.abs(self.a.mean) + np.abs(self.b.mean)) @ CHANNELS)

    @property
    def shape(self) -> tuple[int, int]:
        height, width = self.a.mean.shape[:2]
        return height, width

    @property
    def difference(self) -> Array:
        """b - a, by channel of CHANNELS."""
        return np.asarray((self.b.mean - self.a.mean) @ CHANNELS)

    @property
    def rounding(self) -> Array:
        """The difference that rounding alone may make."""
        return np.asarray(0.5 * ROUNDING * (np.abs(self.a.mean) + np.abs(self.b.mean)) @ CHANNELS)

    @property
    def variance(self) -> Array:
        """Variance of the difference by the samples' own variances, as if a and b were independent, and both had the
        larger one of their two variances of a sample: so the side with few samples, which may have missed the rare
        bright ones, is not taken to be more certain than the other one says."""
        a, b = self.a, self.b
        of_a, of_b = np.maximum(a.variance, b.variance * (b.samples / a.samples)), b.variance
        of_b = np.maximum(of_b, a.variance * (a.samples / b.samples))
        spread = np.sqrt(of_a + of_b) @ CHANNELS  # as if the channels' errors went together, which is the worst case
        return np.asarray(spread**2)

    @property
    def squares(self) -> list[Array]:
        """Squared differences, summed over the groups, of blocks of 1, 2, 4 ... pixels a side, summed up within the
        block before they are squared."""
        return self._squares if self.paired else pyramid_of_squares(self.difference)

    @property
    def halves(self) -> tuple[Array, Array] | None:
        """The differences of two independent halves of the groups; None where there is one group only."""
        if not self.paired or self.groups < 2:
            return None
        whole = (self.b.mean - self.a.mean) @ CHANNELS * self.a.samples
        return self._even, whole - self._even


def pyramid_of_squares(difference: Array) -> list[Array]:
    out, level = [], np.clip(difference, -MOST, MOST)
    while True:
        out.append(level**2)
        if max(level.shape[:2]) == 1:
            return out
        level = blocks(level)


def blocks(values: Array, side: int = 2) -> Array:
    """Sums of blocks of `side` x `side` pixels, those at the right and at the bottom as large as there is room."""
    if side == 1:
        return values
    height, width = values.shape[:2]
    rows = np.add.reduceat(values, np.arange(0, height, side), axis=0)
    return np.asarray(np.add.reduceat(rows, np.arange(0, width, side), axis=1))
