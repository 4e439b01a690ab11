"""Decides if two pictures differ beyond noise, by tests that need no knowledge of how noise is distributed.

Where a and b have the same expectation, each of many small differences d_i is as likely positive as negative. Then,
whatever their sizes, S = sum d_i over V, V^2 = sum d_i^2, has tails little above those of a normal variable N:

    P(|S| >= t V) <= 2 exp(-t^2 / 2)         [Hoeffding 1963, theorem 2, given the sizes; so Efron 1969]
    P(|S| >= t V) <= 2 c P(N >= t), c < 3.18 [Bentkus and Dzindzalieta 2015, theorem 1.1]

A firefly makes V as large as S, so it proves nothing. What counts as one difference is chosen in three ways:

    samples    each sample of each pixel, by the variance of the pixel's samples: also for one picture of each
    groups     blocks of pixels in groups of samples, with the same seeds for a and b, whose noise cancels out
    structure  products of two independent halves of the groups: differences of any sign that are there in both

Regions are squares of 1, 2, 4 ... pixels and the whole picture. The p-values of all regions, channels and ways are
corrected as Bonferroni did, each way and size having the same share; and so are looks at growing numbers of samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from service.server.verdict.evidence import Array, Evidence, blocks

# Differences in a region at the least: with n of them no p-value is below 2 exp(-n / 2), which is 2e-14 for 64.
ENOUGH = 64
# Pixels a side of the blocks of which the products of `structure` are made: the sampler arranges the errors within
# blocks of 4 x 4 pixels, which therefore depend on each other.
ARRANGED = 4
LEAST_P = 1e-300
TAIL = 3.18  # c above: 1 / (4 P(N >= sqrt(2))), rounded up


@dataclass(frozen=True)
class Level:
    """Corrected p-values of all regions of one size, (rows, columns); a region has `side` x `side` pixels."""

    side: int
    p: Array


@dataclass
class Decision:
    """The result of one look at the evidence. `levels` go from the smallest regions to the whole picture."""

    p_value: float = 1.0
    levels: list[Level] = field(default_factory=list)


def decide(evidence: Evidence, looks: int = 1) -> Decision:
    """The p-values, corrected for every pixel, region, channel and way, and for that many looks."""
    found = [*_samples(evidence), *_groups(evidence), *_structure(evidence)]
    levels: dict[int, Array] = {}
    for side, log_p in found:
        cases = log_p.size * len(found) * looks
        corrected = np.exp(np.clip(log_p.min(axis=2) + np.log(cases), np.log(LEAST_P), 0.0))
        levels[side] = np.minimum(levels[side], corrected) if side in levels else corrected
    ordered = [Level(side, levels[side]) for side in sorted(levels)]
    return Decision(min((float(level.p.min()) for level in ordered), default=1.0), ordered)


def sides(shape: tuple[int, int]) -> list[int]:
    """1, 2, 4 ... up to the first that holds the whole picture."""
    out = [1]
    while out[-1] < max(shape):
        out.append(2 * out[-1])
    return out


Found = tuple[int, Array]  # side of the regions; logarithms of p-values, (rows, columns, channels)


def _samples(evidence: Evidence) -> Iterator[Found]:
    samples = min(evidence.a.samples, evidence.b.samples)
    difference, rounding, brightness = evidence.difference, evidence.rounding, evidence.brightness
    # The sum over the samples of their squared differences, divided by the square of their number.
    squares = evidence.variance + difference**2 / samples
    regions = list[_Regions]()
    for side in sides(evidence.shape):
        if side > 1:
            difference, rounding, squares = blocks(difference), blocks(rounding), blocks(squares)
            brightness = blocks(brightness)
        if samples * side**2 >= ENOUGH or side >= max(evidence.shape):
            regions.append(_Regions(side, difference, rounding, squares, brightness))
    yield from _tested(regions)


def _groups(evidence: Evidence) -> Iterator[Found]:
    squares, groups = evidence.squares, evidence.groups
    difference, rounding = evidence.difference * groups, evidence.rounding * groups
    brightness, regions = evidence.brightness, list[_Regions]()
    # Else the signs do not balance, so that the variance that the samples tell counts, too.
    even = evidence.alike and evidence.a.samples == evidence.b.samples
    least = np.zeros_like(difference) if even else evidence.variance * groups**2
    for level, side in enumerate(sides(evidence.shape)):
        if level > 0:
            difference, rounding, brightness = blocks(difference), blocks(rounding), blocks(brightness)
            least = blocks(least)
        unit = _unit(evidence.shape, side, groups)
        if unit is not None:
            summed = np.maximum(blocks(squares[unit], side >> unit), least)
            regions.append(_Regions(side, difference, rounding, summed, brightness))
    yield from _tested(regions)


@dataclass(frozen=True)
class _Regions:
    """All regions of one size, (rows, columns, channels) each."""

    side: int
    sums: Array
    rounding: Array
    squares: Array
    brightness: Array


def _tested(regions: list[_Regions]) -> Iterator[Found]:
    """The squares of a region are at least its share, by brightness, of those of each larger region. Two estimators
    of the same light have noise of different kinds: where one of them happened to find no light, nothing there would
    tell that some is missing. The variance of light that is seldom found goes with its mean, by Poisson's law."""
    least, above = np.zeros((1, 1, 1)), regions[-1].side if regions else 1  # squares by brightness, of larger regions
    for each in reversed(regions):
        ratio = _ratio(each.squares, each.brightness)
        least, above = np.maximum(ratio, _spread(least, above // each.side, ratio.shape)), each.side
        yield each.side, _two_sided(each.sums, each.rounding, np.maximum(each.squares, least * each.brightness))


def _spread(values: Array, times: int, shape: tuple[int, ...]) -> Array:
    return np.asarray(np.repeat(np.repeat(values, times, axis=0), times, axis=1)[: shape[0], : shape[1]])


def _structure(evidence: Evidence) -> Iterator[Found]:
    halves = evidence.halves
    if halves is None or not evidence.alike:
        return
    even, odd = halves
    by_rounding = (evidence.rounding * evidence.a.samples / 2) ** 2
    products = even * odd
    whole = sides(evidence.shape)[-1]
    for side in sides(evidence.shape):
        unit = _unit(evidence.shape, side, 1)
        if unit is None or (2**unit < ARRANGED and side < whole):
            continue
        units = blocks(products, 2**unit)
        total = blocks(units, side >> unit)
        excess = np.maximum(total - blocks(by_rounding, side), 0.0)
        yield side, _log_tail(_ratio(excess**2, blocks(units**2, side >> unit)))


def _unit(shape: tuple[int, int], side: int, groups: int) -> int | None:
    """The logarithm of the side of the largest blocks of which there are ENOUGH in a region; None where there are too
    few pixels. Larger ones gain what the sampler gains between neighbours."""
    height, width = min(side, shape[0]), min(side, shape[1])
    for unit in range(side.bit_length() - 1, -1, -1):
        if groups * -(-height >> unit) * -(-width >> unit) >= ENOUGH:
            return unit
    return None


def _two_sided(sums: Array, rounding: Array, squares: Array) -> Array:
    """Logarithms of p-values, at most 0."""
    excess = np.maximum(np.abs(sums) - rounding, 0.0)
    return np.asarray(np.minimum(np.log(2.0) + _log_tail(_ratio(excess**2, squares)), 0.0))


def _log_tail(squared: Array) -> Array:
    """The logarithm of the lower one of the two bounds for one side, of t squared. The normal tail is bounded as
    Sampford (1953) does, 4 / (3 t + sqrt(t^2 + 8)) times the density, which is 0.3 % above it at t = 2."""
    normal = np.log(4 * TAIL / np.sqrt(2 * np.pi) / (3 * np.sqrt(squared) + np.sqrt(squared + 8)))
    return np.asarray(np.minimum(normal, 0.0) - 0.5 * squared)


def _ratio(above: Array, below: Array) -> Array:
    """0 where both are 0."""
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0)
