"""The loops of disassembled code, and where samples of it fell."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

_LINE = re.compile(r"^\s*([0-9a-f]+):\s+(?:[0-9a-f]{2} )+\s*(\S.*)$")
_JUMP = re.compile(r"^j\w+\s+(?:0x)?([0-9a-f]+)\b")
LEAST = 0.01  # of all samples; a loop with a smaller share counts to the one around it

Instruction = tuple[int, str]  # address, text


@dataclass
class Loop:
    """A loop without the loops in it. `depth` is 0 for one that is in no other; `share` of all samples."""

    first: int
    last: int
    depth: int = 0
    share: float = 0.0
    instructions: int = 0
    wide: int = 0  # of these, for all 8 lanes
    gathers: int = 0
    stack: int = 0  # of these, with an operand on the stack
    inner: list[Loop] = field(default_factory=list)


def instructions(text: str) -> list[Instruction]:
    """Of the output of `objdump -D`."""
    found = []
    for line in text.splitlines():
        if match := _LINE.match(line):
            found.append((int(match[1], 16), match[2].split("#")[0].strip()))
    return found


def loops(code: list[Instruction], samples: Mapping[int, int]) -> list[Loop]:
    """The loops in the order of the code, outer before inner. A jump backwards ends one; jumps back to the same place
    are of one loop. Loops that overlap without one being in the other are compiled as one."""
    ends: dict[int, int] = {}
    for at, text in code:
        match = _JUMP.match(text)
        if match and (to := int(match[1], 16)) <= at:
            ends[to] = max(at, ends.get(to, at))
    total = sum(samples.values()) or 1
    every = _linked([Loop(first, last) for first, last in _nested(ends)])
    kept = _linked([loop for loop in every if _share(loop, samples, total) >= LEAST])
    for loop in kept:
        own = [text for at, text in code if _owns(loop, at)]
        loop.share = _share(loop, samples, total)
        loop.instructions = len(own)
        loop.wide = sum("%ymm" in text for text in own)
        loop.gathers = sum("gather" in text for text in own)
        loop.stack = sum("(%rsp" in text or "(%rbp" in text for text in own)
    return kept


def _linked(made: list[Loop]) -> list[Loop]:
    """The loops, each with its depth and the loops in it."""
    for loop in made:
        loop.inner = [other for other in made if other is not loop and loop.first <= other.first <= loop.last]
        loop.depth = sum(other.first <= loop.first and loop.last <= other.last for other in made) - 1
    return made


def _nested(ends: dict[int, int]) -> list[tuple[int, int]]:
    """Ranges of which each two are apart or one in the other."""
    found: list[tuple[int, int]] = []
    for first, last in sorted(ends.items(), key=lambda item: (item[0], -item[1])):
        for i, (start, end) in enumerate(found):
            if start < first <= end < last:
                found[i] = (start, last)
        found.append((first, last))
    return found


def _share(loop: Loop, samples: Mapping[int, int], total: int) -> float:
    return sum(n for at, n in samples.items() if _owns(loop, at)) / total


def _owns(loop: Loop, at: int) -> bool:
    return loop.first <= at <= loop.last and not any(i.first <= at <= i.last for i in loop.inner)
