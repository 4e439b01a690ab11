"""Two sides become a verdict: groups of samples are taken while it is undecided, up to what their settings allow. And
which samples these are, and how far comparisons are while they are made.
"""

from __future__ import annotations

import asyncio
import hashlib
import math
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import count
from typing import Any

import numpy as np

from service.colorimetry import LUMINANCE
from service.document.quality import ResolvedSettings
from service.server.verdict.decision import Decision, decide
from service.server.verdict.evidence import Array, Estimate, Evidence, Sum
from service.server.verdict.figures import Differing, Figures, differing, figures
from service.server.verdict.regions import Region, drawn, p_map, regions
from service.system.executors import comparing
from service.views import MapKind

# How light is found: estimator, sampler, and the depth from which paths may end.
Ways = tuple[str, str, int]


def ways_of(settings: ResolvedSettings) -> Ways:
    return settings.estimator, settings.sampler, settings.roulette_depth


@dataclass(frozen=True)
class Still:
    """A picture that is there, and gets no more samples."""

    estimate: Estimate
    seed: int
    ways: Ways

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        height, width = self.estimate.mean.shape[:2]
        return width, height


@dataclass(frozen=True)
class Taken:
    """Samples that were taken, and the seconds that this took."""

    estimate: Estimate
    elapsed_s: float


@dataclass(frozen=True)
class SampleSource:
    """A document, of which samples can be taken: `render(settings)`. Raises what rendering raises."""

    settings: ResolvedSettings
    render: Callable[[ResolvedSettings], Awaitable[Taken]]

    @property
    def size(self) -> tuple[int, int]:
        return self.settings.render_width, self.settings.render_height

    @property
    def ways(self) -> Ways:
        return ways_of(self.settings)

    @property
    def samples(self) -> int:
        return self.settings.max_samples or USUAL_SAMPLES


Side = Still | SampleSource
# Called with the samples of each pixel that are taken, and those that may be taken at most.
OnProgress = Callable[[int, int], None]


@dataclass(frozen=True)
class Verdict:
    different: bool
    p_value: float
    figures: Figures
    differing: Differing
    regions: list[Region]
    samples: tuple[int, int]  # of a and b
    p: Array  # a `p_map`
    a: Array  # mean radiance
    b: Array
    alpha: float

    def document(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "different": self.different,
            "p_value": self.p_value,
            **asdict(self.figures),
            "differing": asdict(self.differing),
            "samples": {"a": self.samples[0], "b": self.samples[1]},
            "regions": [asdict(region) for region in self.regions],
        }

    def picture(self, kind: MapKind) -> np.ndarray:
        """(height, width, 3) bytes."""
        return drawn(kind, self.a, self.b, self.p, self.alpha)


async def compare(a: Side, b: Side, confidence: float, on_progress: OnProgress = lambda taken, most: None) -> Verdict:
    """The verdict on two sides of the same size. Cancelled, it ends what it renders."""
    alpha = 1.0 - confidence
    if isinstance(a, SampleSource) and isinstance(b, SampleSource):
        evidence, decision = await _of_two_documents(a, b, alpha, on_progress)
    elif isinstance(a, SampleSource) and isinstance(b, Still):
        evidence, decision = await _of_one_document(a, b, "a", alpha, on_progress)
    elif isinstance(a, Still) and isinstance(b, SampleSource):
        evidence, decision = await _of_one_document(b, a, "b", alpha, on_progress)
    else:
        assert isinstance(a, Still) and isinstance(b, Still)
        evidence = await comparing(partial(Evidence, a.estimate, b.estimate, a.ways == b.ways))
        decision = await comparing(partial(decide, evidence))
    return await comparing(partial(_verdict, evidence, decision, alpha))


def same(source: SampleSource, confidence: float) -> Verdict:
    """The verdict on a document and itself, of which nothing is rendered."""
    width, height = source.size
    nothing = np.zeros((height, width, 3))
    equal = Figures(mean_difference=0.0, rmse=0.0, psnr=None, flip=0.0, ssim=1.0)
    return Verdict(
        False,
        1.0,
        equal,
        Differing(0.0, 0.0),
        [],
        (0, 0),
        np.ones((height, width)),
        nothing,
        nothing,
        1.0 - confidence,
    )


class _Limits:
    """The limits of a comparison beside its samples: the settings' time and noise."""

    def __init__(self, *sources: SampleSource) -> None:
        limits = [each.settings.time_limit for each in sources]
        self._left_s = min((limit for limit in limits if limit is not None), default=math.inf)
        self._noises = [each.settings.target_noise for each in sources]

    def settings(self, settings: ResolvedSettings, seed: int, samples: int) -> ResolvedSettings:
        """Those of a group of samples. The verdict is on what was rendered, whatever a denoiser would make of it; and
        every pixel gets as many samples, as those of adaptive sampling depend on what they found."""
        left = None if math.isinf(self._left_s) else max(self._left_s, 0.001)
        return replace(
            settings, seed=seed, max_samples=samples, time_limit=left, target_noise=None, adaptive=False,
            denoise=False,
        )  # fmt: skip

    def spend(self, seconds: float) -> None:
        self._left_s -= seconds

    def reached(self, *sums: Sum) -> bool:
        quiet = all(
            noise is not None and _noise(each) <= noise for noise, each in zip(self._noises, sums, strict=True)
        )
        return self._left_s <= 0 or quiet


async def _of_two_documents(
    a: SampleSource, b: SampleSource, alpha: float, on_progress: OnProgress
) -> tuple[Evidence, Decision]:
    schedule, limits = of_two_documents(min(a.samples, b.samples), a.settings.seed), _Limits(a, b)
    evidence, best = None, Decision()
    for done, group in enumerate(schedule.groups):
        on_progress(*schedule.share(done))
        settings = (limits.settings(each.settings, group.seed, group.samples) for each in (a, b))
        first, second = await _together(*(each.render(given) for each, given in zip((a, b), settings, strict=True)))
        limits.spend(max(first.elapsed_s, second.elapsed_s))
        if evidence is None:
            evidence = await comparing(partial(Evidence, first.estimate, second.estimate, a.ways == b.ways))
        else:
            await comparing(partial(evidence.add, first.estimate, second.estimate))
        ends = limits.reached(evidence.a, evidence.b)
        if group.look or ends:
            best = await _looked(evidence, schedule, best)
            if best.p_value < alpha or ends:
                break
    assert evidence is not None
    return evidence, best


async def _of_one_document(
    source: SampleSource, still: Still, side: str, alpha: float, on_progress: OnProgress
) -> tuple[Evidence, Decision]:
    known = still.estimate.samples
    schedule, limits = of_one_document(source.samples, known, still.seed), _Limits(source)
    evidence, best = None, Decision()
    for done, group in enumerate(schedule.groups):
        on_progress(*schedule.share(done))
        taken = await source.render(limits.settings(source.settings, group.seed, group.samples))
        limits.spend(taken.elapsed_s)
        if evidence is None:
            pair = (taken.estimate, still.estimate) if side == "a" else (still.estimate, taken.estimate)
            evidence = await comparing(partial(Evidence, *pair, source.ways == still.ways))
        else:
            await comparing(partial(evidence.add_to, side, taken.estimate))
        best = await _looked(evidence, schedule, best)
        if best.p_value < alpha or limits.reached(evidence.a if side == "a" else evidence.b):
            break
    assert evidence is not None
    return evidence, best


async def _looked(evidence: Evidence, schedule: Schedule, best: Decision) -> Decision:
    """The better of the earlier looks and one more."""
    found = await comparing(partial(decide, evidence, schedule.looks))
    return found if found.p_value <= best.p_value else best


async def _together(*renders: Awaitable[Taken]) -> list[Taken]:
    """The results of all; if one fails or this is cancelled, the others are cancelled."""
    tasks = [asyncio.ensure_future(each) for each in renders]
    try:
        return await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _noise(side: Sum) -> float:
    """The root of the mean variance of a pixel's luminance over the mean luminance, as the renderer's meter says
    it; infinite where one sample does not tell."""
    mean, variance = float((side.mean @ LUMINANCE).mean()), float((side.variance @ LUMINANCE**2).mean())
    if side.samples < 2:
        return math.inf
    return math.sqrt(variance) / mean if mean > 0 else 0.0


def _verdict(evidence: Evidence, decision: Decision, alpha: float) -> Verdict:
    a, b = evidence.a.mean, evidence.b.mean
    different = decision.p_value < alpha
    p = p_map(decision.levels, evidence.shape, alpha)
    return Verdict(
        different, decision.p_value, figures(a, b), differing(a, b, p, alpha), regions(p, alpha) if different else [],
        (evidence.a.samples, evidence.b.samples), p, a, b, alpha,
    )  # fmt: skip


USUAL_SAMPLES = 256  # of each side whose settings have no `max_samples` but a time or a noise: as many as balanced's
# Groups of so many samples at the least, up to MOST_GROUPS: many groups tell where single pixels differ, long ones
# gain more from a low-discrepancy sampler.
SAMPLES_OF_A_GROUP, MOST_GROUPS = 4, 16


@dataclass(frozen=True)
class Group:
    seed: int
    samples: int
    look: bool  # whether the evidence is looked at after it


@dataclass(frozen=True)
class Schedule:
    groups: list[Group]

    @property
    def looks(self) -> int:
        return sum(group.look for group in self.groups)

    def share(self, done: int) -> tuple[int, int]:
        """The samples of so many groups, and those of all."""
        samples = [group.samples for group in self.groups]
        return sum(samples[:done]), sum(samples)


def of_two_documents(samples: int, seed: int) -> Schedule:
    """Equal groups for both sides, each with a seed of its own; looked at after 1, 2, 4 ... groups."""
    groups = 1
    while groups < MOST_GROUPS and samples >= 2 * groups * SAMPLES_OF_A_GROUP:
        groups *= 2
    seeds = seeds_from(seed)
    return Schedule([Group(next(seeds), samples // groups, _is_power_of_two(k + 1)) for k in range(groups)])


def of_one_document(samples: int, known: int, seed: int) -> Schedule:
    """Groups for the one side that is a document, the other one being a picture of `known` samples with that seed:
    first as many as the picture has, and as it has them, so that equal documents give equal bits; then twice as many
    in all, and so on."""
    seeds = seeds_from(seed)
    groups, total = [Group(next(seeds), min(known, samples), True)], min(known, samples)
    while total < samples:
        more = min(total, samples - total)
        groups.append(Group(next(seeds), more, True))
        total += more
    return Schedule(groups)


def seeds_from(seed: int) -> Iterator[int]:
    """The seed itself, and then others that are as good as independent; none twice."""
    given = set[int]()
    for k in count():
        text = f"{seed} {k}".encode()
        each = seed if k == 0 else int.from_bytes(hashlib.sha256(text).digest()[:4], "little")
        if each not in given:
            given.add(each)
            yield each


def _is_power_of_two(number: int) -> bool:
    return number & (number - 1) == 0


class UnderWay:
    """The comparisons that are made, by owner and by the name that each was given. For the event loop alone."""

    def __init__(self) -> None:
        self._samples: dict[tuple[str, str], tuple[int, int]] = {}

    @contextmanager
    def following(self, owner: str, name: str | None) -> Iterator[OnProgress]:
        """A function that a comparison calls as it goes on. Without a name nobody asks; of two with one the later
        counts."""
        key = (owner, name or "")

        def note(taken: int, most: int) -> None:
            if name is not None:
                self._samples[key] = taken, most

        try:
            yield note
        finally:
            self._samples.pop(key, None)

    def samples(self, owner: str, name: str) -> tuple[int, int] | None:
        """Those of each pixel that are taken, and those that may be taken at most; None where none is under way."""
        return self._samples.get((owner, name))
