"""Losses of an export: what a format has no place for, each with the field that it is about, in plain words."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

HEADER_BYTES = 4096  # proxies refuse headers that are much longer
LONGEST = 300  # characters of a detail


@dataclass
class Losses:
    _found: dict[tuple[str, str], None] = field(default_factory=dict)  # (pointer, detail), in order, each once

    def add(self, pointer: str, detail: str) -> None:
        """`pointer` (RFC 6901) is from the document's root."""
        self._found[pointer, detail[:LONGEST]] = None

    def __len__(self) -> int:
        return len(self._found)

    def __iter__(self) -> Iterator[tuple[str, str]]:
        return iter(self._found)

    def document(self, root: str = "", within: str = "") -> list[dict[str, Any]]:
        """`[{pointer, detail}]`, seen from a body in which the document stands at `root`; `within` is a pointer to
        the only part of the document that the body has."""
        return [{"pointer": root + pointer.removeprefix(within), "detail": why} for pointer, why in self._found]

    def header(self, root: str = "", within: str = "") -> str:
        """The JSON of `document`, short enough for a header: where it is too long equal details are told once, with
        their `count`, and then the last ones are left out."""
        listed = self.document(root, within)
        if len(text := json.dumps(listed)) <= HEADER_BYTES:
            return text
        by_detail: dict[str, dict[str, Any]] = {}
        for loss in listed:
            first = by_detail.setdefault(loss["detail"], {**loss, "count": 0})
            first["count"] += 1
        listed = list(by_detail.values())
        left_out = 0
        while True:
            more = [{"pointer": root, "detail": f"and {left_out} more"}] if left_out else []
            if len(text := json.dumps([*listed, *more])) <= HEADER_BYTES or not listed:
                return text
            left_out += 1
            listed.pop()
