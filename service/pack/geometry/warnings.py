"""Warnings about the shapes of a scene: the same one about many shapes is a single line with a count."""

from __future__ import annotations

import re
from collections.abc import Iterable

NUMBER = re.compile(r"\d+")


def counted(found: Iterable[tuple[int, str]]) -> tuple[str, ...]:
    """A line for each kind of warning, from pairs of a shape's number and a text; numbers make no kind."""
    kinds: dict[str, list[tuple[int, str]]] = {}
    for shape, text in found:
        kinds.setdefault(NUMBER.sub("#", text), []).append((shape, text))
    return tuple(map(_line, kinds.values()))


def _line(alike: list[tuple[int, str]]) -> str:
    (shape, text), more = alike[0], len({shape for shape, _ in alike}) - 1
    if not more:
        return f"/shapes/{shape}: {text}"
    shapes = "1 more shape" if more == 1 else f"{more} more shapes"
    others = "here and" if len({text for _, text in alike}) == 1 else "with other counts also"
    return f"/shapes/{shape}: {text} ({others} in {shapes})"
