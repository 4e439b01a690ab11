"""The list of faults in `faults.toml`, which says what its members are."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOMS = ("shaders", "gpu", "pack", "formats", "renders", "storage", "http", "streams", "client", "web")
LIST = Path(__file__).with_name("faults.toml")


@dataclass(frozen=True)
class Fault:
    room: str  # one of ROOMS
    name: str
    file: str
    old: str
    new: str
    harm: str
    near: tuple[str, ...]

    def patched(self, text: str) -> str:
        """The file's text with the fault. Raises ValueError where its place does not occur exactly once."""
        if (count := text.count(self.old)) != 1:
            raise ValueError(f"{self.name}: {self.old!r} occurs {count} times in {self.file}")
        return text.replace(self.old, self.new)


def faults() -> list[Fault]:
    """All faults, in the list's order. Raises TypeError where a member is missing or unknown."""
    rooms = tomllib.loads(LIST.read_text())
    return [Fault(room, **{**row, "near": tuple(row["near"])}) for room, rows in rooms.items() for row in rows]
