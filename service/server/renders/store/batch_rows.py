"""Batches in the data folder's database: what is sent once for all renders of each."""

from __future__ import annotations

import time
from dataclasses import dataclass

from service.server.renders.store.record import IdempotencyKey
from service.server.renders.store.rows import KEY_S
from service.server.storage import callback_rows
from service.server.storage.asset_access import AllowedUses
from service.server.storage.database import Database


@dataclass(frozen=True)
class BatchOrder:
    """A batch as it was asked for. `axes` as JSON, `bytes` what it takes in the store."""

    id: str
    owner: str
    renders: int
    axes: str
    label: str | None = None
    priority: int = 0
    created_at: float = 0.0  # s since 1970
    bytes: int = 0
    callback: str | None = None  # URL that is told of its end; not there where the order comes from the store


@dataclass(frozen=True)
class StoredBatch:
    """`number` rises in the order of arrival."""

    number: int
    order: BatchOrder
    cancelled: bool


class BatchRows:
    """For any number of threads; not for an event loop. Raises Unavailable where the disk fails."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def insert(self, order: BatchOrder, body: bytes, uses: AllowedUses, key: IdempotencyKey | None) -> int:
        """Store a batch; its number. `body`: its folded `{scene, settings}`, `uses`: its assets."""
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            if key is not None:  # which is free again where it is too old
                database.execute(
                    "UPDATE batches SET key = NULL WHERE owner = ? AND key = ? AND created_at <= ?",
                    (order.owner, key.key, time.time() - KEY_S),
                )
            number = database.execute(
                "INSERT INTO batches (id, owner, label, priority, created_at, renders, bytes, key, digest, axes, "
                "body) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    order.id, order.owner, order.label, order.priority, order.created_at, order.renders, order.bytes,
                    key.key if key else None, key.digest if key else None, order.axes, body,
                ),
            ).lastrowid  # fmt: skip
            assert number is not None
            database.executemany("INSERT INTO batch_uses VALUES (?, ?)", [(asset, number) for asset in uses.assets])
            callback_rows.insert(database, "batch", order.id, order.owner, order.callback, order.created_at)
        return number

    def all(self) -> list[StoredBatch]:
        """Every batch, in the order of arrival."""
        if not self._database.exists():
            return []
        with self._database.open() as database:
            rows = database.execute(
                "SELECT number, cancelled, id, owner, renders, axes, label, priority, created_at, bytes "
                "FROM batches ORDER BY number"
            )
            return [StoredBatch(number, BatchOrder(*order), bool(cancelled)) for number, cancelled, *order in rows]

    def body(self, number: int) -> bytes | None:
        """The folded `{scene, settings}` that varies; None where the batch was deleted."""
        with self._database.open() as database:
            row = database.execute("SELECT body FROM batches WHERE number = ?", (number,)).fetchone()
        return None if row is None else row[0]

    def keyed(self, owner: str, key: str) -> tuple[str, str] | None:
        """The digest and the id of the batch of an idempotency key that was taken within KEY_S."""
        if not self._database.exists():
            return None
        with self._database.open() as database:
            found: tuple[str, str] | None = database.execute(
                "SELECT digest, id FROM batches WHERE owner = ? AND key = ? AND created_at > ?",
                (owner, key, time.time() - KEY_S),
            ).fetchone()
        return found

    def cancel(self, number: int) -> None:
        with self._database.open() as database, database:
            database.execute("UPDATE batches SET cancelled = 1 WHERE number = ?", (number,))

    def forget(self, number: int) -> None:
        """Delete a batch and the rows of its renders."""
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            database.execute("DELETE FROM renders WHERE batch = ?", (number,))
            database.execute("DELETE FROM batch_uses WHERE number = ?", (number,))
            database.execute("DELETE FROM batches WHERE number = ?", (number,))
