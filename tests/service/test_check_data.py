"""`sunbox check-data` finds what is damaged, and nothing where all is well."""

from __future__ import annotations

import fcntl
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from service.cli import program as cli
from service.config import Config
from service.server.storage.data_check import Report, check
from service.server.storage.data_lock import locked
from service.server.storage.database import FILE
from service.server.storage.documents import checked
from service.server.storage.stores import Storage, storage
from tests.asset_files import OBJ
from tests.serving import SCENE


@pytest.fixture
def kept(tmp_path: Path) -> Iterator[Storage]:
    """A material, and a scene with a mesh."""
    kept = storage(Config(data_dir=tmp_path))
    mesh = kept.assets.add(OBJ).id
    kept.documents.put("scenes", "a", checked("scenes", mesh_scene(mesh)))
    kept.documents.put("materials", "m", checked("materials", {"type": "diffuse", "albedo": 0.5}))
    yield kept
    kept.assets.close()


def mesh_scene(asset: str) -> dict[str, Any]:
    return {**SCENE, "shapes": [{"type": "mesh", "asset": asset, "material": "ball"}]}


def mesh_of(folder: Path) -> Path:
    (found,) = (path for path in (folder / "assets").iterdir() if not path.suffix)
    return found


def change(folder: Path, statement: str, *values: Any) -> None:
    with closing(sqlite3.connect(folder / FILE)) as database, database:
        database.execute(statement, values)


def the_fault(folder: Path) -> str:
    (fault,) = check(folder).faults
    return fault


def test_a_sound_folder(kept: Storage, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def files() -> dict[str, tuple[int, int]]:
        return {str(path): (path.stat().st_mtime_ns, path.stat().st_size) for path in tmp_path.rglob("*")}

    before = files()
    assert check(tmp_path) == Report(documents=2, assets=1)
    assert files() == before  # nothing was written
    assert cli.main(["check-data", str(tmp_path)]) == 0
    assert "2 documents, 1 assets" in capsys.readouterr().out
    (tmp_path / "empty").mkdir()
    assert check(tmp_path / "empty") == Report()


def test_beside_a_server(kept: Storage, tmp_path: Path) -> None:
    """With the database open, and its log beside it."""
    with locked(tmp_path), closing(sqlite3.connect(tmp_path / FILE)) as database:
        database.execute("SELECT count(*) FROM documents").fetchone()
        kept.documents.put("materials", "n", checked("materials", {"type": "diffuse", "albedo": 0.5}))
        assert (tmp_path / (FILE + "-wal")).stat().st_size
        report = check(tmp_path)
        assert report.documents == 3 and not report.faults and "process" in (report.server or "")


def test_damaged_bytes(kept: Storage, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = mesh_of(tmp_path)
    path.write_bytes(path.read_bytes().replace(b"1", b"2"))
    assert path.name in the_fault(tmp_path) and "hash" in the_fault(tmp_path)
    assert cli.main(["check-data", str(tmp_path)]) == 1
    assert path.name in capsys.readouterr().err
    path.rename(path.with_name(path.name + ".damaged"))
    assert any("set aside" in fault for fault in check(tmp_path).faults)


@pytest.mark.parametrize("record", [b"{", b"{}", b'{"id": "sha256:0", "bytes": 5}'])
def test_a_damaged_record(record: bytes, kept: Storage, tmp_path: Path) -> None:
    path = mesh_of(tmp_path)
    path.with_name(path.name + ".json").write_bytes(record)
    assert "record" in the_fault(tmp_path)


def test_a_missing_asset(kept: Storage, tmp_path: Path) -> None:
    path = mesh_of(tmp_path)
    path.unlink()
    report = check(tmp_path)
    assert report.faults == [f"scenes/a: there is no asset sha256:{path.name}"]
    assert any(path.name + ".json" in note for note in report.notes)


def test_leftovers_are_notes(kept: Storage, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "assets" / ".abcd.tmp").write_bytes(b"half")
    (tmp_path / "assets" / ("c" * 64)).write_bytes(b"without a record")
    report = check(tmp_path)
    assert not report.faults
    assert {".abcd.tmp", "c" * 64} == {note.split(":")[0].removeprefix("assets/") for note in report.notes}
    assert cli.main(["check-data", str(tmp_path)]) == 0
    with open(tmp_path / "assets" / ".abcd.tmp", "rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # by the upload that writes it
        assert len(check(tmp_path).notes) == 1


def test_documents_that_say_something_else(kept: Storage, tmp_path: Path) -> None:
    change(tmp_path, 'UPDATE documents SET body = \'{"type": "diffuse", "albedo": 2}\' WHERE name = \'m\'')
    assert the_fault(tmp_path).startswith("materials/m: it is no valid document: /albedo")
    change(tmp_path, "UPDATE documents SET body = '{' WHERE name = 'm'")
    assert the_fault(tmp_path).startswith("materials/m:")
    change(tmp_path, "DELETE FROM documents WHERE name = 'm'")
    change(tmp_path, "DELETE FROM uses")
    assert the_fault(tmp_path).startswith("scenes/a: the assets")


def test_a_damaged_database(kept: Storage, tmp_path: Path) -> None:
    file = tmp_path / FILE
    whole = file.read_bytes()
    file.write_bytes(whole[:4096] + bytes(len(whole) - 4096))
    assert all(fault.startswith(FILE) for fault in check(tmp_path).faults) and check(tmp_path).faults
    file.write_bytes(b"no database at all" * 300)
    assert "not a database" in the_fault(tmp_path)
    file.write_bytes(whole)
    change(tmp_path, "PRAGMA user_version = 99")
    assert "newer version" in the_fault(tmp_path)


def test_a_folder_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check-data", str(tmp_path / "none")]) == 2
    assert "none" in capsys.readouterr().err


def test_a_backup_made_while_somebody_writes(kept: Storage, tmp_path: Path) -> None:
    """As docs/operation.md says: the database first, then the assets."""
    copy = tmp_path / "backup"
    (copy / "assets").mkdir(parents=True)
    with closing(sqlite3.connect(tmp_path / FILE)) as database:
        kept.documents.put("materials", "n", checked("materials", {"type": "diffuse", "albedo": 0.5}))
        database.execute("VACUUM INTO ?", (str(copy / FILE),))
    for path in (tmp_path / "assets").iterdir():
        (copy / "assets" / path.name).write_bytes(path.read_bytes())
    assert check(copy) == Report(documents=3, assets=1)
    restored = storage(Config(data_dir=copy))
    restored.documents.prepare()
    assert len(restored.documents.names("materials")[0]) == 2
    restored.assets.close()


def test_each_owner_s_document_is_looked_at(kept: Storage, tmp_path: Path) -> None:
    kept.documents.put("scenes", "a", checked("scenes", SCENE), None, "anna")  # without a mesh
    assert check(tmp_path).faults == []
    change(tmp_path, "DELETE FROM uses WHERE owner = ''")
    assert the_fault(tmp_path).startswith("scenes/a: the assets")
