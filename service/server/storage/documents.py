"""Scenes and materials that users saved: documents by kind and name, in an SQLite file that survives a power cut."""

from __future__ import annotations

import hashlib
import logging
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from service.document import check_saved_material, parse_scene, references
from service.document.document import Limits
from service.document.text import dump_json
from service.problems import (
    Forbidden,
    NotFound,
    PreconditionFailed,
    TooLarge,
    Unavailable,
)
from service.server.assets import AssetStore
from service.server.storage.asset_access import AssetAccess, Use
from service.server.storage.database import Database
from service.server.storage.quota import Quota
from service.system.disk_usage import Usage, expected

log = logging.getLogger(__name__)

Kind = Literal["scenes", "materials"]
PRIVATE, SHARED, BY_LINK = range(3)  # who reads a document: its owner; all, who see it listed; all who know its name
LINK_DAYS = 90  # a document by link that nobody has read for this long is deleted
DAY_S = 86_400.0
MOST_NAMES = 1000  # of one page
KINDS: tuple[Kind, ...] = get_args(Kind)
LONGEST_NAME = 100  # characters


@dataclass(frozen=True)
class CheckedDocument:
    """A valid document as it is stored, and its references to assets, which need not exist."""

    body: str
    uses: list[Use]


def checked(kind: str, document: Any, limits: Limits | None = None) -> CheckedDocument:
    """Validate a document. Raises InvalidDocument with pointers from its root. A large document takes seconds."""
    if kind == "materials":
        check_saved_material(document, limits)
    else:
        parse_scene(document, limits=limits)
    return CheckedDocument(dump_json(document), references.pointed(document))


def etag(body: bytes) -> str:
    """The strong entity tag (RFC 9110) of a document as it is stored."""
    return f'"{hashlib.sha256(body).hexdigest()[:32]}"'


@dataclass(frozen=True)
class Condition:
    """A condition on the stored document, by the headers If-Match and If-None-Match of RFC 9110."""

    is_match: tuple[str, ...] | None = None  # one of these tags, or "*" for any document
    is_none: tuple[str, ...] | None = None  # none of these tags, or "*" for no document

    def check(self, body: bytes | None) -> None:
        """Check the stored document, None where there is none. Raises PreconditionFailed."""
        if self.is_match is not None and not _matches(self.is_match, body):
            raise PreconditionFailed("Another document has this name by now, or none has: get it, and try again.")
        if self.is_none is not None and _matches(self.is_none, body):
            raise PreconditionFailed("A document of this name is there already.")


ALWAYS = Condition()
TABLES = ("documents", "uses", "document_links", "document_readers")  # with rows of one document
_OF_OWNER = "FROM documents WHERE kind = ? AND name = ? AND owner = ?"


def _matches(tags: tuple[str, ...], body: bytes | None) -> bool:
    return body is not None and ("*" in tags or etag(body) in tags)


class Documents:
    """For any number of threads and processes; not for an event loop. Raises Unavailable where the disk fails.

    `quota` makes room for documents; without one there is no bound. `each`: most bytes of one owner's documents; by
    default its share of the `most` bytes of those of all owners, which is half of what others leave. An owner is a
    text; "" has no such bound, and what it saves is shared by default.
    """

    def __init__(
        self,
        folder: Path,
        assets: AssetStore,
        quota: Quota | None = None,
        each: int | None = None,
        most: int | None = None,
    ) -> None:
        self._each = each
        self._most = most
        self._database = Database(folder)
        self._access = AssetAccess(folder, assets)
        self._quota = quota

    def prepare(self) -> None:
        """Migrate the database: to be called once, before the server starts. Raises DamagedFile."""
        self._database.prepare()
        if self._database.exists():
            with suppress(Unavailable), self._database.open() as database, database:
                _expire(database)

    def names(
        self, kind: str, owner: str = "", limit: int = MOST_NAMES, after: str | None = None
    ) -> tuple[list[dict[str, str]], bool]:
        """`[{name, title}]` of the documents that this owner may read, without those by link, in the order of titles:
        the first `limit` names behind `after`; and whether there are more. Raises NotFound for an unknown kind."""
        check_kind(kind)
        with self._database.open() as database:
            rows = database.execute(
                "SELECT name, title FROM documents WHERE kind = ? AND shared <> ? AND (owner = ? OR shared) "
                "AND name > ? ORDER BY name, owner = ?",
                (kind, BY_LINK, owner, after or "", owner),
            )
            titles = dict[str, str]()  # the owner's own come last, and count
            for name, title in rows:
                if name not in titles and len(titles) == limit:
                    return _listed(titles), True
                titles[name] = title
        return _listed(titles), False

    def get(self, kind: str, name: str, owner: str = "") -> bytes:
        """The bare document, as JSON: the owner's own of that name, or else one that is shared. Raises NotFound."""
        check_kind(kind)
        with self._database.open() as database:
            row = database.execute(
                "SELECT body, shared, owner FROM documents WHERE kind = ? AND name = ? AND (owner = ? OR shared) "
                "ORDER BY owner = ? DESC, rowid LIMIT 1",
                (kind, name, owner, owner),
            ).fetchone()
            if row is None:
                raise _missing(kind, name)
            if row[1] == BY_LINK:
                _note_read(database, (kind, name, row[2]), owner)
        text: str = row[0]
        return text.encode()

    def put(
        self,
        kind: str,
        name: str,
        document: CheckedDocument,
        title: str | None = None,
        owner: str = "",
        shared: int | None = None,
        condition: Condition = ALWAYS,
    ) -> tuple[str, bool]:
        """Save an owner's document under a name. Returns its title, and whether the name is new.

        `shared`: PRIVATE, SHARED, or BY_LINK; None leaves it unchanged, and makes a new document private. Raises
        InvalidDocument, with pointers from the document's root, for an asset that its owner may not use, TooLarge
        where its owner's documents take too much, PreconditionFailed.
        """
        check_kind(kind)
        body, uses = document.body, list(dict.fromkeys(reference for _, reference in document.uses))
        key, size = (kind, name, owner), len(body.encode())
        # Its assets are not deleted to make room for it.
        with self._quota.pinned(uses) if self._quota else nullcontext():
            self._access.allowed(owner, document.uses)
            room = self._quota.room(expected([size])) if self._quota else nullcontext()
            with room, self._database.open() as database, database:
                database.execute("BEGIN IMMEDIATE")
                allowed = self._access.allowed(owner, document.uses)  # again: one may be deleted by now
                old = database.execute(f"SELECT title, shared, bytes, body {_OF_OWNER}", key).fetchone()
                condition.check(None if old is None else old[3].encode())
                self._check_share(database, owner, size - (old[2] if old else 0))
                titled = title or (old[0] if old else name)
                if shared is None:
                    shared = old[1] if old else (PRIVATE if owner else SHARED)
                row = (*key, int(shared), titled, size, body)
                database.execute("INSERT OR REPLACE INTO documents VALUES (?, ?, ?, ?, ?, ?, ?)", row)
                database.execute("DELETE FROM uses WHERE kind = ? AND name = ? AND owner = ?", key)
                rows = [(asset, *key) for asset in allowed.assets]
                database.executemany("INSERT INTO uses VALUES (?, ?, ?, ?)", rows)
                database.execute("DELETE FROM document_links WHERE kind = ? AND name = ? AND owner = ?", key)
                if shared == BY_LINK:
                    database.execute("INSERT INTO document_links VALUES (?, ?, ?, ?)", (*key, time.time()))
                else:
                    database.execute("DELETE FROM document_readers WHERE kind = ? AND name = ? AND owner = ?", key)
                _expire(database)
        log.info("document saved", {"kind": kind, "name": name, "bytes": size})
        return titled, old is None

    def delete(self, kind: str, name: str, owner: str = "", condition: Condition = ALWAYS) -> None:
        """Delete an owner's document, or else one of a version without owners.

        Raises NotFound, Forbidden for one that another owner shares, PreconditionFailed.
        """
        check_kind(kind)
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            for key in dict.fromkeys(((kind, name, owner), (kind, name, ""))):
                found = database.execute(f"SELECT body {_OF_OWNER}", key).fetchone()
                if found is not None:
                    break
            else:
                shared = "SELECT 1 FROM documents WHERE kind = ? AND name = ? AND shared"
                if database.execute(shared, (kind, name)).fetchone():
                    raise Forbidden("This document is shared by another key, which alone may delete it.")
                raise _missing(kind, name)
            condition.check(found[0].encode())
            for table in TABLES:
                database.execute(f"DELETE FROM {table} WHERE kind = ? AND name = ? AND owner = ?", key)
        log.info("document deleted", {"kind": kind, "name": name})

    @contextmanager
    def assets_in_use(self) -> Iterator[set[str]]:
        """A context with the ids of all assets that saved documents, renders and batches use; none of these is stored
        meanwhile."""
        if not self._database.exists():
            yield set()
            return
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            every = "SELECT asset FROM uses UNION SELECT asset FROM render_uses UNION SELECT asset FROM batch_uses"
            yield {asset for (asset,) in database.execute(every)}

    def usage(self) -> Usage:
        """Bytes of the database, without its unused pages."""
        return self._database.usage()

    def _check_share(self, database: sqlite3.Connection, owner: str, more: int) -> None:
        """Raises TooLarge where an owner's documents would take too much with `more` bytes."""
        if not owner or more <= 0:
            return
        sizes = (
            "SELECT total(bytes) FILTER (WHERE owner = ?1), total(bytes) FILTER (WHERE owner <> ?1) FROM documents"
        )
        stored, others = map(int, database.execute(sizes, (owner,)).fetchone())
        most = self._each
        if most is None and self._most is not None:
            most = max(0, self._most - others) // 2
        if most is not None and stored + more > most:
            raise TooLarge(
                f"With it your saved documents would take {stored + more} bytes; {most} are allowed "
                "(SUNBOX_MAX_KEY_DOCUMENTS). Delete some first."
            )


def _listed(titles: dict[str, str]) -> list[dict[str, str]]:
    return [{"name": name, "title": title} for title, name in sorted((titles[name], name) for name in titles)]


def _note_read(database: sqlite3.Connection, key: tuple[str, str, str], reader: str) -> None:
    """Note that a document by link was read, which gives its assets to the reader: once a day, and not where the disk
    is full."""
    now = time.time()
    known = "SELECT 1 FROM document_readers WHERE kind = ? AND name = ? AND owner = ? AND reader = ?"
    with suppress(sqlite3.OperationalError), database:
        database.execute(
            "UPDATE document_links SET read_at = ? WHERE kind = ? AND name = ? AND owner = ? AND read_at < ?",
            (now, *key, now - DAY_S),
        )
        if reader not in ("", key[2]) and database.execute(known, (*key, reader)).fetchone() is None:
            database.execute("INSERT OR IGNORE INTO document_readers VALUES (?, ?, ?, ?)", (*key, reader))


def _expire(database: sqlite3.Connection) -> None:
    """Delete documents by link that nobody has read for LINK_DAYS; their assets are no longer in use then."""
    last = time.time() - LINK_DAYS * DAY_S
    old = database.execute("SELECT kind, name, owner FROM document_links WHERE read_at < ?", (last,)).fetchall()
    for table in TABLES:
        database.executemany(f"DELETE FROM {table} WHERE kind = ? AND name = ? AND owner = ?", old)
    if old:
        log.info(f"deleted documents that nobody had read by their links for {LINK_DAYS} days", {"count": len(old)})


def check_kind(kind: str) -> Kind:
    """Raises NotFound for an unknown kind."""
    if kind not in KINDS:
        raise NotFound(f"there are no documents of {kind[:80]!r}; there are {', '.join(KINDS)}")
    return kind


def _missing(kind: str, name: str) -> NotFound:
    return NotFound(f"there is no {name[:LONGEST_NAME]!r} among the saved {kind}")
