"""Statements `mtllib` -> the material libraries that they name."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeVar

from service.formats.read.references import Finder, Found

T = TypeVar("T")
AFTER_NAME = re.compile(r"(?<=\.mtl)\s+", re.IGNORECASE)
COMMENT = re.compile(r"\s+#(?:\s.*)?$")


def without_comment(name: str) -> str:
    """A name without what looks like a comment after it: `#` between blanks, which `Material #25` has not."""
    return COMMENT.sub("", name)


def named_libraries(model: str, statement: str, finder: Finder) -> list[tuple[str, Found | None]]:
    """The libraries that the model names after `mtllib`."""
    return readings(statement, lambda name: finder.find(model, name))


def readings(statement: str, find: Callable[[str], T | None]) -> list[tuple[str, T | None]]:
    """What `find` knows of the names after `mtllib`: of one, which may contain blanks, or else of several, each up to
    its `.mtl`, or else of the words."""
    plain = without_comment(statement)
    for name in dict.fromkeys((statement, plain)) if plain.split() else ():
        if (whole := find(name)) is not None:
            return [(name, whole)]
    found: list[tuple[str, T | None]] = []
    for name in AFTER_NAME.split(plain.strip()):
        whole = find(name) if name else None
        found += [(name, whole)] if whole is not None else [(word, find(word)) for word in name.split()]
    return found
