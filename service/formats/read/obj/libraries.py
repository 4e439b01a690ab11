"""Statements `mtllib` -> the material libraries that they name."""

from __future__ import annotations

from service.formats.read.references import Finder, Found


def named_libraries(model: str, statement: str, finder: Finder) -> list[tuple[str, Found | None]]:
    """The libraries that the model names after `mtllib`: one, whose name may contain blanks, or else several."""
    words = statement.split()
    whole = finder.find(model, statement) if words else None
    names = words if whole is None else [statement]
    return [(name, whole or finder.find(model, name)) for name in names]
