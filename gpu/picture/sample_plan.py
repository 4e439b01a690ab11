"""How many samples each part of a picture gets: more where there is more noise, without biasing the mean.

The squared error of a picture, the sum of variance / samples over its pixels, is least for a given number of samples
when each pixel's is in proportion to its standard deviation [Neyman 1934]; of points that are spread evenly, whose
variance falls faster than that, to a lesser power. A picture is planned in areas of 8 x 8 pixels, whose errors are
alike, and in each by four classes of rows, y mod 4. A rule that decided a pixel's number of samples by those samples
would stop too early where they missed the light, and the picture would be too dark. So a class is planned by the
samples of the next one, and never by its own; those of the next one were planned by the one after it. With three
decisions the circle of four does not close: no sample influences how many its own pixel gets, and the mean is
unbiased.

Runs without GL.
"""

from __future__ import annotations

import numpy as np

from gpu.layout import PLAN_AREA as AREA
from gpu.layout import PLAN_CLASSES as CLASSES

DECISIONS = (8, 32, 128)  # mean samples of a pixel at which a new plan is made; at most CLASSES - 1 of them
LEAST, MOST = 1 / 8, 32.0  # bounds in units of the mean: the least finds light of few paths, the most bounds a pass
# Exponent of the variance: the error is least with 1 / (1 + p), where a pixel's squared error falls with samples^-p;
# p is 1.5 for Sobol' points.
_EXPONENT = 0.4
_NEAR = 0.7  # weight of the area itself; its neighbours share the rest: few samples say little about one area
_COUNTED = 1 << 24  # samples of a pixel: the greatest number that float32 counts to

WORDS = np.dtype([("counts", np.uint32, CLASSES), ("weights", np.float32, CLASSES)])  # words of an area on the device


def pixels_of(width: int, height: int) -> np.ndarray:
    """(rows, columns, CLASSES) of areas: the number of the picture's pixels in that area and class."""
    across = np.minimum(AREA, width - AREA * np.arange(-(-width // AREA)))
    y = np.arange(height)
    down = np.zeros((-(-height // AREA), CLASSES), np.int64)
    np.add.at(down, (y // AREA, y % CLASSES), 1)
    return np.asarray(down[:, None, :] * across[None, :, None])


def weights_of(variances: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """The weights to which each class's samples shall be proportional, float32. All arrays are (rows, columns,
    CLASSES): `variances` of a sample, summed over the pixels of an area and class, and the number of those
    `pixels`."""
    out = np.ones(pixels.shape)
    if not np.isfinite(variances).all():  # beyond float32: it is unknown which areas err more
        return out.astype(np.float32)
    for kind in range(CLASSES):
        seen = (kind + 1) % CLASSES
        sums, members = _spread(variances[..., seen]), _spread(pixels[..., seen].astype(float))
        weights = np.divide(sums, members, out=np.zeros_like(sums), where=members > 0) ** _EXPONENT
        mine = pixels[..., kind]
        mean = (weights * mine).sum() / max(mine.sum(), 1)
        if mean > 0:
            out[..., kind] = np.clip(weights / mean, LEAST, MOST)
    return out.astype(np.float32)


def _spread(values: np.ndarray) -> np.ndarray:
    """The weighted mean of each area's value and its eight neighbours'."""
    padded = np.pad(values.astype(float), 1)
    rows, columns = values.shape
    around = sum(padded[dy : dy + rows, dx : dx + columns] for dy in range(3) for dx in range(3))
    return np.asarray(_NEAR * values + (1 - _NEAR) / 8 * (around - values))


class SamplePlan:
    """Samples in proportion to `weights`, as far as no pixel gets fewer than its `counts`, which it has already."""

    def __init__(
        self, pixels: np.ndarray, counts: np.ndarray | None = None, weights: np.ndarray | None = None
    ) -> None:
        self._pixels = pixels
        self.counts = np.zeros(pixels.shape, np.uint32) if counts is None else counts
        self.weights = np.ones(pixels.shape, np.float32) if weights is None else weights
        self._classes = [self._cumulated(k) for k in range(CLASSES)]

    def _cumulated(self, kind: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For a class, in the order in which its areas begin to get samples: the level at which each begins, then the
        samples of all areas that have not begun, and the weight of those that have."""
        members, weights = self._pixels[..., kind].ravel(), self.weights[..., kind].ravel().astype(float)
        counts = self.counts[..., kind].ravel().astype(float)
        levels = counts / weights
        order = np.argsort(levels, kind="stable")
        begun = np.cumsum((members * weights)[order])
        had = (members * counts)[order]
        return levels[order], had.sum() - np.cumsum(had), begun

    def at(self, samples: int) -> np.ndarray:
        """(rows, columns, CLASSES) uint32: each pixel's samples where their mean is `samples`. Rises with it."""
        out = self.counts.copy()
        for kind, (levels, resting, begun) in enumerate(self._classes):
            wanted = float(samples) * self._pixels[..., kind].sum()
            k = int(np.searchsorted(resting + begun * levels, wanted, side="right")) - 1
            if k >= 0 and begun[k] > 0:
                level = (wanted - resting[k]) / begun[k]
                share = np.floor(level * self.weights[..., kind].astype(float) + 0.5)
                out[..., kind] = np.maximum(out[..., kind], np.minimum(share, _COUNTED).astype(np.uint32))
        return out
