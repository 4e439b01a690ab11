"""Names for materials and textures."""

from __future__ import annotations

from collections.abc import Container

LONGEST = 80  # characters


def unique(base: str, taken: Container[str]) -> str:
    """A name not yet taken: the base, or the base and a number."""
    base = base[:LONGEST]
    name, k = base, 2
    while name in taken:
        name, k = f"{base} {k}", k + 1
    return name
