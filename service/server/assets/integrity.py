"""Checks that the bytes on the disk still have the hash that names them: once a process, not at every load."""

from __future__ import annotations

import logging
import os
import threading
from contextlib import suppress
from typing import BinaryIO

from service.formats.source import digest
from service.problems import NotFound
from service.server.assets.folder import AssetFolder

log = logging.getLogger(__name__)


class Integrity:
    """Opens an asset's bytes after they were checked. For any number of threads."""

    def __init__(self, files: AssetFolder) -> None:
        self._files = files
        self._lock = threading.Lock()
        self._sound: dict[str, int] = {}  # time of change (ns) of the files that were found sound, by asset

    def stored(self, id: str, changed: int) -> None:
        """Record that hashed bytes were just stored; `changed` is the result of `AssetFolder.put`."""
        with self._lock:
            self._sound[id] = changed

    def open(self, id: str, again: bool = False) -> BinaryIO | None:
        """An asset's file, marked as used now; None where it was just deleted to make room.

        It is hashed (0.2 s for 256 MiB) when this process opens it for the first time, when it has changed since, and
        with `again`. Raises NotFound where it is damaged; the file is then renamed.
        """
        try:
            file = self._files.file(id).open("rb")
        except FileNotFoundError:
            return None
        try:
            if again or not self._was_sound(id, file):
                self._check(id, file)
        except BaseException:
            file.close()
            raise
        return file

    def _was_sound(self, id: str, file: BinaryIO) -> bool:
        with self._lock:
            if self._sound.get(id) != os.fstat(file.fileno()).st_mtime_ns:
                return False
            self._touch(id, file)
            return True

    def _check(self, id: str, file: BinaryIO) -> None:
        try:
            sound = "sha256:" + digest(file) == id
        except OSError as error:
            log.error("could not read an asset", {"id": id, "error": error})
            sound = False
        if not sound:
            log.error("the bytes of an asset are damaged; they were set aside", {"id": id})
            with suppress(OSError):  # in a read-only folder the file stays, and is refused again
                self._files.set_aside(id, file)
            raise damaged(id)
        file.seek(0)
        with self._lock:
            self._touch(id, file)

    def _touch(self, id: str, file: BinaryIO) -> None:
        with suppress(OSError):
            os.utime(file.fileno())  # the assets that were used longest ago are deleted first
        self._sound[id] = os.fstat(file.fileno()).st_mtime_ns


def damaged(id: str) -> NotFound:
    return NotFound(
        f"the stored bytes of {id} are damaged; upload the file again, or the glTF file or zip that it is part of"
    )
