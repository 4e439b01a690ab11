"""A data folder outlives the version that made it, belongs to one server at a time, and is whole."""

from __future__ import annotations

import json
import logging
import os
import signal
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
import uvicorn

from service.config import Config
from service.problems import Unavailable
from service.server import launch
from service.server.storage import data_lock, database
from service.server.storage.data_check import Report, check
from service.server.storage.data_lock import FolderInUse, holder, locked
from service.server.storage.database import FILE, Database
from service.server.storage.documents import checked
from service.server.storage.migrations import MIGRATIONS, VERSION, Migration
from service.server.storage.stores import Storage, storage
from tests.service import frozen
from tests.service.frozen import FOLDERS, NAMES


@pytest.fixture(params=NAMES)
def opened(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Storage]:
    kept = storage(Config(data_dir=frozen.opened(request.param, tmp_path)))
    yield kept
    kept.assets.close()


def tables(folder: Path) -> list[str]:
    with closing(sqlite3.connect(folder / FILE)) as file:
        rows = file.execute("SELECT name, coalesce(sql, '') FROM sqlite_master ORDER BY name")
        return [" ".join(" ".join(row).split()) for row in rows]


def version(folder: Path) -> int:
    with closing(sqlite3.connect(folder / FILE)) as file:
        return int(file.execute("PRAGMA user_version").fetchone()[0])


def test_every_earlier_version_has_a_folder_here(tmp_path: Path) -> None:
    """Whoever adds a migration adds a folder that needs it."""
    assert sorted(path.name for path in FOLDERS.iterdir()) == NAMES
    assert set(range(VERSION)) <= {version(frozen.opened(name, tmp_path / name)) for name in NAMES}


def test_a_folder_of_an_earlier_version_opens(opened: Storage, tmp_path: Path) -> None:
    assert check(tmp_path).faults == []
    assert any("migrated" in note for note in check(tmp_path).notes) is (version(tmp_path) < VERSION)
    opened.documents.prepare()
    assert check(tmp_path) == Report(documents=2, assets=1)
    assert opened.documents.names("scenes")[0] == [{"name": "bunny", "title": "The bunny"}]
    assert opened.documents.names("materials")[0] == [{"name": "grey", "title": "grey"}]
    scene = json.loads(opened.documents.get("scenes", "bunny"))
    used = scene["shapes"][0]["asset"]
    with opened.documents.assets_in_use() as assets:
        assert used in assets
    assert opened.assets.info(used).triangles == 1
    again = checked("scenes", scene)  # it is still a valid scene
    assert opened.documents.put("scenes", "bunny", again) == ("The bunny", False)
    with Database(tmp_path / "new").open():
        pass
    assert tables(tmp_path) == tables(tmp_path / "new")


def test_many_may_open_an_old_folder_at_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "service")
    folder, names = frozen.opened("0", tmp_path / "old"), []

    def look() -> None:
        with Database(folder).open() as file:
            names.extend(file.execute("SELECT name FROM documents WHERE kind = 'scenes'").fetchall())

    threads = [threading.Thread(target=look) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert names == [("bunny",)] * 8
    assert caplog.text.count("migrating the database") == VERSION


def test_a_new_folder_is_not_migrated(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "service")
    with Database(tmp_path).open():
        assert "migrating" not in caplog.text and version(tmp_path) == VERSION


def test_a_migration_that_fails_has_done_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Database(tmp_path).open():
        before = tables(tmp_path)
    half = Migration("half of it", ("CREATE TABLE half (a)", "INSERT INTO missing VALUES (1)"))
    monkeypatch.setattr(database, "MIGRATIONS", (*MIGRATIONS, half))
    monkeypatch.setattr(database, "VERSION", VERSION + 1)
    with pytest.raises(Unavailable), Database(tmp_path).open():
        pass
    assert tables(tmp_path) == before
    whole = Migration("all of it", ("CREATE TABLE half (a)", "INSERT INTO half VALUES (1)"))
    monkeypatch.setattr(database, "MIGRATIONS", (*MIGRATIONS, whole))
    with Database(tmp_path).open() as file:
        assert file.execute("SELECT a FROM half").fetchall() == [(1,)]


@pytest.mark.parametrize("mistake", [OSError("mine"), GeneratorExit(), sqlite3.ProgrammingError("another thread")])
def test_what_a_caller_does_wrong_is_no_problem_of_the_disk(
    mistake: BaseException, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with pytest.raises(type(mistake)), Database(tmp_path).open():
        raise mistake
    assert not caplog.text
    with pytest.raises(Unavailable, match="disk"), Database(tmp_path).open() as file:
        file.execute("SELECT * FROM nothing")


HOLD = "import sys, time; from pathlib import Path; from service.server.storage.data_lock import locked\n"
HOLD += "with locked(Path(sys.argv[1])): print(flush=True); time.sleep(60)"


@pytest.fixture
def other(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process that has the folder, as a server does."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline()
    yield process
    process.kill()
    process.communicate()


def test_a_second_server_is_refused(
    other: subprocess.Popen[bytes], tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(data_lock, "WAIT_S", 0.1)
    monkeypatch.setattr(uvicorn.Server, "run", lambda self, sockets: pytest.fail("it was started"))
    assert launch.run(Config(port=0, data_dir=tmp_path)) == 1
    for part in (f"process {other.pid} on", "SUNBOX_DATA_DIR", str(tmp_path)):
        assert part in caplog.text
    assert "Traceback" not in caplog.text
    assert str(other.pid) in (holder(tmp_path) or "")


def test_the_kernel_frees_the_folder(other: subprocess.Popen[bytes], tmp_path: Path) -> None:
    """At once, also after a `kill -9`; a server that comes meanwhile waits for it."""
    threading.Timer(0.5, os.kill, (other.pid, signal.SIGKILL)).start()
    with locked(tmp_path):
        assert str(os.getpid()) in (holder(tmp_path) or "")
    assert holder(tmp_path) is None and holder(tmp_path / "none") is None
    with locked(tmp_path), pytest.raises(FolderInUse):
        data_lock.WAIT_S, before = 0.1, data_lock.WAIT_S
        try:
            with locked(tmp_path):
                pass
        finally:
            data_lock.WAIT_S = before


def test_a_folder_without_locks_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Of a network's file system, for example."""

    def flock(file: int, operation: int) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr("fcntl.flock", flock)
    with locked(tmp_path):
        assert "could not lock" in caplog.text and holder(tmp_path) is None
    (tmp_path / "a file").touch()
    with locked(tmp_path / "a file"):
        assert "a file" in caplog.text


def test_a_new_folder_has_the_newest_version(tmp_path: Path) -> None:
    with Database(tmp_path).open() as file:
        assert file.execute("PRAGMA user_version").fetchone() == (VERSION,)
        assert file.execute("PRAGMA auto_vacuum").fetchone() == (1,)
