"""The tables of the data folder's database, as the ordered steps that made them: a new file takes all of them, too.

To add or change a table, append a migration. A migration that has been released is never edited: files that have
taken it would not get the change.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Migration:
    """Statements that bring the tables to the next version, all in one transaction."""

    about: str
    statements: tuple[str, ...]


# The number of migrations that a file has taken is its version, which SQLite keeps as `user_version`.
MIGRATIONS = (
    Migration(
        "documents in a table with row ids",
        (
            # Version 0 had these two tables. They are missing where the file is new.
            """CREATE TABLE IF NOT EXISTS documents (
                kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL,
                PRIMARY KEY (kind, name)
            ) WITHOUT ROWID""",
            """CREATE TABLE IF NOT EXISTS uses (
                asset TEXT NOT NULL, kind TEXT NOT NULL, name TEXT NOT NULL, PRIMARY KEY (asset, kind, name)
            ) WITHOUT ROWID""",
            # Looking for a name in a table without row ids reads the bodies on the way: 0.5 s beside one of 256 MiB.
            "ALTER TABLE documents RENAME TO former",
            """CREATE TABLE documents (
                kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL,
                PRIMARY KEY (kind, name)
            )""",
            "INSERT INTO documents SELECT kind, name, title, body FROM former",
            "DROP TABLE former",
        ),
    ),
    Migration(
        "renders that outlive the server",
        (
            # `number` rises in the order of arrival, also after the last ones were deleted.
            """CREATE TABLE renders (
                number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, owner TEXT NOT NULL, label TEXT,
                priority INTEGER NOT NULL, created_at REAL NOT NULL, settings TEXT NOT NULL, bytes INTEGER NOT NULL,
                state TEXT NOT NULL, ended_at REAL, outcome TEXT NOT NULL, gone INTEGER NOT NULL DEFAULT 0
            )""",
            # Documents have a table of their own, so that reading all renders does not read them.
            "CREATE TABLE render_documents (number INTEGER PRIMARY KEY, body BLOB NOT NULL)",
            """CREATE TABLE render_uses (
                asset TEXT NOT NULL, number INTEGER NOT NULL, PRIMARY KEY (number, asset)
            ) WITHOUT ROWID""",
            """CREATE TABLE render_keys (
                owner TEXT NOT NULL, key TEXT NOT NULL, digest TEXT NOT NULL, number INTEGER NOT NULL,
                taken_at REAL NOT NULL, PRIMARY KEY (owner, key)
            ) WITHOUT ROWID""",
        ),
    ),
    Migration(
        "documents with owners",
        (
            "ALTER TABLE documents RENAME TO former",
            # The body stands last: SQLite reads a row up to the last column that is asked for.
            """CREATE TABLE documents (
                kind TEXT NOT NULL, name TEXT NOT NULL, owner TEXT NOT NULL, shared INTEGER NOT NULL,
                title TEXT NOT NULL, bytes INTEGER NOT NULL, body TEXT NOT NULL, PRIMARY KEY (kind, name, owner)
            )""",
            # Until now they belonged to all.
            """INSERT INTO documents
                SELECT kind, name, '', 1, title, length(CAST(body AS BLOB)), body FROM former ORDER BY rowid""",
            "DROP TABLE former",
            "ALTER TABLE uses RENAME TO former",
            """CREATE TABLE uses (
                asset TEXT NOT NULL, kind TEXT NOT NULL, name TEXT NOT NULL, owner TEXT NOT NULL,
                PRIMARY KEY (asset, kind, name, owner)
            ) WITHOUT ROWID""",
            "INSERT INTO uses SELECT asset, kind, name, '' FROM former",
            "DROP TABLE former",
        ),
    ),
    Migration(
        "who uploaded which assets",
        (
            """CREATE TABLE asset_owners (
                owner TEXT NOT NULL, asset TEXT NOT NULL, bytes INTEGER NOT NULL, PRIMARY KEY (owner, asset)
            ) WITHOUT ROWID""",
        ),
    ),
    Migration(
        "small rows of renders that are gone, and old keys and assets that are found at once",
        (
            "UPDATE renders SET settings = '{}', outcome = '{}' WHERE gone",
            "CREATE INDEX render_keys_by_age ON render_keys (owner, taken_at)",
            "CREATE INDEX asset_owners_by_asset ON asset_owners (asset)",
        ),
    ),
    Migration(
        "documents that only a link leads to",
        (
            # Beside the documents, so that a read does not write a whole row again.
            """CREATE TABLE document_links (
                kind TEXT NOT NULL, name TEXT NOT NULL, owner TEXT NOT NULL, read_at REAL NOT NULL,
                PRIMARY KEY (kind, name, owner)
            ) WITHOUT ROWID""",
            # Until now the editor saved them as shared, under names that it drew.
            f"UPDATE documents SET shared = 2 WHERE shared AND name GLOB 'shared-{'[0-9a-f]' * 16}'",
            """INSERT INTO document_links
                SELECT kind, name, owner, CAST(strftime('%s', 'now') AS REAL) FROM documents WHERE shared = 2""",
        ),
    ),
    Migration(
        "renders that use an asset are found at once",
        ("CREATE INDEX render_uses_by_asset ON render_uses (asset)",),
    ),
    Migration(
        "documents that several renders stand on, each with a merge patch of its own",
        (
            # A document has the number of the render that brought it; `base` is the number of a render's document.
            "ALTER TABLE renders ADD COLUMN base INTEGER",
            "ALTER TABLE renders ADD COLUMN patch BLOB",
            "UPDATE renders SET base = number WHERE NOT gone",
            "CREATE INDEX renders_by_base ON renders (base)",
        ),
    ),
    Migration(
        "batches, whose renders have no documents of their own",
        (
            # The body stands last, as it is read seldom. `key` is the idempotency key of the request.
            """CREATE TABLE batches (
                number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, owner TEXT NOT NULL, label TEXT,
                priority INTEGER NOT NULL, created_at REAL NOT NULL, renders INTEGER NOT NULL, bytes INTEGER NOT NULL,
                key TEXT, digest TEXT, cancelled INTEGER NOT NULL DEFAULT 0, axes TEXT NOT NULL, body BLOB NOT NULL
            )""",
            """CREATE TABLE batch_uses (
                asset TEXT NOT NULL, number INTEGER NOT NULL, PRIMARY KEY (number, asset)
            ) WITHOUT ROWID""",
            "CREATE INDEX batch_uses_by_asset ON batch_uses (asset)",
            # A render's batch by its number, and the place in it.
            "ALTER TABLE renders ADD COLUMN batch INTEGER",
            "ALTER TABLE renders ADD COLUMN step INTEGER",
            "CREATE INDEX renders_by_batch ON renders (batch) WHERE batch IS NOT NULL",
        ),
    ),
    Migration(
        "callbacks",
        (
            # `subject` is the id of a render or a batch. The body stands last, as it is read seldom.
            """CREATE TABLE callbacks (
                number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, owner TEXT NOT NULL,
                kind TEXT NOT NULL, subject TEXT NOT NULL, host TEXT NOT NULL, url TEXT NOT NULL, state TEXT NOT NULL,
                attempts INTEGER NOT NULL DEFAULT 0, created_at REAL NOT NULL, next_at REAL, ended_at REAL,
                answer INTEGER, error TEXT, body TEXT
            )""",
            "CREATE INDEX callbacks_by_turn ON callbacks (state, next_at)",
            "CREATE INDEX callbacks_by_owner ON callbacks (owner, state, number)",
            "CREATE INDEX callbacks_by_subject ON callbacks (subject)",
        ),
    ),
    Migration(
        "who has read a document that a link leads to, and one batch of an idempotency key",
        (
            # Reading it gives its assets to the reader, for as long as the link leads there.
            """CREATE TABLE document_readers (
                kind TEXT NOT NULL, name TEXT NOT NULL, owner TEXT NOT NULL, reader TEXT NOT NULL,
                PRIMARY KEY (kind, name, owner, reader)
            ) WITHOUT ROWID""",
            # Until now requests that came at once made one each.
            """UPDATE batches SET key = NULL WHERE key IS NOT NULL AND number NOT IN
                (SELECT max(number) FROM batches WHERE key IS NOT NULL GROUP BY owner, key)""",
            "CREATE UNIQUE INDEX batches_by_key ON batches (owner, key) WHERE key IS NOT NULL",
        ),
    ),
    Migration(
        "ended renders of batches that are found without their rows, which take 4 KB each",
        (
            "DROP INDEX renders_by_batch",
            "CREATE INDEX renders_of_batches ON renders (batch, state, step, ended_at, id) WHERE batch IS NOT NULL",
            "CREATE INDEX renders_alone ON renders (gone, number) WHERE batch IS NULL",
        ),
    ),
)
VERSION = len(MIGRATIONS)
