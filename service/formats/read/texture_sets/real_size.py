"""How large what a texture set shows is in the world: as its files' names say, or a note that comes with them."""

from __future__ import annotations

import json
import posixpath
import re
from collections.abc import Iterable
from typing import Any

from service.formats.read.archive import Archive

Size = tuple[float, float]  # width and height in metres
NUMBER = r"(\d{1,4}(?:\.\d{1,4})?)"
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
# In names with its unit, as in plaster_200x200cm_albedo: 2x2 alone may as well be a count of tiles.
NAMED = re.compile(rf"(?<![\d.]){NUMBER}\s?x\s?{NUMBER}\s?(mm|cm|m)(?![a-z])", re.IGNORECASE)
# In notes of Quixel's, where metres are meant.
NOTED = re.compile(rf"\s*{NUMBER}\s*x\s*{NUMBER}\s*(mm|cm|m|)\s*", re.IGNORECASE)
MEMBERS = ("physicalSize", "scanArea")
MOST_BYTES = 1 << 20  # of a note
LEAST, MOST = 1e-3, 1e4  # metres


def by_names(paths: Iterable[str]) -> Size | None:
    """The size that the names of a set's images agree upon."""
    found = {_metres(match) for path in paths if (match := NAMED.search(posixpath.basename(path)))}
    return found.pop() if len(found) == 1 else None


def by_note(archive: Archive) -> tuple[str, Size] | None:
    """The note (JSON) in an archive that tells the size, and what it tells; None where there is none, or several."""
    found = []
    for name in archive.names:
        if name.lower().endswith(".json") and archive.size(name) <= MOST_BYTES:
            size = _noted_size(archive.read(name))
            if size is not None:
                found.append((name, size))
    return found[0] if len(found) == 1 else None


def _noted_size(data: bytes) -> Size | None:
    try:
        note = json.loads(data)
    except (ValueError, RecursionError):
        return None
    if not isinstance(note, dict):
        return None
    listed = note.get("meta")
    entries = [each for each in listed if isinstance(each, dict)] if isinstance(listed, list) else []
    values: list[Any] = [note.get(member) for member in MEMBERS]
    values += [each.get("value") for each in entries if each.get("key") in MEMBERS]
    matches = (NOTED.fullmatch(value) for value in values if isinstance(value, str))
    return next((size for match in matches if match and (size := _metres(match))), None)


def _metres(match: re.Match[str]) -> Size | None:
    width, height = (float(match[k]) * METRES[match[3].lower() or "m"] for k in (1, 2))
    return (width, height) if all(LEAST <= side <= MOST for side in (width, height)) else None
