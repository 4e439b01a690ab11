"""A start deletes no picture because its database does not know it: the database may be the wrong one."""

from __future__ import annotations

import asyncio
import logging
import os
from pathlib import Path

import pytest

from service.cli import program as cli
from service.config import Config
from service.ipc.messages import Progress
from service.problems import Unavailable
from service.server.renders.store.pictures import PictureFiles
from service.server.renders.store.record import Outcome
from service.server.renders.store.store import RenderStore
from service.server.storage.asset_access import NO_USES
from service.server.storage.database import FILE
from service.server.storage.lost_pictures import KEEP
from service.server.storage.stores import storage
from service.system.disk_usage import Usage
from tests.service.rendering.stored import DOCUMENT, PROGRESS, order, picture

DATABASE = [FILE, f"{FILE}-wal", f"{FILE}-shm"]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.is_file()) if folder.exists() else []


def stored(folder: Path, *ids: str) -> None:
    """Renders with pictures; the last one is under way, with a checkpoint."""

    async def insert() -> None:
        store = RenderStore(folder)
        for id in ids:
            number = await store.insert(order(id), Outcome(), DOCUMENT, NO_USES)
            if id == ids[-1]:
                await store.write(id, "checkpoint", picture())
                await store.update(number, Outcome("running"))
            else:
                await store.write(id, "picture", picture(reason="max_samples"))
                await store.update(number, Outcome("done", "max_samples", PROGRESS, ended_at=200.0))

    asyncio.run(insert())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    stored(tmp_path, "a", "b", "c")
    return tmp_path


PICTURES = ["a.picture", "b.picture", "c.checkpoint"]


def test_a_database_that_was_moved_away_costs_no_picture(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    """As the error about a damaged one advises; and putting the database back brings all of them back."""
    away = tmp_path_factory.mktemp("away")
    for name in DATABASE:
        if (folder / name).exists():
            (folder / name).rename(away / name)
    assert RenderStore(folder).load() == []
    assert names(folder / "renders") == [] and names(folder / "renders" / "lost") == [KEEP, *PICTURES]
    assert "put the right one back" in (folder / "renders" / "lost" / KEEP).read_text()
    assert RenderStore(folder).load() == []  # another start changes nothing
    stored(folder, "new")
    assert cli.main(["check-data", str(folder)]) == 0
    assert "does not know the renders of 3 pictures; they stay" in capsys.readouterr().out
    for name in DATABASE:
        (folder / name).unlink(missing_ok=True)
        if (away / name).exists():
            (away / name).rename(folder / name)
    assert cli.main(["check-data", str(folder)]) == 0
    assert "of 3 pictures are known again" in capsys.readouterr().out
    assert [each.outcome.state for each in RenderStore(folder).load()] == ["done", "done", "running"]
    assert names(folder / "renders") == PICTURES
    assert names(folder / "renders" / "lost") == ["new.checkpoint", KEEP][::-1]
    assert cli.main(["check-data", str(folder)]) == 0


def test_an_empty_folder_of_lost_pictures_goes(folder: Path) -> None:
    files = PictureFiles(folder / "renders")
    files.prepare([])
    assert names(folder / "renders" / "lost") == [KEEP, *PICTURES] and files.usage == Usage()
    files.prepare(["a", "b", "c"])
    assert names(folder / "renders") == PICTURES and not (folder / "renders" / "lost").exists()
    assert files.usage.files == 3


def test_a_few_strangers_make_room_and_many_do_not(tmp_path: Path) -> None:
    """Those that were written first go first; they count, for the command line too."""
    files = PictureFiles(tmp_path / "renders")
    known = [f"known{number}" for number in range(20)]
    for number, id in enumerate([*known, "older", "newer"]):
        files.write(id, "picture", picture())
        os.utime(files.path(id, "picture"), (number, number))
    kept = storage(Config(data_dir=tmp_path, data_quota=1 << 20))
    before = kept.quota.used()
    PictureFiles(tmp_path / "renders").prepare(known)
    assert names(tmp_path / "renders" / "lost") == ["newer.picture", "older.picture"]
    assert kept.quota.used() == before
    free = (1 << 20) - before.bytes
    with kept.quota.room(Usage(free + 1)):
        assert names(tmp_path / "renders" / "lost") == ["newer.picture"]
    (tmp_path / "renders" / "lost" / KEEP).touch()
    with pytest.raises(Unavailable), kept.quota.room(Usage((1 << 20) - kept.quota.used().bytes + 1)):
        pass
    assert names(tmp_path / "renders" / "lost") == [KEEP, "newer.picture"]
    kept.assets.close()


def test_of_what_is_refused_nothing_goes(tmp_path: Path) -> None:
    files = PictureFiles(tmp_path / "renders")
    known = [f"known{number}" for number in range(20)]
    for id in [*known, "stranger"]:
        files.write(id, "picture", picture())
    files.prepare(known)
    kept = storage(Config(data_dir=tmp_path, data_quota=1 << 20))
    with pytest.raises(Unavailable), kept.quota.room(Usage(1 << 20)):
        pass
    assert names(tmp_path / "renders" / "lost") == ["stranger.picture"]
    kept.assets.close()


def test_pictures_of_renders_that_are_gone_are_no_strangers(folder: Path) -> None:
    """A crash came between their rows and their files."""
    files = PictureFiles(folder / "renders")
    files.prepare(["a"], ["b", "c"])
    assert names(folder / "renders") == ["a.picture"] and not (folder / "renders" / "lost").exists()


def test_a_damaged_checkpoint_is_kept_for_an_inspection(folder: Path) -> None:
    path = folder / "renders" / "c.checkpoint"
    path.write_bytes(b"x" + path.read_bytes())
    for _ in range(2):  # and stays there
        assert RenderStore(folder).load()[2].outcome.progress == Progress()
        assert names(folder / "renders" / "lost") == ["c.checkpoint.damaged"]


def test_pictures_that_cannot_be_moved_stop_no_start(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(*names: object) -> None:
        raise PermissionError(13, "Permission denied")

    caplog.set_level(logging.INFO, "service")
    monkeypatch.setattr("os.replace", refuse)
    files = PictureFiles(folder / "renders")
    files.prepare(["a"])
    assert names(folder / "renders") == PICTURES and "Permission denied" in caplog.text
