"""Scenes and materials that users saved: documents by kind and name, in an SQLite file that survives a power cut."""

from __future__ import annotations

import json
import logging
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from service import recipe
from service.assets import AssetStore
from service.problems import FieldError, InvalidDocument, NotFound, Unavailable
from service.scene import Material, parse_scene
from service.scene.mistakes import escaped, validated

log = logging.getLogger(__name__)

KINDS = ("scenes", "materials")
LONGEST_NAME = 100  # characters
BUSY_S = 10.0  # how long a writer waits for another one

_TABLES = """
CREATE TABLE IF NOT EXISTS documents (
    kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (kind, name)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS uses (
    asset TEXT NOT NULL, kind TEXT NOT NULL, name TEXT NOT NULL, PRIMARY KEY (asset, kind, name)
) WITHOUT ROWID;
"""
_MATERIAL: TypeAdapter[Any] = TypeAdapter(Material)


class Documents:
    """For any number of threads and processes; not for an event loop. Raises Unavailable where the disk fails."""

    def __init__(self, folder: Path, assets: AssetStore) -> None:
        self._path = folder / "documents.sqlite3"
        self._assets = assets

    def names(self, kind: str) -> list[dict[str, str]]:
        """`[{name, title}]` in the order of the titles. Raises NotFound for an unknown kind."""
        _check_kind(kind)
        with self._open() as database:
            rows = database.execute("SELECT name, title FROM documents WHERE kind = ? ORDER BY title, name", (kind,))
            return [{"name": name, "title": title} for name, title in rows]

    def get(self, kind: str, name: str) -> Any:
        """The bare document. Raises NotFound."""
        _check_kind(kind)
        with self._open() as database:
            row = database.execute("SELECT body FROM documents WHERE kind = ? AND name = ?", (kind, name)).fetchone()
        if row is None:
            raise _missing(kind, name)
        return json.loads(row[0])

    def put(self, kind: str, name: str, document: Any, title: str | None = None) -> tuple[str, bool]:
        """Saves a valid document in the place of what had the name; its title now, and whether nothing had it.

        Raises InvalidDocument with pointers from the document's root.
        """
        _check_kind(kind)
        self._validate(kind, document)
        uses = recipe.references(document) if kind == "scenes" else []
        body = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        with self._open() as database, database:
            key = (kind, name)
            old = database.execute("SELECT title FROM documents WHERE kind = ? AND name = ?", key).fetchone()
            kept = title or (old[0] if old else name)
            database.execute("INSERT OR REPLACE INTO documents VALUES (?, ?, ?, ?)", (*key, kept, body))
            database.execute("DELETE FROM uses WHERE kind = ? AND name = ?", key)
            database.executemany("INSERT INTO uses VALUES (?, ?, ?)", [(asset, *key) for asset in uses])
        log.info("document saved kind=%s name=%s bytes=%d", kind, name, len(body))
        return kept, old is None

    def delete(self, kind: str, name: str) -> None:
        """Raises NotFound."""
        _check_kind(kind)
        with self._open() as database, database:
            deleted = database.execute("DELETE FROM documents WHERE kind = ? AND name = ?", (kind, name)).rowcount
            database.execute("DELETE FROM uses WHERE kind = ? AND name = ?", (kind, name))
        if not deleted:
            raise _missing(kind, name)
        log.info("document deleted kind=%s name=%s", kind, name)

    def assets_in_use(self) -> set[str]:
        """The ids of all assets that saved documents refer to."""
        if not self._path.exists():
            return set()
        with self._open() as database:
            return {asset for (asset,) in database.execute("SELECT DISTINCT asset FROM uses")}

    @property
    def bytes(self) -> int:
        """Of the file and its log."""
        total = 0
        for path in self._path.parent.glob(self._path.name + "*"):
            with suppress(FileNotFoundError):  # the log goes when the last one who reads or writes has done so
                total += path.stat().st_size
        return total

    def _validate(self, kind: str, document: Any) -> None:
        if kind == "materials":
            validated(_MATERIAL, document, "")
            return
        parse_scene(document)
        errors = [
            FieldError("".join(f"/{escaped(step)}" for step in place), f"there is no asset {ref[:100]!r} here")
            for place, ref in recipe.places(document)
            if not self._assets.holds(ref)
        ]
        if errors:
            raise InvalidDocument(errors)

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with closing(sqlite3.connect(self._path, timeout=BUSY_S)) as database:
                # A write-ahead log, synced at every commit: what was answered is on the disk, and whole.
                database.execute("PRAGMA journal_mode = WAL")
                database.execute("PRAGMA synchronous = FULL")
                database.executescript(_TABLES)
                yield database
        except (OSError, sqlite3.Error) as error:
            log.error("documents failed error=%s", error)
            raise Unavailable("The saved documents can't be reached: the server's disk has a problem.", 30) from None


def _check_kind(kind: str) -> None:
    if kind not in KINDS:
        raise NotFound(f"there are no documents of {kind[:80]!r}; there are {', '.join(KINDS)}")


def _missing(kind: str, name: str) -> NotFound:
    return NotFound(f"there is no {name[:LONGEST_NAME]!r} among the saved {kind}")
