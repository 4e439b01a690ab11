"""The data folder's SQLite file: its version, its connections, and the errors that they raise."""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

from service.problems import Unavailable
from service.server.storage.migrations import MIGRATIONS, VERSION
from service.system.disk_usage import FULL, Usage, trouble

log = logging.getLogger(__name__)

FILE = "documents.sqlite3"  # in the data folder
BUSY_S = 10.0  # how long a writer waits for another one
LOG_BYTES = 4 << 20  # to which the log is cut after a large document; SQLite does not shrink it while others read


class DamagedFile(Exception):
    """The database cannot be used as it is; the text is for the person who started the service."""


class Database:
    """For any number of threads and processes; not for an event loop."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE

    def prepare(self) -> None:
        """Read all of the file, and migrate one of an earlier version, which may take as long as copying it.

        Raises DamagedFile.
        """
        if not self.exists():
            return
        try:
            with self._connected() as database:
                if database.execute("PRAGMA auto_vacuum").fetchone() == (0,):
                    database.execute("PRAGMA auto_vacuum = FULL")
                    database.execute("VACUUM")
                tables = database.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
                for (table,) in tables:
                    database.execute(f'SELECT count(*) FROM "{table}"').fetchone()
        except (OSError, sqlite3.Error) as error:
            if getattr(error, "sqlite_errorcode", 0) == sqlite3.SQLITE_FULL:
                log.warning("could not migrate or compact the database", {"file": self.path, "error": error})
            elif isinstance(error, sqlite3.OperationalError | OSError):
                # Such an error may pass: a lock, or missing rights.
                log.error("could not open the database", {"file": self.path, "error": error})
            else:
                raise DamagedFile(
                    f"the database is damaged ({error}): {self.path}; put a backup in its place, "
                    "or move it away to start with none"
                ) from None

    def exists(self) -> bool:
        try:
            return self.path.exists()
        except PermissionError:  # of the folder; to open the file then fails, and that is reported
            return True

    @contextmanager
    def open(self) -> Iterator[sqlite3.Connection]:
        """A connection to the tables of this version, closed at the end. Raises Unavailable where the disk fails.

        Other exceptions of the caller's own code pass unchanged.
        """
        with ExitStack() as stack:
            with self._explained(OSError, sqlite3.Error):
                database = stack.enter_context(self._connected())
            with self._explained(sqlite3.Error):
                yield database

    @contextmanager
    def _explained(self, *of_the_disk: type[Exception]) -> Iterator[None]:
        """Raise Unavailable for the errors of a failing disk."""
        try:
            yield
        except DamagedFile as error:
            log.error("could not use the database", {"reason": error})
            raise Unavailable("The server's database was written by a newer version of Sunbox.", 30) from None
        except (sqlite3.ProgrammingError, sqlite3.InterfaceError):
            raise  # a mistake in the code, such as a connection that another thread uses
        except of_the_disk as error:
            log.error("could not reach the database", {"file": self.path, "error": error})
            if getattr(error, "sqlite_errorcode", 0) == sqlite3.SQLITE_BUSY:
                raise Unavailable("Others are writing to the database just now.", 1) from None
            is_full = getattr(error, "sqlite_errorcode", 0) == sqlite3.SQLITE_FULL
            detail = FULL if is_full else trouble(error, self.path.parent)
            raise Unavailable(f"The database cannot be reached: {detail}.", 30) from None

    def usage(self) -> Usage:
        """Bytes of the file's used pages, without the log beside it, which is deleted when the file is closed."""
        if not self.exists():
            return Usage()
        with self.open() as database:
            pages, free, size = (
                database.execute(f"PRAGMA {name}").fetchone()[0]
                for name in ("page_count", "freelist_count", "page_size")
            )
        return Usage(int((pages - free) * size), 1)

    @contextmanager
    def _connected(self) -> Iterator[sqlite3.Connection]:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with closing(sqlite3.connect(self.path, timeout=BUSY_S)) as database:
            if database.execute("PRAGMA page_count").fetchone() == (0,):
                # Free pages return to the disk at every commit. This must be chosen before anything is written.
                database.execute("PRAGMA auto_vacuum = FULL")
            # A write-ahead log, synced at every commit: data of a request that was answered is on the disk, and
            # whole.
            database.execute("PRAGMA journal_mode = WAL")
            database.execute("PRAGMA synchronous = FULL")
            database.execute(f"PRAGMA journal_size_limit = {LOG_BYTES}")
            self._migrate(database)
            yield database

    def _migrate(self, database: sqlite3.Connection) -> None:
        """Run each migration in one transaction, so that an interrupted one changes nothing; those of a new file in
        one."""
        while (version := _version(database)) < VERSION:
            with database:
                database.execute("BEGIN IMMEDIATE")
                if _version(database) != version:  # another process was faster
                    continue
                is_new = version == 0 and database.execute("SELECT count(*) FROM sqlite_master").fetchone() == (0,)
                reached = VERSION if is_new else version + 1
                if not is_new:
                    log.info("migrating the database", {"file": self.path, "to": reached})
                for migration in MIGRATIONS[version:reached]:
                    for statement in migration.statements:
                        database.execute(statement)
                database.execute(f"PRAGMA user_version = {reached}")
        if version > VERSION:
            raise DamagedFile(f"a newer version of Sunbox wrote the database: {self.path}")


def _version(database: sqlite3.Connection) -> int:
    return int(database.execute("PRAGMA user_version").fetchone()[0])
