"""A check that a data folder is sound: the database, the documents and assets in it, and the leftovers of a crash.

The check writes nothing, so that a server may use the folder meanwhile; files that it writes or deletes during the
check are no faults.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

from service.document import presets
from service.document.text import load_json
from service.problems import ServiceError
from service.server.assets.folder import DAMAGED, PART, RECORD, AssetFolder, split, total
from service.server.storage.data_lock import holder
from service.server.storage.database import FILE
from service.server.storage.documents import checked
from service.server.storage.migrations import VERSION

OWNED = 3  # the version since which documents have owners
PIECE = 1 << 20  # bytes that are hashed at a time


@dataclass
class Report:
    """`faults` are losses and damages; `notes` are leftovers that the next start removes by itself."""

    server: str | None = None  # which uses the folder, as `process PID on HOST`
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    documents: int = 0
    assets: int = 0


def check(folder: Path) -> Report:
    """Check a folder, which takes as long as reading all of it. Raises OSError where it cannot be read."""
    os.scandir(folder).close()
    report = Report(holder(folder))
    _check_assets(AssetFolder(folder / "assets"), report)
    try:
        _check_database(folder, report)
    except sqlite3.Error as error:
        report.faults.append(f"{FILE}: {error}")
    return report


def _check_assets(files: AssetFolder, report: Report) -> None:
    if not files.path.exists():
        return
    with files.locked():  # an asset's files are renamed one after the other
        names = {path.name for path in files.path.iterdir() if path.is_file()}
        known, counted = files.known_totals(), total(files.assets())
    if known is not None and known != counted:
        report.notes.append(f"assets: the totals say {known}, and there are {counted}; they are counted at a start")
    for name in sorted(names):
        hash, suffix = split(name)
        if not hash:
            if name.startswith(".") and name.endswith(PART) and not _is_locked(files.path / name):
                report.notes.append(f"assets/{name}: left half-written by a crash; it is deleted at a start")
        elif suffix == DAMAGED:
            report.faults.append(f"assets/{name}: damaged bytes that were set aside; upload the file again")
        elif not {hash, hash + RECORD} <= names:
            if hash + DAMAGED not in names:
                report.notes.append(
                    f"assets/{name}: only a part of an asset, left by a crash; it is deleted at a start"
                )
        elif not suffix:
            report.assets += 1
            try:
                report.faults += [f"assets/{name}: {fault}" for fault in _faults(files, hash)]
            except FileNotFoundError:
                report.assets -= 1  # it was deleted just now
            except OSError as error:
                report.faults.append(f"assets/{name}: it cannot be read: {error.strerror or error}")


def _faults(files: AssetFolder, hash: str) -> Iterator[str]:
    digest = hashlib.sha256()
    with files.file(hash).open("rb") as file:
        while data := file.read(PIECE):
            digest.update(data)
        size = file.tell()
    if digest.hexdigest() != hash:
        yield "its bytes are damaged: their hash is another one; upload the file again"
    try:
        record = json.loads(files.file(hash, RECORD).read_bytes())
        if digest.hexdigest() == hash and (record["id"], record["bytes"]) != ("sha256:" + hash, size):
            yield "its record is of another file; upload the file again"
    except (ValueError, TypeError, KeyError):
        yield "its record is damaged; upload the file again"


def _check_database(folder: Path, report: Report) -> None:
    """Raises sqlite3.Error."""
    if not (folder / FILE).exists():
        return
    with closing(reading(folder / FILE)) as database:
        (version,) = database.execute("PRAGMA user_version").fetchone()
        if version > VERSION:
            report.faults.append(f"{FILE}: a newer version of Sunbox wrote it")
            return
        if version < VERSION:
            report.notes.append(f"{FILE}: an earlier version of Sunbox wrote it; it is migrated at a start")
        for (said,) in database.execute("PRAGMA integrity_check(100)"):
            if said != "ok":
                report.faults.append(f"{FILE}: {said}")
        missing: set[tuple[str, str, str, str]] = set()
        owner = "owner" if version >= OWNED else "''"
        rows = database.execute(f"SELECT kind, name, {owner}, body FROM documents ORDER BY kind, name, {owner}")
        for kind, name, whose, body in rows:
            report.documents += 1
            used = {asset for *_, asset in _uses(database, owner, kind, name, whose)}
            report.faults += [f"{kind}/{name}: {fault}" for fault in _document_faults(kind, body, used)]
            missing |= {(kind, name, whose, asset) for asset in used if not is_here(folder, asset)}
    if missing:
        with closing(reading(folder / FILE)) as database:  # again: documents and assets may have been deleted since
            missing = {one for one in missing if one in _uses(database, owner, *one[:3])}
    for kind, name, _, asset in sorted(missing):
        report.faults.append(f"{kind}/{name}: there is no asset {asset}")


def _uses(database: sqlite3.Connection, owner: str, *key: str) -> list[Any]:
    """(kind, name, owner, asset) of the document with the first three; `owner` is the column that has the third."""
    columns = f"kind, name, {owner}, asset FROM uses WHERE kind = ? AND name = ? AND {owner} = ?"
    return database.execute(f"SELECT {columns}", key).fetchall()


def _document_faults(kind: str, body: str, used: set[str]) -> Iterator[str]:
    try:
        document = checked(kind, load_json(body.encode()))
    except ServiceError as error:
        yield f"it is no valid document: {error}"
        return
    if {reference for _, reference in document.uses} != used:
        yield "the assets that it refers to are not those that are kept for it; save it again"


def is_here(folder: Path, asset: str) -> bool:
    files = AssetFolder(folder / "assets")
    if files.file(asset).exists() and files.file(asset, RECORD).exists():
        return True
    return asset in presets.builtin_assets()


def reading(path: Path) -> sqlite3.Connection:
    """A connection that writes nothing. Without a log beside the file no process has it open: no lock is needed."""
    alone = "" if path.with_name(path.name + "-wal").exists() else "&immutable=1"
    return sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro{alone}", uri=True, timeout=10)


def _is_locked(path: Path) -> bool:
    """True if a process is writing the file just now, or it is gone meanwhile."""
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except (BlockingIOError, FileNotFoundError):
        return True
    except OSError:
        return False
    return False
