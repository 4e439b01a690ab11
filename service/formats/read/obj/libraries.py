"""Statements `mtllib` -> the material libraries that they name."""

from __future__ import annotations

import re

from service.formats.read.references import Finder, Found

COMMENT = re.compile(r"\s+#(?:\s.*)?$")


def without_comment(name: str) -> str:
    """A name without what looks like a comment after it: `#` between blanks, which `Material #25` has not."""
    return COMMENT.sub("", name)


def named_libraries(model: str, statement: str, finder: Finder) -> list[tuple[str, Found | None]]:
    """The libraries that the model names after `mtllib`: one, whose name may contain blanks, or else several."""
    plain = without_comment(statement)
    words = plain.split()
    for name in dict.fromkeys((statement, plain)) if words else ():
        if (whole := finder.find(model, name)) is not None:
            return [(name, whole)]
    return [(name, finder.find(model, name)) for name in words]
