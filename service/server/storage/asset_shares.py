"""Bounds on the assets of one key: where they take too much, its own longest unused ones are deleted."""

from __future__ import annotations

import json
import logging
import threading
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from service.problems import TooLarge, Unavailable
from service.server.storage.database import Database
from service.server.storage.quota import RETRY_S, Quota
from service.system.disk_usage import Usage

log = logging.getLogger(__name__)


class AssetShares:
    """For any number of threads; not for an event loop. An owner is a text; "" has no bound.

    An asset that several owners uploaded counts for each of them, and goes only with the last one.
    """

    def __init__(self, folder: Path, quota: Quota, each: int | None) -> None:
        self._database = Database(folder)
        self._quota = quota
        self._each = each  # bytes; None: no bound
        self._lock = threading.Lock()
        self._pending: Counter[str] = Counter()  # bytes that are being stored, by owner

    @contextmanager
    def room(self, owner: str, size: Usage) -> Iterator[None]:
        """A context in which an owner's upload can be stored.

        Raises TooLarge for an upload that never fits, Unavailable where too many assets are in use.
        """
        bounded = bool(owner) and self._each is not None
        if bounded:
            with self._lock:
                self._make_room(owner, size.bytes)
                self._pending[owner] += size.bytes
        try:
            with self._quota.room(size):
                yield
        finally:
            if bounded:
                with self._lock:
                    self._pending[owner] -= size.bytes

    def uploaded(self, owner: str, ids: Collection[str]) -> None:
        """Note that an owner uploaded these assets, or a scene with these parts.

        Also assets that others uploaded earlier need room: else an owner without room would learn that they exist.
        Raises what `room` raises.
        """
        if not owner:
            return
        with self._quota.pinned(ids), self._lock:
            sizes = self._quota.sizes(ids)
            if self._each is not None:
                known = self._owned_of(owner, ids)
                if more := sum(size for id, size in sizes.items() if id not in known):
                    self._make_room(owner, more)
            self._note(owner, sizes)

    def imported(self, owner: str, scene: str, parts: Collection[str]) -> None:
        """Note the parts of an owner's scene, some of which may have been deleted and made again."""
        if not owner or not self._database.exists():
            return
        known = self._owned_of(owner, [scene, *parts])
        if scene in known and not known.issuperset(parts):
            self._note(owner, self._quota.sizes(parts))

    def owned(self) -> list[tuple[str, str, int]]:
        """Who uploaded what: owner, id and bytes. Raises Unavailable."""
        if not self._database.exists():
            return []
        with self._database.open() as database:
            return database.execute("SELECT owner, asset, bytes FROM asset_owners").fetchall()

    def clear(self) -> None:
        """Forget the assets that no longer exist. To be called once, as anything may have deleted them."""
        if self._database.exists():
            try:
                with self._database.open() as database:
                    ids = [id for (id,) in database.execute("SELECT DISTINCT asset FROM asset_owners")]
                self.forget(ids)
            except Unavailable as error:
                log.warning("could not look for uploads that are deleted", {"error": error})

    def forget(self, ids: Collection[str]) -> None:
        """Delete the rows of those of these assets that no longer exist. Raises Unavailable."""
        if self._database.exists():
            with self._database.open() as database, database:
                database.execute("BEGIN IMMEDIATE")  # an owner that uploads one again adds its row afterwards
                gone = [(id,) for id in set(ids) - self._quota.sizes(ids).keys()]
                database.executemany("DELETE FROM asset_owners WHERE asset = ?", gone)

    def _note(self, owner: str, sizes: dict[str, int]) -> None:
        rows = [(owner, id, size) for id, size in sizes.items()]
        with self._database.open() as database, database:
            database.executemany("INSERT OR REPLACE INTO asset_owners VALUES (?, ?, ?)", rows)

    def _owned_of(self, owner: str, ids: Collection[str]) -> set[str]:
        """Those of these assets that this owner is known to have uploaded."""
        mine = "SELECT asset FROM asset_owners WHERE owner = ? AND asset IN (SELECT value FROM json_each(?))"
        with self._database.open() as database:
            return {id for (id,) in database.execute(mine, (owner, json.dumps(list(ids))))}

    def _make_room(self, owner: str, size: int) -> None:
        assert self._each is not None
        if size > self._each:
            raise TooLarge(
                f"{size} bytes are more than one key's assets may take: {self._each} (SUNBOX_MAX_KEY_ASSETS)"
            )
        if self._over(owner, size) <= 0:
            return
        with self._database.open() as database, database:
            mine = [id for (id,) in database.execute("SELECT asset FROM asset_owners WHERE owner = ?", (owner,))]
            others = "SELECT asset FROM asset_owners WHERE owner <> ?"
            shared = {id for (id,) in database.execute(others, (owner,))}
        self.forget(mine)  # as far as they are deleted, for whatever reason
        over = self._over(owner, size)
        if over > 0:
            self._quota.evict([id for id in mine if id not in shared], over)
        if self._over(owner, size) > 0:
            detail = "Your assets that saved documents and renders use take all that one key's may"
            raise Unavailable(f"{detail} (SUNBOX_MAX_KEY_ASSETS).", RETRY_S)

    def _over(self, owner: str, size: int) -> int:
        """By how many bytes `size` more exceed the bound."""
        assert self._each is not None
        with self._database.open() as database:
            row = database.execute("SELECT total(bytes) FROM asset_owners WHERE owner = ?", (owner,)).fetchone()
        return int(row[0]) + self._pending[owner] + size - self._each
