"""Pictures of renders that the database does not know: they wait in `renders/lost` for a database that does.

    ID.picture, ID.checkpoint   as they lay in `renders`; a start that knows the render moves them back
    ID.checkpoint.damaged       one that could not be read
    KEEP.txt                    while it is there, nothing makes room here

They count towards the quota, and make room before anything else does, the oldest first. Where a start finds many of
them, the database is probably not the one that they belong to: it leaves KEEP.txt then.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Container
from contextlib import suppress
from pathlib import Path

from service.system.disk_usage import Usage, usage

log = logging.getLogger(__name__)

FOLDER, KEEP, DAMAGED = "lost", "KEEP.txt", ".damaged"
WHY = """These are pictures of renders that Sunbox did not find in its database (documents.sqlite3) at a start.
As they were many, the database may be the wrong one: put the right one back while the server is stopped,
and the next start moves them to where they were. Nothing in this folder is deleted while this file is here.
If nobody needs the pictures, delete the folder.
"""


class LostPictures:
    """For any number of threads and processes. Methods raise OSError where the disk fails."""

    def __init__(self, renders: Path) -> None:
        self._renders = renders
        self.path = renders / FOLDER
        self._counted: tuple[int, Usage] | None = None  # and when the folder was changed before

    def usage(self) -> Usage:
        """Usage of the whole folder. It is counted again when a name came or went: files here do not change."""
        try:
            changed = self.path.stat().st_mtime_ns
        except FileNotFoundError:
            return Usage()
        if self._counted is None or self._counted[0] != changed:
            self._counted = changed, sum((usage(found) for _, found in self._files()), Usage())
        return self._counted[1]

    def spare(self) -> dict[str, Usage]:
        """The files that may be deleted where room is needed, the oldest first."""
        if (self.path / KEEP).exists():
            return {}
        return {name: usage(found) for name, found in sorted(self._files(), key=lambda each: each[1].st_mtime_ns)}

    def delete(self, name: str) -> None:
        (self.path / name).unlink(missing_ok=True)

    def put(self, name: str, damaged: bool = False) -> None:
        """Move a file of `renders` here."""
        self.path.mkdir(exist_ok=True)
        os.replace(self._renders / name, self.path / (name + DAMAGED if damaged else name))

    def keep(self) -> None:
        """Let nothing here be deleted, even where room is needed."""
        (self.path / KEEP).write_text(WHY)

    def bring_back(self, names: Container[str]) -> int:
        """Move those of these files that are here back, unless others are in their places. Returns how many."""
        count = 0
        for name, _ in self._files():
            if name in names and not (self._renders / name).exists():
                os.replace(self.path / name, self._renders / name)
                count += 1
        if count and [name for name, _ in self._files()] in ([], [KEEP]):
            self.delete(KEEP)
            with suppress(OSError):  # another process made a file of this name
                self.path.rmdir()
        return count

    def names(self) -> list[str]:
        """File names of pictures that no row refers to."""
        return sorted(name for name, _ in self._files() if name != KEEP)

    def _files(self) -> list[tuple[str, os.stat_result]]:
        found = []
        with suppress(FileNotFoundError), os.scandir(self.path) as entries:
            for entry in entries:
                with suppress(FileNotFoundError):  # which made room just now
                    if entry.is_file(follow_symlinks=False):
                        found.append((entry.name, entry.stat(follow_symlinks=False)))
        return found
