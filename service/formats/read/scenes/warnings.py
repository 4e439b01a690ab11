"""Warnings about features of a file that are not supported, with their places; none is dropped in silence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from service.formats.errors import NoTriangles, ParseError

MOST = 200  # different warnings, as an untrusted file may cause any number
LONGEST = 300  # characters of a pointer or a detail
MOST_NAMED = 20  # places of one warning


@dataclass
class Warnings:
    """Details in the order in which they were found, each with its first place and the number of its places.

    Places that are names of files are named, too, where `names_files` is true.
    """

    names_files: bool = False
    _places: dict[str, set[str]] = field(default_factory=dict)  # by detail
    _first: dict[str, str] = field(default_factory=dict)
    _unlisted: int = 0
    _omissions: dict[str, None] = field(default_factory=dict)  # details that say why triangles are missing

    def add(self, pointer: str, detail: str) -> None:
        pointer, detail = pointer[:LONGEST], detail[:LONGEST]
        if detail in self._first:
            self._places[detail].add(pointer)
        elif len(self._first) < MOST:
            self._first[detail], self._places[detail] = pointer, {pointer}
        else:
            self._unlisted += 1

    def take(self, others: Warnings) -> None:
        """Add all of others."""
        for detail, places in others._places.items():
            for pointer in [others._first[detail], *sorted(places)]:
                self.add(pointer, detail)
        self._unlisted += others._unlisted
        self._omissions |= others._omissions

    def leave_out(self, pointer: str, detail: str) -> None:
        """Add a warning that says why something is not in the picture."""
        self.add(pointer, detail)
        self._omissions[detail[:LONGEST]] = None

    def has(self, beginning: str) -> bool:
        """True where a detail begins so."""
        return any(detail.startswith(beginning) for detail in self._first)

    def nothing_left(self) -> ParseError:
        """The refusal of a file that has nothing to show, with the reasons."""
        found = [note for note in self.document() if note["detail"].startswith(tuple(self._omissions))]
        if not self._omissions or not found:
            return NoTriangles("the scene has no triangles: none of its nodes has a mesh")
        reasons = "; ".join(note["detail"] for note in found[:3])
        return ParseError(f"the scene has no triangles: {reasons}", found[0]["pointer"])

    def document(self) -> list[dict[str, Any]]:
        """`[{pointer, detail, count}]`; without `count` where the pointer is the only place."""
        listed: list[dict[str, Any]] = []
        for detail, pointer in self._first.items():
            count = len(self._places[detail])
            more = self._elsewhere(detail) if count > 1 else ""
            listed.append({"pointer": pointer, "detail": detail + more} | ({"count": count} if count > 1 else {}))
        if self._unlisted:
            listed.append({"pointer": "", "detail": f"there are {self._unlisted} more warnings"})
        return listed

    def _elsewhere(self, detail: str) -> str:
        others = sorted(self._places[detail] - {self._first[detail]})
        if not self.names_files:
            return f" (here and in {len(others)} more place{'s' if len(others) > 1 else ''})"
        unnamed = len(others) - MOST_NAMED + 1
        return f" (also {', '.join(others[: MOST_NAMED - 1])}{f' and {unnamed} more' if unnamed > 0 else ''})"
