"""The noise meter: a picture's error from a second, independent scramble of the sampler on a share of its pixels.

Half the mean squared difference of two independent estimates of a pixel is its variance, whatever the sampler gains
(the variance of a pixel's samples misses that gain: with 256 samples of Sobol's sequence it is 3.6 times too large).
How good the estimate is depends on the choice of pixels: in a Cornell box the edges of the lamp have most of the
error, and with 4096 pixels drawn evenly the estimate was off by up to 60 %. So the pixels are drawn once there are
FROM samples, half of them by the variance that these show, half evenly, and are weighed by the reciprocals of their
probabilities [Horvitz & Thompson 1952].

Where few pixels have most of the error, the picture's own error scatters as well (by 10 % for a Cornell box at 64 x
64), and a single difference is due to the other estimate as much as to the picture's own. So such pixels get up to
MOST estimates: with one each, the error of 4 to 7 pictures of that box in 100 was estimated more than 20 % wrong;
with MOST it is 0 or 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout import LUMINANCE, METER_REPLICATES
from gpu.layout.bindings import Slot
from gpu.layout.pixel_layers import ACCUMULATORS, VECTOR_BYTES
from gpu.picture import blocks
from gpu.picture.accumulators import Accumulators
from gpu.picture.schedule import work_groups

# Samples of each pixel, all in the total, at which the meter starts; before, the samples' variance must do.
FROM = blocks.FIRST
LINE = 64  # metered pixels in a row of the meter's buffers
_PIXELS, _FEWEST = 2048, 256  # metered pixels; in small pictures a quarter of all, but at least the second number
_EVEN = 0.5  # share of the metered pixels that is drawn evenly
MOST = 4  # most estimates of a pixel
_BLOCKS = 1 << 20  # most blocks of pixels for which weights are computed
_LUMINANCE = np.array(LUMINANCE)


def defines(weigh: int = 0, variance: int = 0) -> dict[str, object]:
    """The defines that meter.comp is compiled with."""
    defines = {"METER_WEIGH": weigh, "METER_VARIANCE": variance, "METER_LINE": LINE}
    return features.defines(frozenset()) | defines


class NoiseMeter:
    """Made for a picture of `size`; no more than `most` of its pixels are bound at once."""

    def __init__(self, context: Any, kernels: KernelCache, size: tuple[int, int], most: int) -> None:
        self._context, self._kernels, self._size, self._most = context, kernels, size, most
        pixels = size[0] * size[1]
        self._count = min(pixels, max(_FEWEST, min(_PIXELS, pixels // 4)))
        self.lines = -(-self._count // LINE)
        self.buffers: dict[Slot, Any] = {}

    def allocate(self) -> None:
        """Allocate accumulators like the picture's. Their second moments begin as x, whose fraction is the estimate's
        number, y, and 1 / probability of the pixel."""
        for slot in ACCUMULATORS:
            self.buffers[slot] = contexts.allocate(self._context, VECTOR_BYTES * LINE * self.lines)

    def place(self, main: dict[Slot, Any], seed: int) -> None:
        """Draw the metered pixels by the picture's second moments."""
        side = max(1, int(np.ceil(np.sqrt(self._size[0] * self._size[1] / _BLOCKS))))
        weights = self._weigh(main[Slot.MOMENTS], side)
        places = np.zeros((LINE * self.lines, 4), np.float32)
        drawn = draw(weights, self._size, side, self._count, seed)
        places[: len(drawn), :3] = drawn
        self.buffers[Slot.MOMENTS].write(places.tobytes())
        for slot in (Slot.SUM, Slot.COMPENSATION):
            self.buffers[slot].clear()

    def _weigh(self, moments: Any, side: int) -> np.ndarray:
        """(rows, columns) of blocks of `side` x `side` pixels: the relative variance of a pixel in each."""
        width, height = self._size
        kernel = self._kernels.get("meter.comp", defines(weigh=1))
        columns, parts = -(-width // side), []
        rows_at_once = max(side, self._most // width // side * side)
        for first in range(0, height, rows_at_once):
            rows = min(rows_at_once, height - first)
            lines = -(-rows // side)
            output = contexts.allocate(self._context, 4 * columns * lines)
            moments.bind_to_storage_buffer(int(Slot.MOMENTS), offset=16 * width * first, size=16 * width * rows)
            output.bind_to_storage_buffer(int(Slot.OUTPUT))
            kernel["size"].value, kernel["block"].value, kernel["rim"].value = (width, rows), side, int(side > 1)
            contexts.dispatch(self._context, kernel, *work_groups(columns, lines))
            parts.append(np.frombuffer(output.read(), np.float32).reshape(lines, columns))
            output.release()
        weights = np.concatenate(parts)
        return weights if side > 1 else around(weights)

    def error(self, sums: Accumulators, metered: bool, scale: float) -> tuple[float, float]:
        """Estimated RMSE of the picture's luminance, and its mean; `metered`: the pixels were placed and sampled.
        Second moments are of radiance over `scale`."""
        pixels = self._size[0] * self._size[1]
        totals, seen = self._totals(sums, variance=not metered)
        mean = totals[0] / pixels
        if mean == 0:
            return 0.0, 0.0
        if not metered:
            return float(np.sqrt(totals[1] / pixels) * scale), float(mean)
        places, values = (self._vectors(slot) for slot in (Slot.MOMENTS, Slot.SUM))
        other = values[:, :3].astype(float) @ _LUMINANCE / np.maximum(places[:, 3], 1)
        return float(np.sqrt(squared_error(places[:, :3], seen / mean, other / mean) / pixels) * mean), float(mean)

    def _vectors(self, slot: Slot) -> np.ndarray:
        return np.frombuffer(self.buffers[slot].read(), np.float32).reshape(-1, 4)

    def _totals(self, sums: Accumulators, variance: bool) -> tuple[np.ndarray, np.ndarray]:
        """Luminance and, with `variance`, its variance, summed over the picture; that of each metered pixel."""
        width, height = self._size
        kernel = self._kernels.get("meter.comp", defines(variance=int(variance)))
        output = contexts.allocate(self._context, VECTOR_BYTES * LINE * self.lines)
        output.bind_to_storage_buffer(int(Slot.OUTPUT))
        self.buffers[Slot.MOMENTS].bind_to_storage_buffer(int(Slot.METER_PLACES))
        kernel["width"].value, kernel["lines"].value = width, self.lines
        totals, seen = np.zeros(2), np.zeros(LINE * self.lines)
        for first in range(0, width * height, self._most):
            count = min(self._most, width * height - first)
            sums.bind(kernel, first, count)
            kernel["first"].value, kernel["count"].value = first, count
            contexts.dispatch(self._context, kernel, *work_groups(LINE, self.lines))
            results = np.frombuffer(output.read(), np.float32).reshape(-1, 4).astype(float)
            totals += results[:, :2].sum(axis=0)
            seen += results[:, 2]
        output.release()
        return totals, seen


def squared_error(places: np.ndarray, seen: np.ndarray, other: np.ndarray) -> float:
    """The estimated sum over the pixels: at `places` (as `draw` gives them; none of weight 0) the picture has `seen`,
    and `other` is an independent estimate. The square of the difference to the mean of k such is 1 + 1/k
    variances."""
    used = places[:, 2] > 0
    places, seen, other = places[used], seen[used], other[used]
    first = np.flatnonzero(places[:, 0] % 1 == 0)  # of each pixel's estimates, which are adjacent
    if not len(first):
        return 0.0
    counts = np.diff(first, append=len(places))
    means = np.add.reduceat(other, first) / counts
    return float(((seen[first] - means) ** 2 * counts / (counts + 1) * places[first, 2]).sum())


def draw(weights: np.ndarray, size: tuple[int, int], side: int, count: int, seed: int) -> np.ndarray:
    """About `count` estimates, (n, 3), in order: x, y, 1 / probability of the pixel. Blocks of `side` x `side` pixels
    are drawn half by `weights` and half evenly, up to MOST times where they are one pixel. The second estimate of a
    pixel and those after it follow the first, with their number over METER_REPLICATES as the fraction of x. The
    sample is systematic: it is spread over the picture, and a block that is due once is not drawn twice."""
    width, height = size
    across = np.minimum(side, width - side * np.arange(weights.shape[1]))
    down = np.minimum(side, height - side * np.arange(weights.shape[0]))
    members = np.outer(down.astype(weights.dtype), across.astype(weights.dtype)).ravel()
    shares = members * weights.ravel()
    total, pixels = shares.sum(dtype=float), width * height
    if 0 < total < np.inf:
        shares *= (1 - _EVEN) / total
        shares += members * (_EVEN / pixels)
    else:
        shares = members / pixels
    times = inclusion(shares, count, MOST if side == 1 and count < pixels else 1)
    rng = np.random.default_rng([seed, 0x6E6F6973])
    ends = np.cumsum(times, dtype=float)
    blocks = np.searchsorted(ends, np.arange(int(ends[-1] + 1)) + rng.random())
    blocks = blocks[blocks < len(ends)]
    inside = rng.integers(0, members[blocks].astype(int))
    row, column = np.divmod(blocks, weights.shape[1])
    x, y = column * side + inside % across[column], row * side + inside // across[column]
    place = np.arange(len(blocks))
    number = place - np.maximum.accumulate(np.where(np.diff(blocks, prepend=-1) > 0, place, 0))
    weight = members[blocks] / np.minimum(times[blocks], 1)
    drawn: np.ndarray = np.stack([x + number / METER_REPLICATES, y, weight], axis=1)
    return drawn[:count]


def around(values: np.ndarray) -> np.ndarray:
    """The mean of each element of a (rows, columns) array and its up to eight neighbours."""
    down, counts = values.copy(), [np.full(n, 3, values.dtype) for n in values.shape]
    down[1:] += values[:-1]
    down[:-1] += values[1:]
    both = down.copy()
    both[:, 1:] += down[:, :-1]
    both[:, :-1] += down[:, 1:]
    for count in counts:
        count[0] -= 1
        count[-1] -= 1
    both /= counts[0][:, None]
    both /= counts[1]
    return both


def inclusion(shares: np.ndarray, count: int, most: int = 1) -> np.ndarray:
    """Numbers that sum to `count`, each at most `most`, and in proportion to `shares` where they are below that."""
    factor, full = count / float(shares.sum(dtype=float)), 0
    for _ in range(8):  # each round fills more entries to `most`; after 8 the remainder is a rounding error
        free = shares < most / factor
        before, full = full, len(shares) - int(np.count_nonzero(free))
        rest = count - most * full
        if full == before or rest <= 0 or full == len(shares):
            break
        factor = rest / float(shares.sum(dtype=float, where=free))
    times: np.ndarray = shares * factor
    np.minimum(times, most, out=times)
    return times
