"""A check that the stored renders of a data folder are sound. Nothing is written, and a server may use the folder."""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from service.document import load_json
from service.problems import ServiceError
from service.server.renders.store.pictures import KINDS, PART, SUFFIXES, DamagedPicture, PictureFiles
from service.server.renders.store.record import StoredRender
from service.server.renders.store.rows import DOCUMENT, stored_renders
from service.server.storage.data_check import Report, is_here, reading
from service.server.storage.database import FILE
from service.server.storage.lost_pictures import FOLDER, KEEP
from service.server.storage.stores import RENDERS


def check_renders(folder: Path, report: Report) -> int:
    """How many renders there are; what is wrong with them is added to the report. Raises OSError."""
    if not (folder / FILE).exists():
        return 0
    count, known, gone = 0, set[str](), set[str]()
    files = PictureFiles(folder / RENDERS)
    try:
        with closing(reading(folder / FILE)) as database:
            if database.execute("SELECT count(*) FROM sqlite_master WHERE name = 'renders'").fetchone() == (0,):
                return 0  # an earlier version, which is migrated at a start
            for render in stored_renders(database):
                names = {files.path(render.order.id, kind).name for kind in KINDS}
                if render.gone:
                    gone |= names
                    continue
                count += 1
                known |= names
                for fault in _faults(folder, database, files, render):
                    if _is_stored(folder, render):  # it may have made room meanwhile
                        report.faults.append(f"renders/{render.order.id}: {fault}")
    except sqlite3.Error as error:
        report.faults.append(f"{FILE}: the renders cannot be read: {error}")
        return count
    if report.server is None:
        report.notes += _notes(files, folder / RENDERS, known, gone)
    return count


def _notes(files: PictureFiles, folder: Path, known: set[str], gone: set[str]) -> Iterator[str]:
    """Lines on what the next start moves or deletes."""
    for path in sorted(folder.iterdir() if folder.exists() else ()):
        if path.name.endswith(PART):
            yield f"{RENDERS}/{path.name}: left half-written by a crash; it is deleted at a start"
        elif path.name in gone:
            yield f"{RENDERS}/{path.name}: left without its render; it is deleted at a start"
        elif path.name.endswith(SUFFIXES) and path.name not in known:
            yield (
                f"{RENDERS}/{path.name}: the database does not know its render; a start moves it to "
                f"{RENDERS}/{FOLDER}, and back where a backup of the database knows it"
            )
    lost = files.lost.names()
    if back := [name for name in lost if name in known]:
        yield f"{RENDERS}/{FOLDER}: the renders of {len(back)} pictures are known again; a start moves them back"
    if left := len(lost) - len(back):
        stay = "they stay" if (files.lost.path / KEEP).exists() else "they make room where some is needed"
        yield f"{RENDERS}/{FOLDER}: the database does not know the renders of {left} pictures; {stay}"


def _faults(folder: Path, database: sqlite3.Connection, files: PictureFiles, render: StoredRender) -> Iterator[str]:
    if render.unfit is not None:
        yield f"its row cannot be read: {render.unfit}"
        return
    row = database.execute(_document(database), (render.number,)).fetchone() or _of_batch(database, render.number)
    if row is None:
        yield "its document is not there"
    for name, body in zip(("document", "patch"), row or (), strict=False):
        try:
            load_json(zlib.decompress(body)) if body is not None else None
        except (zlib.error, ServiceError) as error:
            yield f"its {name} is damaged: {error}"
    uses = database.execute("SELECT asset FROM render_uses WHERE number = ? ORDER BY asset", (render.number,))
    for (asset,) in uses.fetchall():
        if not is_here(folder, asset):
            yield f"there is no asset {asset}"
    found = files.path(render.order.id, "picture").name in files.lost.names()  # from where a start brings it back
    for kind in KINDS:
        try:
            files.read(render.order.id, kind, 0)
            found = True
        except FileNotFoundError:
            continue
        except DamagedPicture as error:
            yield f"its {kind} is damaged: {error}"
            found = True
        except OSError as error:
            yield f"its {kind} cannot be read: {error.strerror or error}"
            found = True
    if not found and render.outcome.state == "done" and render.outcome.progress.samples:
        yield "its picture is not there"


def _document(database: sqlite3.Connection) -> str:
    """The query for a render's document; an earlier version, whose file is not migrated yet, has one for each."""
    shared = any(column[1] == "base" for column in database.execute("PRAGMA table_info(renders)"))
    return DOCUMENT if shared else "SELECT body FROM render_documents WHERE number = ?"


def _of_batch(database: sqlite3.Connection, number: int) -> tuple[bytes] | None:
    """The body of a render's batch, which says what varies; None where it is not one of a batch."""
    if not any(column[1] == "batch" for column in database.execute("PRAGMA table_info(renders)")):
        return None
    query = "SELECT body FROM batches JOIN renders ON renders.batch = batches.number WHERE renders.number = ?"
    found: tuple[bytes] | None = database.execute(query, (number,)).fetchone()
    return found


def _is_stored(folder: Path, render: StoredRender) -> bool:
    with closing(reading(folder / FILE)) as database:
        row = database.execute("SELECT gone FROM renders WHERE number = ?", (render.number,)).fetchone()
    return bool(row == (0,))
