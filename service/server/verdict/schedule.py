"""Which samples are taken for a verdict: groups of samples, and after which of them the evidence is looked at."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

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
