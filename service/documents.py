"""Scenes and materials that users saved: documents by kind and name, in an SQLite file that survives a power cut."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import TypeAdapter

from service import recipe
from service.assets import AssetStore
from service.database import Database
from service.disk_usage import Usage, expected
from service.problems import FieldError, InvalidDocument, NotFound
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
_MATERIAL: TypeAdapter[Any] = TypeAdapter(Material)


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
        self._database = Database(folder)
        self._assets = assets
        self._quota = quota

    def prepare(self) -> None:
        """To be called once, before the server starts. Raises DamagedFile."""
        self._database.prepare()

    def names(self, kind: str) -> list[dict[str, str]]:
        """`[{name, title}]` in the order of the titles. Raises NotFound for an unknown kind."""
        check_kind(kind)
        with self._database.open() as database:
            rows = database.execute("SELECT name, title FROM documents WHERE kind = ? ORDER BY title, name", (kind,))
            return [{"name": name, "title": title} for name, title in rows]

    def get(self, kind: str, name: str) -> bytes:
        """The bare document, as JSON. Raises NotFound."""
        check_kind(kind)
        with self._database.open() as database:
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
            room = self._quota.room(expected([len(body.encode())])) if self._quota else nullcontext()
            with room, self._database.open() as database, database:
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
        with self._database.open() as database, database:
            deleted = database.execute("DELETE FROM documents WHERE kind = ? AND name = ?", (kind, name)).rowcount
            database.execute("DELETE FROM uses WHERE kind = ? AND name = ?", (kind, name))
        if not deleted:
            raise _missing(kind, name)
        log.info("document deleted kind=%s name=%s", kind, name)

    @contextmanager
    def assets_in_use(self) -> Iterator[set[str]]:
        """The ids of all assets that saved documents and renders refer to; while it lasts none of these is stored."""
        if not self._database.exists():
            yield set()
            return
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            yield {
                asset for (asset,) in database.execute("SELECT asset FROM uses UNION SELECT asset FROM render_uses")
            }

    def usage(self) -> Usage:
        """Of the database, whose unused pages don't count."""
        return self._database.usage()

    def _find_assets(self, document: CheckedDocument, uses: list[str]) -> None:
        """Raises InvalidDocument where one of them is not here."""
        missing = ((ref, why) for ref in uses if (why := self._assets.missing(ref)) is not None)
        first = dict(islice(missing, MOST_MISTAKES))
        if first:
            told = (FieldError(pointer, first[ref]) for pointer, ref in document.uses if ref in first)
            raise InvalidDocument(islice(told, MOST_MISTAKES))


def check_kind(kind: str) -> Kind:
    """Raises NotFound for an unknown kind."""
    if kind not in KINDS:
        raise NotFound(f"there are no documents of {kind[:80]!r}; there are {', '.join(KINDS)}")
    return kind


def _missing(kind: str, name: str) -> NotFound:
    return NotFound(f"there is no {name[:LONGEST_NAME]!r} among the saved {kind}")
