"""The disk space of an asset folder, updated with each change instead of counted again.

The totals are in a file beside the folder, for all processes that use it. The file is marked while a change is under
way: after a crash in the middle of one, the next reader finds no totals and counts.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from service.system.disk_usage import Usage, usage

TOTALS = struct.Struct("<4sIqq")  # MAGIC, whether a change is under way, bytes, files
MAGIC = b"SBX1"


class FolderTotals:
    """All methods but `read` need the folder's lock."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self) -> Usage | None:
        """The totals; None where nothing was counted yet, or a change is under way."""
        try:
            magic, changing, size, files = TOTALS.unpack(self._path.read_bytes())
        except (OSError, struct.error):
            return None
        return Usage(size, files) if magic == MAGIC and not changing else None

    def write(self, total: Usage | None) -> None:
        """Store the totals; None marks them as unknown, as does a failure of the disk."""
        known = total or Usage()
        try:
            file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
            try:
                os.pwrite(file, TOTALS.pack(MAGIC, total is None, known.bytes, known.files), 0)
            finally:
                os.close(file)
        except OSError:
            with suppress(OSError):
                self._path.unlink()

    @contextmanager
    def change(self) -> Iterator[Change]:
        """A context in which files are added and removed. The totals stay unknown where it raises."""
        before = self.read()
        change = Change()
        self.write(None)
        yield change
        if before is not None:
            self.write(before + change.difference)


class Change:
    """Sums the changes of the totals by files that are added and removed."""

    def __init__(self) -> None:
        self.difference = Usage()

    def added(self, path: Path) -> None:
        """Count a file that was added. Raises FileNotFoundError."""
        self.difference += usage(path.lstat())

    def replaces(self, path: Path) -> None:
        """Subtract the file of this name, if it exists: it is about to be replaced or deleted."""
        with suppress(FileNotFoundError):
            self.difference -= usage(path.lstat())

    def remove(self, path: Path) -> None:
        """Delete a file, if it exists."""
        self.replaces(path)
        path.unlink(missing_ok=True)
