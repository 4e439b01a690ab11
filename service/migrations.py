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
)
VERSION = len(MIGRATIONS)
