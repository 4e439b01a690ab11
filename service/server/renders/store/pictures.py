"""Checkpoints and finished pictures of renders: a file each, written whole or not at all.

    ID.checkpoint  the picture of a render under way: it goes on from there to the same bits
    ID.picture     that of an ended one
    .*.tmp         a file that is being written, or what a crash left of one
    lost           a folder for pictures of renders that the database does not know

A file is a line of JSON, which tells how far the render was and how the bytes after it are divided, and these bytes.
"""

from __future__ import annotations

import json
import logging
import os
import tempfile
import threading
import zlib
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np

from service.ipc.messages import Progress, Reason, Restore, SavedPicture
from service.server.renders.store.fitting import Unfit, fit
from service.server.storage.lost_pictures import LostPictures
from service.system.disk_usage import Usage, expected, usage

log = logging.getLogger(__name__)

KEY, FORMAT = "sunbox_picture", 1  # which the first line begins with
PART = ".tmp"
LONGEST_LINE = 1 << 16  # bytes of the line of JSON
MOST_STRANGERS = 0.1  # of the pictures; where more are unknown, the database may be another one
PIECE = 8 << 20  # bytes that are written at a time

Kind = Literal["checkpoint", "picture"]
KINDS: tuple[Kind, ...] = ("picture", "checkpoint")  # the later one first
SUFFIXES = tuple(f".{kind}" for kind in KINDS)
Room = Callable[[Usage], AbstractContextManager[None]]


class DamagedPicture(Exception):
    """A file is not what was written; the text says in what."""


@dataclass(frozen=True)
class _Head:
    """The first line of a file, but for its format."""

    samples: int
    under_way: tuple[int, int, int]
    sizes: list[int]  # bytes of each buffer
    crc32: int  # of all of them
    reason: Reason | None = None
    progress: Progress = field(default_factory=Progress)
    bands: tuple[tuple[int, int, int, int], ...] = ()
    driver: str = ""


class _Names:
    """The names of the files of many renders, none of which is in memory."""

    def __init__(self, ids: Collection[str]) -> None:
        self._ids = frozenset(ids)

    def __contains__(self, name: object) -> bool:
        id, _, kind = str(name).rpartition(".")
        return kind in KINDS and id in self._ids

    @staticmethod
    def key(name: str) -> tuple[str, Kind]:
        id, _, kind = name.rpartition(".")
        return id, KINDS[KINDS.index(kind)]


class PictureFiles:
    """For any number of threads, of one process. Methods raise OSError where the disk fails.

    `room` is entered with what is to be written, and raises where there is no room for it.
    """

    def __init__(self, folder: Path, room: Room = lambda size: nullcontext()) -> None:
        self._folder = folder
        self._room = room
        self._sizes: dict[tuple[str, Kind], Usage] = {}  # on the disk, once `prepare` was called
        self._total = Usage()
        self._lock = threading.Lock()  # of these two
        self.lost = LostPictures(folder)

    def prepare(self, ids: Collection[str], gone: Collection[str] = ()) -> None:
        """Count what is there, and delete what a crash left, half-written or of renders that are `gone`.

        The pictures of others than `ids` are moved to `lost`, from where those of `ids` come back.
        """
        known, leftovers = _Names(ids), _Names(gone)
        try:
            if back := self.lost.bring_back(known):
                log.info("moved pictures back whose renders are known again", {"files": back})
        except OSError as error:
            log.error("could not move pictures back", {"folder": self.lost.path, "error": error})
        strangers, crashed = list[str](), list[str]()
        with suppress(FileNotFoundError), os.scandir(self._folder) as entries:
            for entry in entries:
                if entry.name in known:
                    self._count(known.key(entry.name), usage(entry.stat()))
                elif entry.name.endswith(PART) or entry.name in leftovers:
                    crashed.append(entry.path)
                elif entry.name.endswith(SUFFIXES):
                    strangers.append(entry.name)
        try:
            self._tidy(crashed, strangers)
        except OSError as error:
            log.error("could not tidy up the pictures of renders", {"folder": self._folder, "error": error})

    def _tidy(self, crashed: Collection[str], strangers: Collection[str]) -> None:
        for path in crashed:
            os.unlink(path)
        if crashed:
            log.info("deleted what a crash left of renders", {"files": len(crashed)})
        for name in strangers:
            self.lost.put(name)
        if len(strangers) > MOST_STRANGERS * (len(strangers) + self._total.files):
            self.lost.keep()
        if strangers:
            log.warning(
                "moved pictures of renders that the database does not know",
                {"files": len(strangers), "folder": self.lost.path},
            )

    @property
    def usage(self) -> Usage:
        """Disk usage of all files but the lost ones."""
        return self._total

    def size(self, id: str) -> int:
        """The bytes on the disk of one render's pictures."""
        return sum(self._sizes.get((id, kind), Usage()).bytes for kind in KINDS)

    def has(self, id: str, kind: Kind) -> bool:
        return (id, kind) in self._sizes

    def write(self, id: str, kind: Kind, restore: Restore) -> None:
        """Store a picture in the place of an earlier one of this kind; it is on the disk when this returns."""
        saved, parts = restore.saved, [buffer.data.cast("B") for buffer in restore.saved.buffers]
        checksum = 0
        for part in parts:
            checksum = zlib.crc32(part, checksum)
        sizes = [part.nbytes for part in parts]
        head = _Head(
            saved.samples,
            saved.under_way,
            sizes,
            checksum,
            restore.reason,
            restore.progress,
            saved.bands,
            saved.driver,
        )
        line = json.dumps({KEY: FORMAT} | asdict(head), separators=(",", ":")).encode() + b"\n"
        with self._room(expected([len(line) + sum(part.nbytes for part in parts)])):
            self._folder.mkdir(parents=True, exist_ok=True)
            fd, name = tempfile.mkstemp(prefix=".", suffix=PART, dir=self._folder)
            try:
                with open(fd, "wb", buffering=0) as file:
                    for part in [memoryview(line), *parts]:
                        _write_whole(file, part)
                    os.fsync(fd)
                    size = usage(os.fstat(fd))
                os.replace(name, self.path(id, kind))
            except BaseException:
                with suppress(OSError):
                    os.unlink(name)
                raise
            self._count((id, kind), size)
        self._sync()

    def read(self, id: str, kind: Kind, task: int) -> Restore:
        """The picture for a task, whose generation is 1. Raises DamagedPicture, and FileNotFoundError."""
        with open(self.path(id, kind), "rb") as file:
            head = _head(file)
            buffers, checksum = [], 0
            for size in head.sizes:
                buffer = np.empty(size, np.uint8)
                if file.readinto(buffer.data) != size:
                    raise DamagedPicture("the file is shorter than what was written")
                checksum = zlib.crc32(buffer.data, checksum)
                buffers.append(buffer)
        if checksum != head.crc32:
            raise DamagedPicture("its bytes are not those that were written")
        saved = SavedPicture(head.samples, head.under_way, buffers, head.driver, head.bands)
        return Restore(task, 1, saved, head.reason, head.progress)

    def progress(self, id: str, kind: Kind) -> Progress:
        """How far the render was. Raises DamagedPicture, and FileNotFoundError."""
        with open(self.path(id, kind), "rb") as file:
            return _head(file).progress

    def delete(self, id: str, *kinds: Kind) -> None:
        for kind in kinds or KINDS:
            self.path(id, kind).unlink(missing_ok=True)
            self._count((id, kind), None)

    def set_aside(self, id: str, kind: Kind) -> None:
        """Have a file that cannot be read out of the way, for an inspection."""
        self.lost.put(self.path(id, kind).name, damaged=True)
        self._count((id, kind), None)

    def path(self, id: str, kind: Kind) -> Path:
        return self._folder / f"{id}.{kind}"

    def _count(self, key: tuple[str, Kind], size: Usage | None) -> None:
        """Note what a file takes; None: it is not there any more."""
        with self._lock:
            self._total += (size or Usage()) - self._sizes.pop(key, Usage())
            if size is not None:
                self._sizes[key] = size

    def _sync(self) -> None:
        """Have the disk know the files' names."""
        fd = os.open(self._folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)


def _head(file: BinaryIO) -> _Head:
    """Raises DamagedPicture."""
    try:
        values = json.loads(file.readline(LONGEST_LINE))
        if values.pop(KEY) != FORMAT:
            raise DamagedPicture("another version of Sunbox wrote it")
        return fit(_Head, values)
    except (ValueError, TypeError, KeyError, AttributeError, Unfit):
        raise DamagedPicture("its first line is not that of a picture") from None


def _write_whole(file: Any, part: memoryview) -> None:
    written = 0
    while written < part.nbytes:
        written += file.write(part[written : written + PIECE])
