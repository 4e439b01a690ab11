"""The folder of the assets' files: each is written whole or not at all, and what a crash leaves is cleared away.

    HASH              an asset's bytes, named by their SHA-256
    HASH.json         its record: what `POST /v1/assets` answered
    HASH.scene.json   the document that a glTF file was imported as
    HASH.damaged      bytes that no longer have this hash, kept for whoever looks into it until room is needed
    .*.tmp            a file that is being written, locked by its writer: one without a lock is left from a crash

An asset is there when its bytes and its record are. Nothing is ever changed in place.
"""

from __future__ import annotations

import fcntl
import logging
import os
import re
import tempfile
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from service.assets.folder_totals import FolderTotals
from service.assets.source import Source, write
from service.disk_usage import Usage, usage

log = logging.getLogger(__name__)

HASH = re.compile(r"[0-9a-f]{64}")
RECORD, SCENE, DAMAGED, PART = ".json", ".scene.json", ".damaged", ".tmp"


@dataclass
class Held:
    """What one asset takes on the disk. `used` is when it was last read, in ns since 1970; 0 of damaged bytes."""

    usage: Usage = field(default_factory=Usage)
    used: int = 0


class AssetFolder:
    """For any number of threads, and for several processes on one folder."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._totals = FolderTotals(path.with_name(path.name + ".totals"))

    def file(self, id: str, suffix: str = "") -> Path:
        return self.path / (id.removeprefix("sha256:") + suffix)

    def nameless(self) -> BinaryIO:
        """A file without a name, gone when it is closed. Raises OSError."""
        self.path.mkdir(parents=True, exist_ok=True)
        return tempfile.TemporaryFile(dir=self.path)

    def put(self, id: str, files: dict[str, Source], lasting: bool = True) -> int:
        """Stores files of an asset, by suffix, each in the place of what was there; their time of change in ns.

        `lasting`: they are on the disk when this returns, also if the power fails next. Raises OSError.
        """
        with ExitStack() as stack:
            written = {suffix: stack.enter_context(self._written(data, lasting)) for suffix, data in files.items()}
            with self.alone(), self._totals.change() as change:
                for suffix, path in written.items():
                    change.replaces(self.file(id, suffix))
                    os.replace(path, self.file(id, suffix))
                    change.added(self.file(id, suffix))
                change.remove(self.file(id, DAMAGED))
                changed = self.file(id, next(iter(files))).stat().st_mtime_ns
        if lasting:
            self._sync()
        return changed

    def set_aside(self, id: str, file: BinaryIO) -> None:
        """Takes an asset out of use whose bytes, open in `file`, don't have its hash. Raises OSError."""
        with self.alone(), suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), self.file(id).stat()):  # else it was replaced just now
                with self._totals.change() as change:
                    change.remove(self.file(id, RECORD))
                    change.replaces(self.file(id, DAMAGED))
                    os.replace(self.file(id), self.file(id, DAMAGED))

    def delete(self, id: str) -> None:
        """Within `alone`. The record goes first: there is never one without its bytes."""
        with self._totals.change() as change:
            for suffix in (RECORD, SCENE, DAMAGED, ""):
                change.remove(self.file(id, suffix))

    def usage(self) -> Usage:
        """Of all assets; leftovers of a crash don't count. Raises OSError."""
        known = self._totals.read()
        if known is None:
            if not self.path.exists():
                return Usage()
            with self.alone():
                known = self._totals.read()
                if known is None:
                    known = total(self.count())
        return known

    def known_totals(self) -> Usage | None:
        """What `usage` says without counting; None where nobody knows."""
        return self._totals.read()

    def count(self) -> dict[str, Held]:
        """What `held` says, of which the totals are made anew. Within `alone`."""
        held = self.held()
        self._totals.write(total(held))
        return held

    def held(self) -> dict[str, Held]:
        """What is here of each asset, by hash; leftovers of a crash are not."""
        held: dict[str, Held] = {}
        names = set()
        for entry in self._entries():
            with suppress(FileNotFoundError):
                hash, suffix = split(entry.name)
                if hash:
                    found = entry.stat(follow_symlinks=False)
                    names.add(entry.name)
                    one = held.setdefault(hash, Held())
                    one.usage += usage(found)
                    if not suffix:
                        one.used = found.st_mtime_ns
        return {hash: one for hash, one in held.items() if {hash, hash + RECORD} <= names or hash + DAMAGED in names}

    def held_of(self, ids: Collection[str]) -> dict[str, Held]:
        """What `held` says of these assets, as far as they are here and whole."""
        found: dict[str, Held] = {}
        for id in ids:
            with suppress(FileNotFoundError):
                stats = [self.file(id, suffix).stat() for suffix in ("", RECORD)]
                one = Held(usage(stats[0]) + usage(stats[1]), stats[0].st_mtime_ns)
                found[id.removeprefix("sha256:")] = one
                one.usage += usage(self.file(id, SCENE).stat())
        return found

    def clear(self) -> None:
        """Deletes what a crash left: files half written, bytes without their record, records without their bytes."""
        deleted = 0
        try:
            with self.alone() if self.path.exists() else nullcontext():
                names = {entry.name for entry in self._entries()}
                for name in names:
                    hash, suffix = split(name)
                    if hash and suffix != DAMAGED and not {hash, hash + RECORD} <= names:
                        (self.path / name).unlink(missing_ok=True)
                        deleted += 1
                    elif name.startswith(".") and name.endswith(PART):
                        deleted += _deleted_unless_written(self.path / name)
        except OSError as error:
            log.warning("could not clear away what a crash left folder=%s error=%s", self.path, error)
        if deleted:
            log.info("cleared away what a crash left files=%d", deleted)

    def recount(self) -> None:
        """Make the totals anew, as somebody may have copied or deleted files by hand. Raises OSError."""
        if self.path.exists():
            with self.alone():
                self.count()

    @contextmanager
    def alone(self) -> Iterator[None]:
        """While it lasts nobody else puts assets here or takes any away; never for long. Raises OSError."""
        self.path.mkdir(parents=True, exist_ok=True)
        fd = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            _lock(fd)
            yield
        finally:
            os.close(fd)

    def _entries(self) -> Iterator[os.DirEntry[str]]:
        with suppress(FileNotFoundError), os.scandir(self.path) as entries:
            for entry in entries:
                if entry.is_file(follow_symlinks=False):
                    yield entry

    @contextmanager
    def _written(self, data: Source, lasting: bool) -> Iterator[Path]:
        """A file with `data` to be renamed, locked while it lasts; deleted if it still has its name in the end."""
        self.path.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            while True:
                fd, name = tempfile.mkstemp(prefix=".", suffix=PART, dir=self.path)
                file = stack.enter_context(open(fd, "wb"))
                stack.callback(Path(name).unlink, missing_ok=True)
                _lock(fd)
                if os.fstat(fd).st_nlink:  # or else `clear` came before the lock
                    break
            write(data, file)
            file.flush()
            if lasting:
                os.fsync(fd)
            yield Path(name)

    def _sync(self) -> None:
        """Has the disk know the files' names."""
        fd = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)


def total(held: dict[str, Held]) -> Usage:
    return sum((one.usage for one in held.values()), Usage())


def split(name: str) -> tuple[str, str]:
    """The hash that a file's name begins with, "" where it is none of an asset's, and the rest."""
    hash, dot, rest = name.partition(".")
    known = HASH.fullmatch(hash) and dot + rest in ("", RECORD, SCENE, DAMAGED)
    return (hash, dot + rest) if known else ("", name)


def _lock(fd: int) -> None:
    """Waits. A network's file system may know no locks; there only one server at a time should use the folder."""
    with suppress(OSError):
        fcntl.flock(fd, fcntl.LOCK_EX)


def _deleted_unless_written(path: Path) -> bool:
    """Unlinks a file that nobody has locked. Its writer looks for that as soon as it has the lock."""
    with suppress(FileNotFoundError):
        fd = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
            return True
        except BlockingIOError:
            pass
        finally:
            os.close(fd)
    return False
