"""Warnings about features of a file that are not supported, with their places; none is dropped in silence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from service.formats.errors import ParseError

MOST = 200  # different warnings, as an untrusted file may cause any number
LONGEST = 300  # characters of a pointer or a detail


@dataclass
class Warnings:
    """Details in the order in which they were found, each with its first place and the number of its places; or
    `by_place`, each with every one."""

    by_place: bool = False
    _places: dict[str, dict[str, None]] = field(default_factory=dict)  # by detail
    _first: dict[str, str] = field(default_factory=dict)
    _unlisted: int = 0
    _omissions: dict[str, None] = field(default_factory=dict)  # details that say why triangles are missing

    def add(self, pointer: str, detail: str) -> None:
        pointer, detail = pointer[:LONGEST], detail[:LONGEST]
        if detail in self._first:
            self._places[detail][pointer] = None
        elif len(self._first) < MOST:
            self._first[detail], self._places[detail] = pointer, {pointer: None}
        else:
            self._unlisted += 1

    def leave_out(self, pointer: str, detail: str) -> None:
        """Add a warning that says why something is not in the picture."""
        self.add(pointer, detail)
        self._omissions[detail[:LONGEST]] = None

    def nothing_left(self) -> ParseError:
        """The refusal of a file that has nothing to show, with the reasons."""
        found = [note for note in self.document() if note["detail"].startswith(tuple(self._omissions))]
        if not self._omissions or not found:
            return ParseError("the scene has no triangles: none of its nodes has a mesh")
        reasons = "; ".join(note["detail"] for note in found[:3])
        return ParseError(f"the scene has no triangles: {reasons}", found[0]["pointer"])

    def document(self) -> list[dict[str, Any]]:
        """`[{pointer, detail, count}]`; without `count` where the pointer is the only place."""
        listed: list[dict[str, Any]] = []
        for detail, pointer in self._first.items():
            if self.by_place:
                listed += [{"pointer": place, "detail": detail} for place in self._places[detail]]
                continue
            count = len(self._places[detail])
            more = f" (here and in {count - 1} more place{'s' if count > 2 else ''})" if count > 1 else ""
            listed.append({"pointer": pointer, "detail": detail + more} | ({"count": count} if count > 1 else {}))
        unlisted = self._unlisted + max(len(listed) - MOST, 0)
        if unlisted:
            listed = [*listed[:MOST], {"pointer": "", "detail": f"there are {unlisted} more warnings"}]
        return listed
