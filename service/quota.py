"""Room on the disk: what was unused longest makes way, never what a saved document refers to."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable
from pathlib import Path

from service.problems import TooLarge, Unavailable

log = logging.getLogger(__name__)

RETRY_S = 60


class Quota:
    """Of the files in `folder`/assets and of `others` bytes beside them; `in_use` names the assets that must stay."""

    def __init__(
        self, folder: Path, limit: int, in_use: Callable[[], set[str]], others: Callable[[], int] = lambda: 0
    ) -> None:
        self._folder = folder / "assets"
        self._limit = limit
        self._in_use = in_use
        self._others = others
        self._lock = threading.Lock()

    def make_room(self, size: int) -> None:
        """Deletes assets until `size` more bytes are within the limit.

        Raises TooLarge for what could never be, Unavailable where saved documents leave no room.
        """
        if size > self._limit:
            raise TooLarge(f"{size} bytes are more than all assets may take: {self._limit} (SUNBOX_DATA_QUOTA)")
        with self._lock:
            used = self.used()
            if used + size <= self._limit:
                return
            kept = {id.removeprefix("sha256:") for id in self._in_use()}
            for path in self._oldest_first():
                if path.stem not in kept:
                    used -= _delete(path)
                if used + size <= self._limit:
                    return
        raise Unavailable("The disk quota is used up by what saved documents refer to (SUNBOX_DATA_QUOTA).", RETRY_S)

    def used(self) -> int:
        """Bytes."""
        return self._others() + sum(_size(path) for path in self._files())

    def _files(self) -> list[Path]:
        try:
            return [Path(entry.path) for entry in os.scandir(self._folder) if entry.is_file(follow_symlinks=False)]
        except FileNotFoundError:
            return []

    def _oldest_first(self) -> list[Path]:
        """The files that hold assets' bytes, by when they were last read."""
        return sorted((path for path in self._files() if not path.suffix), key=_used_at)


def _delete(path: Path) -> int:
    """How many bytes that gave. What vouches for an asset goes first: there is never one without its bytes."""
    freed = 0
    for file in (path.with_suffix(".json"), *path.parent.glob(f"{path.name}.*"), path):
        size = _size(file)
        try:
            file.unlink()
            freed += size
        except FileNotFoundError:
            pass  # another process did it
    log.info("asset evicted id=sha256:%s bytes=%d", path.stem, freed)
    return freed


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def _used_at(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except FileNotFoundError:
        return 0.0
