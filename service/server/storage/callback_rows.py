"""Callbacks in the data folder's database: which ends of renders and batches are to be told, and to whom."""

from __future__ import annotations

import secrets
import sqlite3
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

from service.callback_hosts import origin_of
from service.server.storage.database import Database

RETAINED = 1000  # delivered ones of one owner, and as many failed ones
RETAINED_S = 30 * 86_400.0  # after their end

Kind = Literal["render", "batch"]
State = Literal["waiting", "due", "delivered", "failed"]

_COLUMNS = (
    "number, id, owner, kind, subject, host, url, state, attempts, created_at, next_at, ended_at, answer, error, body"
)


@dataclass(frozen=True)
class Callback:
    """`number` rises in the order of arrival. Times in s since 1970."""

    number: int
    id: str  # which the receiver is told, each time the same
    owner: str
    kind: Kind
    subject: str  # the id of the render or batch
    host: str  # the same for all ways to write it, with its port where that is not the scheme's
    url: str
    state: State  # waiting: its render goes on; due: to be sent, or sent again
    attempts: int
    created_at: float
    next_at: float | None  # of a due one: the next attempt
    ended_at: float | None
    answer: int | None  # HTTP status of the last attempt
    error: str | None  # why the last attempt failed
    body: str | None  # JSON, as soon as its render has ended


def insert(
    database: sqlite3.Connection, kind: Kind, subject: str, owner: str, url: str | None, created_at: float
) -> None:
    """Store one in the transaction that stores its render or batch; nothing where there is no URL."""
    if url is not None:
        database.execute(
            "INSERT INTO callbacks (id, owner, kind, subject, host, url, state, created_at) "
            "VALUES (?, ?, ?, ?, ?, ?, 'waiting', ?)",
            (f"msg_{secrets.token_hex(12)}", owner, kind, subject, str(origin_of(url)), url, created_at),
        )


class CallbackRows:
    """For any number of threads; not for an event loop. Raises Unavailable where the disk fails."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def waiting(self) -> list[Callback]:
        """Those whose render had not ended, or of which the server did not learn that."""
        if not self._database.exists():
            return []
        with self._database.open() as database:
            return _found(database, "WHERE state = 'waiting' ORDER BY number")

    def pending(self) -> Counter[str]:
        """How many have not ended, by owner."""
        if not self._database.exists():
            return Counter()
        with self._database.open() as database:
            query = "SELECT owner, count(*) FROM callbacks WHERE state IN ('waiting', 'due') GROUP BY owner"
            return Counter(dict(database.execute(query).fetchall()))

    def make_due(self, kind: Kind, subject: str, body: str, now: float) -> None:
        with self._database.open() as database, database:
            database.execute(
                "UPDATE callbacks SET state = 'due', body = ?, next_at = ? "
                "WHERE kind = ? AND subject = ? AND state = 'waiting'",
                (body, now, kind, subject),
            )

    def next(
        self, owners: Sequence[str], hosts: Collection[str], ids: Collection[str], now: float
    ) -> Callback | None:
        """The one that is due first, of the first of these owners that has one which is due by now; where none has,
        the one that will be due first. Those of `hosts` and of `ids` are left out."""
        later: Callback | None = None
        with self._database.open() as database:
            for owner in owners:
                found = _found(
                    database,
                    f"WHERE state = 'due' AND owner = ? AND host NOT IN ({_marks(hosts)}) "
                    f"AND id NOT IN ({_marks(ids)}) ORDER BY next_at LIMIT 1",
                    owner,
                    *hosts,
                    *ids,
                )
                if found and _next_at(found[0]) <= now:
                    return found[0]
                later = min((each for each in (later, *found) if each is not None), key=_next_at, default=None)
        return later

    def attempted(self, callback: Callback) -> None:
        """Store what became of it. Of ended ones the oldest are deleted."""
        with self._database.open() as database, database:
            database.execute("BEGIN IMMEDIATE")
            database.execute(
                "UPDATE callbacks SET state = ?, attempts = ?, next_at = ?, ended_at = ?, answer = ?, error = ? "
                "WHERE number = ?",
                (
                    callback.state, callback.attempts, callback.next_at, callback.ended_at, callback.answer,
                    callback.error, callback.number,
                ),
            )  # fmt: skip
            if callback.ended_at is None:
                return
            database.execute("DELETE FROM callbacks WHERE ended_at <= ?", (callback.ended_at - RETAINED_S,))
            database.execute(
                "DELETE FROM callbacks WHERE owner = ?1 AND state = ?2 AND number <= (SELECT number FROM callbacks "
                "WHERE owner = ?1 AND state = ?2 ORDER BY number DESC LIMIT 1 OFFSET ?3)",
                (callback.owner, callback.state, RETAINED),
            )

    def listed(self, owner: str, state: State | None, limit: int, after: str | None) -> list[Callback]:
        """An owner's, the newest first; those from before `after`, which may be unknown: then there are none."""
        if not self._database.exists():
            return []
        with self._database.open() as database:
            return _found(
                database,
                "WHERE owner = ?1 AND (?2 IS NULL OR state = ?2) AND (?3 IS NULL OR number < "
                "(SELECT number FROM callbacks WHERE owner = ?1 AND id = ?3)) ORDER BY number DESC LIMIT ?4",
                owner, state, after, limit,
            )  # fmt: skip


def _next_at(callback: Callback) -> float:
    return callback.next_at or 0.0


def _found(database: sqlite3.Connection, condition: str, *values: object) -> list[Callback]:
    return [Callback(*row) for row in database.execute(f"SELECT {_COLUMNS} FROM callbacks {condition}", values)]


def _marks(values: Collection[str]) -> str:
    return ", ".join("?" * len(values))
