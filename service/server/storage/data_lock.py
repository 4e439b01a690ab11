"""One server at a time on a data folder: two would miscount the quota, and both continue the same renders.

Commands need no lock: assets, and documents in SQLite, which they share with a server, have their own locks.
"""

from __future__ import annotations

import fcntl
import logging
import os
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

log = logging.getLogger(__name__)

FILE = "server.lock"  # in the data folder; the file stays, only the lock on it matters
WAIT_S = 3.0  # for a server that is just ending
STEP_S = 0.05
IN_USE = (
    "another Sunbox server ({holder}) uses the data folder {folder}; stop that server, "
    "or set SUNBOX_DATA_DIR to another folder for this one"
)


class FolderInUse(Exception):
    """Another server uses the folder; the text is for the person who started this one."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """A context in which the folder belongs to this process; a process that ends loses it. Raises FolderInUse.

    A folder that cannot be written, or whose file system has no locks, is used without one.
    """
    with ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            file = os.open(folder / FILE, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            stack.callback(os.close, file)
            _lock(file, folder)
        except OSError as error:
            log.warning("could not lock the data folder", {"folder": folder, "error": error})
        yield


def holder(folder: Path) -> str | None:
    """The server that uses a data folder, as `process PID on HOST`; None where none does, or none is known."""
    try:
        fd = os.open(folder / FILE, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        fcntl.flock(fd, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _name(fd)
    except OSError:
        return None
    finally:
        os.close(fd)
    return None


def _lock(file: int, folder: Path) -> None:
    """Raises FolderInUse, and OSError where there are no locks."""
    until = time.monotonic() + WAIT_S
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            break
        except BlockingIOError:
            if time.monotonic() > until:
                raise FolderInUse(IN_USE.format(holder=_name(file), folder=folder)) from None
            time.sleep(STEP_S)
    with suppress(OSError):  # a full disk
        os.ftruncate(file, 0)
        os.pwrite(file, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)


def _name(file: int) -> str:
    return os.pread(file, 300, 0).decode(errors="replace").strip() or "its name is not known yet"
