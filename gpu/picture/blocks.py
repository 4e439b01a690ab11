"""The blocks into which a picture's samples are parted: [0, 8), [8, 64), [64, 128), [128, 192) and so on.

Each block is summed by itself, from zero, and is then merged into the total of those before it. So any rows of a
block can be traced by any renderer, and the picture has the same bits as that of one renderer. The first block is
short and is the total's beginning, as merging it into an empty total would give its own bits. Pictures with
`adaptive` are not parted: their pixels have different numbers of samples.

Runs without GL.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

FIRST, SIZE = 8, 64  # samples: the first border, and the distance of the others


def border_after(samples: int) -> int:
    """The first border above this number of samples: one of 8, 64, 128, 192 and so on."""
    return FIRST if samples < FIRST else (samples // SIZE + 1) * SIZE


def stop_after(samples: int) -> int:
    """The first number of samples above this one at which passes end, whatever they cost: 8, 16, 32, 64, 128."""
    return next((stop for stop in (FIRST, 16, 32) if samples < stop), border_after(samples))


def is_stop(samples: int) -> bool:
    """True if passes end at this number of samples."""
    return samples > 0 and stop_after(samples - 1) == samples


@dataclass(frozen=True)
class Band:
    """Samples [first, first + count) of the pixels in rows [top, top + rows); they belong to one block."""

    first: int
    count: int
    top: int
    rows: int

    def __post_init__(self) -> None:
        if min(self.first, self.top) < 0 or min(self.count, self.rows) < 1:
            raise ValueError(f"{self} is empty, or begins before the picture")
        if self.first + self.count > border_after(self.first):
            raise ValueError(f"{self} crosses the border of a block at {border_after(self.first)} samples")


class Sums(NamedTuple):
    """Accumulators of some pixels, each (..., 4) float32."""

    sum: np.ndarray  # radiance and alpha
    lost: np.ndarray  # the rounding error of the sum [Kahan 1965]
    moments: np.ndarray  # second moments of the scaled radiance about its mean; the number of samples


def merged(total: Sums, block: Sums, moment_scale: float) -> Sums:
    """The sums of the samples of both, as `merge.comp` computes them (`accumulate/accumulated.glsl` has the
    formulas). Pixels that have no sample in the block keep their bits."""
    sum_, lost = (_chosen(both, total, block, k) for k, both in enumerate(_added(total, block)))
    return Sums(sum_, lost, merged_moments(total, block, moment_scale))


def merged_moments(total: Sums, block: Sums, moment_scale: float) -> np.ndarray:
    """The moments of `merged`, without the other sums."""
    na, nb = total.moments[..., 3:], block.moments[..., 3:]
    n = na + nb
    delta = (_mean(block) - _mean(total)) * np.float32(moment_scale)
    second = total.moments[..., :3] + block.moments[..., :3] + delta * delta * (na * (nb / np.maximum(n, 1)))
    return _chosen(np.concatenate([second, n], axis=-1), total, block, Sums._fields.index("moments"))


def _chosen(both: np.ndarray, total: Sums, block: Sums, k: int) -> np.ndarray:
    """`both` where both have samples; else the k-th accumulator of the one that has samples."""
    na, nb = total.moments[..., 3:] > 0, block.moments[..., 3:] > 0
    if na.all() and nb.all():
        return both
    return np.where(nb, np.where(na, both, block[k]), total[k])


def _mean(part: Sums) -> np.ndarray:
    sum_ = part.sum[..., :3].astype(np.float64) - part.lost[..., :3]
    mean: np.ndarray = (sum_ / np.maximum(part.moments[..., 3:], 1)).astype(np.float32)
    return mean


def _added(total: Sums, block: Sums) -> tuple[np.ndarray, np.ndarray]:
    t = total.sum + block.sum
    taken = t - total.sum
    left = ((total.sum - (t - taken)) + (block.sum - taken)) - (total.lost + block.lost)
    sum_ = t + left
    return sum_, (sum_ - t) - left
