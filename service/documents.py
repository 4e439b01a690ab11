"""Scenes and materials that users saved: documents by kind and name, in an SQLite file that survives a power cut."""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import TypeAdapter

from service import recipe
from service.assets import AssetStore
from service.problems import FieldError, InvalidDocument, NotFound, Unavailable
from service.quota import Quota
from service.scene import Material, parse_scene
from service.scene.base import MOST_MISTAKES
from service.scene.document import Limits
from service.scene.text import dump_json
from service.scene.validation import escaped, validated

log = logging.getLogger(__name__)

Kind = Literal["scenes", "materials"]
KINDS: tuple[Kind, ...] = get_args(Kind)
LONGEST_NAME = 100  # characters
BUSY_S = 10.0  # how long a writer waits for another one
LOG_BYTES = 4 << 20  # to which the log is cut after a large document; by itself it keeps that size while others read

VERSION = 1  # of the tables, in the file's user_version; 0: bodies in the key's own tree, and pages never given back
_TABLES = f"""
BEGIN IMMEDIATE;
CREATE TABLE IF NOT EXISTS documents (
    kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (kind, name)
);
CREATE TABLE IF NOT EXISTS uses (
    asset TEXT NOT NULL, kind TEXT NOT NULL, name TEXT NOT NULL, PRIMARY KEY (asset, kind, name)
) WITHOUT ROWID;
PRAGMA user_version = {VERSION};
COMMIT;
"""
# Looking for a name in a table without row ids reads the bodies on the way: 0.5 s beside one of 256 MiB.
_CONVERSION = f"""
BEGIN IMMEDIATE;
ALTER TABLE documents RENAME TO former;
CREATE TABLE documents (
    kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (kind, name)
);
INSERT INTO documents SELECT kind, name, title, body FROM former;
DROP TABLE former;
PRAGMA user_version = {VERSION};
COMMIT;
"""
_MATERIAL: TypeAdapter[Any] = TypeAdapter(Material)


class DamagedFile(Exception):
    """The file of the documents cannot be used; the text is for the person who started the service."""


@dataclass(frozen=True)
class CheckedDocument:
    """A valid document as it is stored, and its references to assets, which may be missing."""

    body: str
    uses: list[tuple[str, str]]  # JSON pointer, reference


def checked(kind: str, document: Any, limits: Limits | None = None) -> CheckedDocument:
    """Raises InvalidDocument with pointers from the document's root. A large document takes seconds."""
    if kind == "materials":
        validated(_MATERIAL, document, "")
    else:
        parse_scene(document, limits=limits)
    places = recipe.places(document) if kind == "scenes" else ()
    uses = [("".join(f"/{escaped(step)}" for step in place), reference) for place, reference in places]
    return CheckedDocument(dump_json(document), uses)


class Documents:
    """For any number of threads and processes; not for an event loop. Raises Unavailable where the disk fails.

    `quota` makes room for documents; without it there always is room.
    """

    def __init__(self, folder: Path, assets: AssetStore, quota: Quota | None = None) -> None:
        self._path = folder / "documents.sqlite3"
        self._assets = assets
        self._quota = quota

    def prepare(self) -> None:
        """Looks at the file and converts what an earlier version wrote, once, which takes as long as copying it does.

        Raises DamagedFile.
        """
        if not self._is_there():
            return
        try:
            with self._connected() as database:
                self._convert(database)
                for table in ("documents", "uses"):
                    database.execute(f"SELECT count(*) FROM {table}").fetchone()
        except (OSError, sqlite3.Error) as error:
            if _is_full(error):
                log.warning("could not compact the saved documents file=%s error=%s", self._path, error)
            elif isinstance(
                error, sqlite3.OperationalError | OSError
            ):  # such an error may pass: a lock, or missing rights
                log.error("could not open the saved documents file=%s error=%s", self._path, error)
            else:
                raise DamagedFile(
                    f"the file of the saved documents is damaged ({error}): {self._path}; put a backup in its place, "
                    "or move it away to start with none"
                ) from None

    def names(self, kind: str) -> list[dict[str, str]]:
        """`[{name, title}]` in the order of the titles. Raises NotFound for an unknown kind."""
        check_kind(kind)
        with self._open() as database:
            rows = database.execute("SELECT name, title FROM documents WHERE kind = ? ORDER BY title, name", (kind,))
            return [{"name": name, "title": title} for name, title in rows]

    def get(self, kind: str, name: str) -> bytes:
        """The bare document, as JSON. Raises NotFound."""
        check_kind(kind)
        with self._open() as database:
            row = database.execute("SELECT body FROM documents WHERE kind = ? AND name = ?", (kind, name)).fetchone()
        if row is None:
            raise _missing(kind, name)
        text: str = row[0]
        return text.encode()

    def put(self, kind: str, name: str, document: CheckedDocument, title: str | None = None) -> tuple[str, bool]:
        """Save a document under a name; its title, and whether the name is new.

        Raises InvalidDocument, with pointers from the document's root, where an asset is missing.
        """
        check_kind(kind)
        body, uses = document.body, list(dict.fromkeys(reference for _, reference in document.uses))
        key = (kind, name)
        # These assets stay while others make room, so that a refused document costs no asset.
        with self._quota.pinned(uses) if self._quota else nullcontext():
            self._find_assets(document, uses)
            room = self._quota.room(len(body.encode())) if self._quota else nullcontext()
            with room, self._open() as database, database:
                database.execute("BEGIN IMMEDIATE")
                self._find_assets(document, uses)  # again: another process may have made room
                old = database.execute("SELECT title FROM documents WHERE kind = ? AND name = ?", key).fetchone()
                kept = title or (old[0] if old else name)
                database.execute("INSERT OR REPLACE INTO documents VALUES (?, ?, ?, ?)", (*key, kept, body))
                database.execute("DELETE FROM uses WHERE kind = ? AND name = ?", key)
                database.executemany("INSERT INTO uses VALUES (?, ?, ?)", [(asset, *key) for asset in uses])
        log.info("document saved kind=%s name=%s bytes=%d", kind, name, len(body))
        return kept, old is None

    def delete(self, kind: str, name: str) -> None:
        """Raises NotFound."""
        check_kind(kind)
        with self._open() as database, database:
            deleted = database.execute("DELETE FROM documents WHERE kind = ? AND name = ?", (kind, name)).rowcount
            database.execute("DELETE FROM uses WHERE kind = ? AND name = ?", (kind, name))
        if not deleted:
            raise _missing(kind, name)
        log.info("document deleted kind=%s name=%s", kind, name)

    @contextmanager
    def assets_in_use(self) -> Iterator[set[str]]:
        """The ids of all assets that saved documents refer to; while it lasts no document is saved."""
        if not self._is_there():
            yield set()
            return
        with self._open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            yield {asset for (asset,) in database.execute("SELECT DISTINCT asset FROM uses")}

    @property
    def bytes(self) -> int:
        """The bytes of the documents, without the log beside them, which is deleted when the file is closed."""
        if not self._is_there():
            return 0
        with self._open() as database:
            pages, free, size = (
                database.execute(f"PRAGMA {name}").fetchone()[0]
                for name in ("page_count", "freelist_count", "page_size")
            )
        return int((pages - free) * size)

    def _find_assets(self, document: CheckedDocument, uses: list[str]) -> None:
        """Raises InvalidDocument where one of them is not here."""
        missing = ((ref, why) for ref in uses if (why := self._assets.missing(ref)) is not None)
        first = dict(islice(missing, MOST_MISTAKES))
        if first:
            told = (FieldError(pointer, first[ref]) for pointer, ref in document.uses if ref in first)
            raise InvalidDocument(islice(told, MOST_MISTAKES))

    def _convert(self, database: sqlite3.Connection) -> None:
        (version,) = database.execute("PRAGMA user_version").fetchone()
        if version > VERSION:
            raise DamagedFile(f"a newer version of Sunbox wrote the saved documents: {self._path}")
        if version < VERSION:
            log.info("converting the saved documents file=%s", self._path)
            database.executescript(_CONVERSION)
        if database.execute("PRAGMA auto_vacuum").fetchone() == (0,):
            database.execute("PRAGMA auto_vacuum = FULL")
            database.execute("VACUUM")

    def _is_there(self) -> bool:
        try:
            return self._path.exists()
        except PermissionError:  # of the folder; to open the file then fails, and that is reported
            return True

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        try:
            with self._connected() as database:
                yield database
        except (OSError, sqlite3.Error) as error:
            log.error("could not reach the saved documents file=%s error=%s", self._path, error)
            if getattr(error, "sqlite_errorcode", 0) == sqlite3.SQLITE_BUSY:
                raise Unavailable("Others are saving documents just now.", 1) from None
            raise Unavailable("The saved documents can't be reached: the server's disk has a problem.", 30) from None

    @contextmanager
    def _connected(self) -> Iterator[sqlite3.Connection]:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with closing(sqlite3.connect(self._path, timeout=BUSY_S)) as database:
            if database.execute("PRAGMA page_count").fetchone() == (0,):
                # Pages that are free go back to the disk at every commit. It is chosen before anything is written.
                database.execute("PRAGMA auto_vacuum = FULL")
            # A write-ahead log, synced at every commit: what was answered is on the disk, and whole.
            database.execute("PRAGMA journal_mode = WAL")
            database.execute("PRAGMA synchronous = FULL")
            database.execute(f"PRAGMA journal_size_limit = {LOG_BYTES}")
            if database.execute("SELECT count(*) FROM sqlite_master WHERE name = 'documents'").fetchone() == (0,):
                database.executescript(_TABLES)
            yield database


def _is_full(error: Exception) -> bool:
    return getattr(error, "sqlite_errorcode", 0) == sqlite3.SQLITE_FULL


def check_kind(kind: str) -> Kind:
    """Raises NotFound for an unknown kind."""
    if kind not in KINDS:
        raise NotFound(f"there are no documents of {kind[:80]!r}; there are {', '.join(KINDS)}")
    return kind


def _missing(kind: str, name: str) -> NotFound:
    return NotFound(f"there is no {name[:LONGEST_NAME]!r} among the saved {kind}")
