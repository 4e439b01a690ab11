"""Renders, their documents and idempotency keys in the data folder's database."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Collection
from contextlib import ExitStack
from itertools import chain
from typing import NamedTuple

from service.problems import Internal
from service.server.renders.store.record import (
    End,
    IdempotencyKey,
    Order,
    Outcome,
    StoredRender,
    settings_json,
    stored_render,
)
from service.server.storage import callback_rows
from service.server.storage.asset_access import AllowedUses
from service.server.storage.database import Database

KEY_S = 24 * 3600.0  # of the contract: how long an idempotency key counts
MOST_KEYS = 10_000  # of one owner; the oldest go first
REMEMBERED = 10_000  # ids that are answered with "gone" and not with "unknown"

# Of a render by its number: the document that it stands on, and its patch.
DOCUMENT = (
    "SELECT body, patch FROM renders JOIN render_documents ON render_documents.number = base WHERE renders.number = ?"
)
_ALONE = "INDEXED BY renders_alone WHERE batch IS NULL"  # these have indices, as the rows of batches are many
_MEMBERS = "INDEXED BY renders_of_batches WHERE batch IS NOT NULL"
_UNDER_WAY = "state IN ('queued', 'running')"
_REMEMBERED = f"(SELECT number FROM renders {_ALONE} AND gone = 1 ORDER BY number DESC LIMIT ?)"
_COLUMNS = "number, id, owner, label, priority, created_at, settings, bytes, state, ended_at, outcome, gone"


class EndedMember(NamedTuple):
    """An ended render of a batch, which is given by its number."""

    batch: int
    step: int
    id: str
    state: End
    ended_at: float | None  # s since 1970


class RenderRows:
    """For any number of threads; not for an event loop. Raises Unavailable where the disk fails."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._open = ExitStack()

    def hold(self) -> None:
        """Keep a connection open, which `close` closes in the same thread.

        Closing the last one writes the log into the file and deletes it, and syncs both: three times what a commit
        takes.
        """
        connection = self._open.enter_context(self._database.open())
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()

    def close(self) -> None:
        self._open.close()

    def insert(
        self,
        order: Order,
        outcome: Outcome,
        document: bytes,
        uses: AllowedUses,
        key: IdempotencyKey | None,
        patch: bytes | None = None,
        base: int | None = None,
    ) -> int:
        """Store a render that waits; its number. `uses`: the assets that it refers to.

        Its scene is the `document` with `patch` merged in. `base`: the number of a render that brought the same
        document, which is not stored again while it is there.
        """
        settings = settings_json(order.settings)
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            values = (order.id, order.owner, order.label, order.priority, order.created_at, settings, order.bytes)
            number = database.execute(
                "INSERT INTO renders (id, owner, label, priority, created_at, settings, bytes, state, outcome, "
                "patch, base) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, "
                "(SELECT number FROM render_documents WHERE number = ?))",
                (*values, outcome.state, outcome.json(), patch, base),
            ).lastrowid
            assert number is not None
            if database.execute(
                "UPDATE renders SET base = number WHERE number = ? AND base IS NULL", (number,)
            ).rowcount:
                database.execute("INSERT INTO render_documents VALUES (?, ?)", (number, document))
            database.executemany(
                "INSERT OR IGNORE INTO render_uses VALUES (?, ?)", [(asset, number) for asset in uses.assets]
            )
            callback_rows.insert(database, "render", order.id, order.owner, order.callback, order.created_at)
            if key is not None:
                taken = (order.owner, key.key, key.digest, number, time.time())
                database.execute("INSERT OR REPLACE INTO render_keys VALUES (?, ?, ?, ?, ?)", taken)
                database.execute(
                    "DELETE FROM render_keys WHERE owner = ?1 AND taken_at <= (SELECT taken_at FROM render_keys "
                    "WHERE owner = ?1 ORDER BY taken_at DESC LIMIT 1 OFFSET ?2)",
                    (order.owner, MOST_KEYS),
                )
        return number

    def insert_member(self, order: Order, outcome: Outcome, batch: int, step: int) -> int:
        """Store a render that waits, or could not be made, of the document of a batch at a step; its number."""
        with self._database.open() as database, database:
            settings = settings_json(order.settings)
            values = (order.id, order.owner, order.label, order.priority, order.created_at, settings, order.bytes)
            database.execute(
                "INSERT INTO renders (id, owner, label, priority, created_at, settings, bytes, state, ended_at, "
                "outcome, batch, step) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (id) DO UPDATE "
                "SET state = excluded.state, ended_at = excluded.ended_at, outcome = excluded.outcome",
                (*values, outcome.state, outcome.ended_at, outcome.json(), batch, step),
            )
            (number,) = database.execute("SELECT number FROM renders WHERE id = ?", (order.id,)).fetchone()
        return int(number)

    def members(self) -> dict[str, tuple[int, int]]:
        """By the ids of renders of batches that have not ended: the batch's number, and the step."""
        if not self._database.exists():
            return {}
        with self._database.open() as database:
            rows = database.execute(f"SELECT id, batch, step FROM renders {_MEMBERS} AND {_UNDER_WAY}")
            return {id: (batch, step) for id, batch, step in rows}

    def ended_members(self) -> list[EndedMember]:
        """The renders of batches that have ended, each batch's one after the other."""
        if not self._database.exists():
            return []
        with self._database.open() as database:
            ended = f"{_MEMBERS} AND NOT ({_UNDER_WAY}) ORDER BY batch"
            rows = database.execute(f"SELECT batch, step, id, state, ended_at FROM renders {ended}")
            return list(map(EndedMember._make, rows))

    def one(self, id: str) -> StoredRender | None:
        """A render; None where it is deleted."""
        with self._database.open() as database:
            row = database.execute(f"SELECT {_COLUMNS} FROM renders WHERE id = ? AND NOT gone", (id,)).fetchone()
        return None if row is None else stored_render(*row)

    def step(self, number: int) -> tuple[bytes, str, int] | None:
        """The base, the axes and the step of a batch's render; None for any other render."""
        with self._database.open() as database:
            found: tuple[bytes, str, int] | None = database.execute(
                "SELECT batches.body, axes, step FROM renders JOIN batches ON batches.number = batch "
                "WHERE renders.number = ?",
                (number,),
            ).fetchone()
        return found

    def update(self, number: int, outcome: Outcome) -> None:
        values = (outcome.state, outcome.ended_at, outcome.json(), number)
        with self._database.open() as database, database:
            database.execute("UPDATE renders SET state = ?, ended_at = ?, outcome = ? WHERE number = ?", values)

    def document(self, number: int) -> tuple[bytes, bytes | None]:
        """The document that a render stands on, and its patch, both folded. Raises Internal where there is none."""
        with self._database.open() as database:
            row = database.execute(DOCUMENT, (number,)).fetchone()
        if row is None:
            raise Internal("The document of this render is not stored any more.")
        return row[0], row[1]

    def all(self) -> list[StoredRender]:
        """Every render but the ended ones of batches, in the order of arrival; those that are gone as far as their
        ids are remembered."""
        if not self._database.exists():
            return []
        with self._database.open() as database:
            alone = database.execute(
                f"SELECT {_COLUMNS} FROM renders {_ALONE} AND (NOT gone OR number IN {_REMEMBERED})", (REMEMBERED,)
            )
            of_batches = database.execute(f"SELECT {_COLUMNS} FROM renders {_MEMBERS} AND {_UNDER_WAY}")
            return sorted((stored_render(*row) for row in chain(alone, of_batches)), key=lambda each: each.number)

    def keyed(self, owner: str, key: str) -> tuple[str, StoredRender] | None:
        """The digest and the render of a key that was taken within KEY_S, also where the render is gone."""
        if not self._database.exists():
            return None
        with self._database.open() as database:
            found = database.execute(
                "SELECT digest, number FROM render_keys WHERE owner = ? AND key = ? AND taken_at > ?",
                (owner, key, time.time() - KEY_S),
            ).fetchone()
            if found is None:
                return None
            digest, number = found
            row = database.execute(f"SELECT {_COLUMNS} FROM renders WHERE number = ?", (number,)).fetchone()
        return None if row is None else (digest, stored_render(*row))

    def forget(self, numbers: Collection[int]) -> None:
        """Delete renders but for their ids, and forget what is too old even for that."""
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            ids = [(number,) for number in numbers]
            database.executemany(
                "UPDATE renders SET gone = 1, settings = '{}', outcome = '{}', patch = NULL WHERE number = ?", ids
            )
            database.executemany(
                "DELETE FROM render_documents WHERE number = (SELECT base FROM renders WHERE number = ?) "
                "AND NOT EXISTS (SELECT 1 FROM renders WHERE base = render_documents.number AND NOT gone)",
                ids,
            )
            database.executemany("UPDATE renders SET base = NULL WHERE number = ?", ids)
            database.executemany("DELETE FROM render_uses WHERE number = ?", ids)
            database.execute("DELETE FROM render_keys WHERE taken_at <= ?", (time.time() - KEY_S,))
            database.execute(
                f"DELETE FROM renders {_ALONE} AND gone AND number NOT IN (SELECT number FROM render_keys) "
                f"AND number NOT IN {_REMEMBERED}",
                (REMEMBERED,),
            )


def stored_renders(database: sqlite3.Connection) -> list[StoredRender]:
    """As `RenderRows.all`. Raises sqlite3.Error."""
    rows = database.execute(
        f"SELECT {_COLUMNS} FROM renders WHERE NOT gone OR number IN "
        "(SELECT number FROM renders WHERE gone ORDER BY number DESC LIMIT ?) ORDER BY number",
        (REMEMBERED,),
    )
    return [stored_render(*row) for row in rows]
