"""The folder of the assets' files: each file is written whole or not at all; leftovers of a crash are deleted.

    HASH              an asset's bytes, named by their SHA-256
    HASH.json         its record: what `POST /v1/assets` answered
    HASH.scene.json   the document that a glTF file was imported as
    HASH.damaged      bytes that no longer have this hash; they stay, for an inspection, until room is needed
    .*.tmp            a file that is being written, locked by its writer: one without a lock is left from a crash

An asset exists when both its bytes and its record exist. No file is ever changed in place.
"""

from __future__ import annotations

import fcntl
import logging
import os
import re
import struct
import tempfile
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from service.formats.source import Source, write
from service.system.disk_usage import Usage, usage

log = logging.getLogger(__name__)

HASH = re.compile(r"[0-9a-f]{64}")
RECORD, SCENE, DAMAGED, PART = ".json", ".scene.json", ".damaged", ".tmp"


@dataclass
class StoredAsset:
    """One asset on the disk: the bytes of its files, and when it was last read (ns since 1970; 0 for damaged
    bytes)."""

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
        """A file without a name, which the system deletes when it is closed. Raises OSError."""
        self.path.mkdir(parents=True, exist_ok=True)
        return tempfile.TemporaryFile(dir=self.path)

    def put(self, id: str, files: dict[str, Source], lasting: bool = True) -> int:
        """Store files of an asset, by suffix; each replaces an earlier one. Returns the first one's time of change
        in ns since 1970.

        With `lasting` the files survive a loss of power from the return on. Raises OSError.
        """
        with ExitStack() as stack:
            written = {suffix: stack.enter_context(self._written(data, lasting)) for suffix, data in files.items()}
            with self.locked(), self._totals.change() as change:
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
        """Rename an asset's bytes, open in `file`, to `.damaged`: they no longer have its hash. Raises OSError."""
        with self.locked(), suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), self.file(id).stat()):  # else it was replaced just now
                with self._totals.change() as change:
                    change.remove(self.file(id, RECORD))
                    change.replaces(self.file(id, DAMAGED))
                    os.replace(self.file(id), self.file(id, DAMAGED))

    def delete(self, id: str) -> None:
        """Delete an asset's files. The caller has the lock. The record goes first: no record is without bytes."""
        with self._totals.change() as change:
            for suffix in (RECORD, SCENE, DAMAGED, ""):
                change.remove(self.file(id, suffix))

    def usage(self) -> Usage:
        """The disk usage of all assets; leftovers of a crash are not counted. Raises OSError."""
        known = self._totals.read()
        if known is None:
            if not self.path.exists():
                return Usage()
            with self.locked():
                known = self._totals.read()
                if known is None:
                    known = total(self.count())
        return known

    def known_totals(self) -> Usage | None:
        """The totals as they are stored; None where they have to be counted first."""
        return self._totals.read()

    def count(self) -> dict[str, StoredAsset]:
        """Count all assets and store the totals; the assets by hash. The caller has the lock."""
        assets = self.assets()
        self._totals.write(total(assets))
        return assets

    def assets(self) -> dict[str, StoredAsset]:
        """All assets by hash, without the leftovers of a crash."""
        assets: dict[str, StoredAsset] = {}
        names = set()
        for entry in self._entries():
            with suppress(FileNotFoundError):
                hash, suffix = split(entry.name)
                if hash:
                    found = entry.stat(follow_symlinks=False)
                    names.add(entry.name)
                    one = assets.setdefault(hash, StoredAsset())
                    one.usage += usage(found)
                    if not suffix:
                        one.used = found.st_mtime_ns
        return {
            hash: one for hash, one in assets.items() if {hash, hash + RECORD} <= names or hash + DAMAGED in names
        }

    def assets_of(self, ids: Collection[str]) -> dict[str, StoredAsset]:
        """Those of these assets that exist, by hash."""
        found: dict[str, StoredAsset] = {}
        for id in ids:
            with suppress(FileNotFoundError):
                stats = [self.file(id, suffix).stat() for suffix in ("", RECORD)]
                one = StoredAsset(usage(stats[0]) + usage(stats[1]), stats[0].st_mtime_ns)
                found[id.removeprefix("sha256:")] = one
                one.usage += usage(self.file(id, SCENE).stat())
        return found

    def clear(self) -> None:
        """Delete the leftovers of a crash: half-written files, bytes without a record, records without bytes."""
        deleted = 0
        try:
            with self.locked() if self.path.exists() else nullcontext():
                names = {entry.name for entry in self._entries()}
                for name in names:
                    hash, suffix = split(name)
                    if hash and suffix != DAMAGED and not {hash, hash + RECORD} <= names:
                        (self.path / name).unlink(missing_ok=True)
                        deleted += 1
                    elif name.startswith(".") and name.endswith(PART):
                        deleted += _deleted_unless_written(self.path / name)
        except OSError as error:
            log.warning("could not delete the leftovers of a crash", {"folder": self.path, "error": error})
        if deleted:
            log.info("deleted the leftovers of a crash", {"files": deleted})

    def recount(self) -> None:
        """Count the totals again, as files may have been copied or deleted by hand. Raises OSError."""
        if self.path.exists():
            with self.locked():
                self.count()

    @contextmanager
    def locked(self) -> Iterator[None]:
        """The lock under which assets are added and deleted; it is never taken for long. Raises OSError."""
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
        """A temporary file with `data`, locked until the context ends. It is deleted then, unless it was renamed."""
        self.path.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            while True:
                fd, name = tempfile.mkstemp(prefix=".", suffix=PART, dir=self.path)
                file = stack.enter_context(open(fd, "wb"))
                stack.callback(Path(name).unlink, missing_ok=True)
                _lock(fd)
                if os.fstat(fd).st_nlink:  # otherwise `clear` deleted it before it was locked
                    break
            write(data, file)
            file.flush()
            if lasting:
                os.fsync(fd)
            yield Path(name)

    def _sync(self) -> None:
        """Write the folder itself to the disk, and with it the names of its files."""
        fd = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)


def total(assets: dict[str, StoredAsset]) -> Usage:
    return sum((one.usage for one in assets.values()), Usage())


def split(name: str) -> tuple[str, str]:
    """The hash that a file's name begins with, and its suffix; "" and the name where the file is not an asset's."""
    hash, dot, rest = name.partition(".")
    known = HASH.fullmatch(hash) and dot + rest in ("", RECORD, SCENE, DAMAGED)
    return (hash, dot + rest) if known else ("", name)


def _lock(fd: int) -> None:
    """Lock a file; waits. Some network file systems have no locks: there the folder is for one server."""
    with suppress(OSError):
        fcntl.flock(fd, fcntl.LOCK_EX)


def _deleted_unless_written(path: Path) -> bool:
    """Delete a temporary file that no writer has locked; whether it was. A writer that locks it later sees that."""
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


TOTALS = struct.Struct("<4sIqq")  # MAGIC, whether a change is under way, bytes, files
MAGIC = b"SBX1"


class FolderTotals:
    """The disk space of an asset folder, updated with each change instead of counted again.

    The totals are in a file beside the folder, for all processes that use it. The file is marked while a change is
    under way: after a crash in the middle of one, the next reader finds no totals and counts. All methods but `read`
    need the folder's lock.
    """

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
