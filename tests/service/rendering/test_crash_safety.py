"""Whatever step of its end is the last one before a crash, the next start has the render whole or goes on with it."""

from __future__ import annotations

import asyncio
import os
import shutil
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.ipc.messages import Checkpoint, Done, Progress
from service.server.renders.recorder import Recorder
from service.server.renders.store.pictures import PictureFiles
from service.server.renders.store.record import Outcome, StoredRender
from service.server.renders.store.rows import RenderRows
from service.server.renders.store.store import RenderStore
from service.server.storage.asset_access import NO_USES
from tests.service.rendering.stored import DOCUMENT, order, picture

HALF, WHOLE = Progress(8, 0.2, 1.0), Progress(64, 0.1, 4.0)
ENDED = Outcome("done", "max_samples", WHOLE, ended_at=200.0)


class Crash(BaseException):
    """Nothing after it happens."""


def crash(monkeypatch: pytest.MonkeyPatch, where: Any, name: str, after: bool = True) -> None:
    """Have the process end as soon as that was done, or just before it."""
    does = getattr(where, name)

    def last(*given: Any) -> None:
        if after:
            does(*given)
        raise Crash

    monkeypatch.setattr(where, name, last)


async def under_way(store: RenderStore) -> Recorder:
    """A render that has a checkpoint."""
    number = await store.insert(order("a"), Outcome(), DOCUMENT, NO_USES)
    recorder = Recorder(store, number, "a")
    await recorder.start(Outcome())
    assert await recorder.store_now(lambda: recorder.checkpoint(Checkpoint(1, 1, HALF, picture().saved)))
    return recorder


def next_start(folder: Path) -> tuple[StoredRender, list[str]]:
    """The render, and the names of its files, all of which can be read."""
    store = RenderStore(folder)
    (render,) = store.load()
    files = sorted(os.listdir(folder / "renders"))
    assert all(store.read_now("a", name.partition(".")[2], 1) for name in files)  # type: ignore[arg-type]
    assert store.pictures.files == len(files)
    return render, files


@pytest.mark.parametrize(
    ("where", "name", "after", "files"),
    [
        (os, "replace", False, ["a.checkpoint"]),  # the picture is half-written
        (PictureFiles, "write", True, ["a.checkpoint", "a.picture"]),
        (RenderRows, "update", False, ["a.checkpoint", "a.picture"]),
        (RenderRows, "update", True, ["a.picture"]),  # the checkpoint is deleted at the next start
        (PictureFiles, "delete", True, ["a.picture"]),
    ],
)
def test_the_end_of_a_render(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: Any, name: str, after: bool, files: list[str]
) -> None:
    async def test() -> None:
        recorder = await under_way(RenderStore(tmp_path))
        crash(monkeypatch, where, name, after)
        with pytest.raises(Crash):
            await recorder.end(ENDED, Done(1, 1, "max_samples", WHOLE, [], picture(2).saved))
        monkeypatch.undo()

    asyncio.run(test())
    render, found = next_start(tmp_path)
    assert found == files
    if "a.checkpoint" in files:  # it goes on from there, and ends once more with the same bits
        assert render.outcome.state == "running"
    else:
        assert render.outcome == ENDED


class Disk:
    """The folder of pictures as a power cut may leave it, after each step of what is done to it.

    A file's bytes are certain once it was synced, a name or its absence once its folder was. What is not certain yet
    may have come to the disk, or not: `left` gets the folder as it is certain, as it would be with every change of
    names, and with each deletion alone. The database is certain with each row: SQLite syncs it.
    """

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._folder = folder
        self._bytes = {path.stat().st_ino: path.read_bytes() for path in folder.iterdir()}  # of synced files
        self._certain: dict[str, bytes] = {}
        self.left: list[tuple[dict[str, bytes], Path]] = []
        self._sync()
        for where, name in ((os, "fsync"), (os, "replace"), (os, "unlink"), (RenderRows, "update")):
            monkeypatch.setattr(where, name, self._noted(getattr(where, name), name))

    def _noted(self, does: Callable[..., None], name: str) -> Callable[..., None]:
        def step(*given: Any) -> None:
            does(*given)
            if name == "fsync" and stat.S_ISDIR(os.fstat(given[0]).st_mode):
                self._sync()
            elif name == "fsync":
                self._bytes[os.fstat(given[0]).st_ino] = Path(f"/proc/self/fd/{given[0]}").read_bytes()
            self._cut()

        return step

    def _now(self) -> dict[str, bytes]:
        return {path.name: self._bytes.get(path.stat().st_ino, b"") for path in self._folder.iterdir()}

    def _sync(self) -> None:
        self._certain = self._now()

    def _cut(self) -> None:
        now, database = self._now(), self._folder.with_name(f"{len(self.left)}")
        shutil.copytree(self._folder.parent, database, ignore=lambda *_: ["renders"])
        deleted = self._certain.keys() - now.keys()
        self.left += [(self._certain, database), (now, database)]
        self.left += [({name: data for name, data in self._certain.items() if name != gone}, database)
                      for gone in deleted]  # fmt: skip


def test_a_power_cut_at_the_end_of_a_render(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After each step, whatever of it came to the disk: the next start has its picture, or goes on with it."""

    async def test() -> Disk:
        recorder = await under_way(RenderStore(tmp_path / "data"))
        disk = Disk(tmp_path / "data" / "renders", monkeypatch)
        assert await recorder.end(ENDED, Done(1, 1, "max_samples", WHOLE, [], picture(2).saved))
        monkeypatch.undo()
        return disk

    disk, found = asyncio.run(test()), set[str]()
    for number, (files, database) in enumerate(disk.left):
        folder = tmp_path / f"start {number}"
        shutil.copytree(database, folder)
        (folder / "renders").mkdir()
        for name, data in files.items():
            (folder / "renders" / name).write_bytes(data)
        render, names = next_start(folder)
        if render.outcome == ENDED:
            assert "a.picture" in names
        else:
            assert render.outcome.state == "running" and "a.checkpoint" in names
            assert "a.picture" in names or render.outcome.progress == HALF
        found.add(render.outcome.state)
    assert found == {"running", "done"}


@pytest.mark.parametrize(("after", "gone"), [(False, False), (True, True)])
def test_the_deletion_of_a_render(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: bool, gone: bool) -> None:
    async def test() -> None:
        store = RenderStore(tmp_path)
        recorder = await under_way(store)
        crash(monkeypatch, RenderRows, "forget", after)
        with pytest.raises(Crash):
            await store.forget([(recorder.number, "a")])
        monkeypatch.undo()

    asyncio.run(test())
    render, files = next_start(tmp_path)
    assert render.gone is gone and files == ([] if gone else ["a.checkpoint"])


@pytest.mark.parametrize(
    ("where", "name"), [(PictureFiles, "write"), (RenderRows, "update"), (PictureFiles, "delete")]
)
def test_a_disk_that_fails_at_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: Any, name: str) -> None:
    """The render ends for whoever waits for it, and is not taken for stored whole."""

    def fail(*given: Any) -> None:
        raise OSError(28, "No space left on device")

    async def test() -> None:
        recorder = await under_way(RenderStore(tmp_path))
        monkeypatch.setattr(where, name, fail)
        assert not await recorder.end(ENDED, Done(1, 1, "max_samples", WHOLE, [], picture(2).saved))
        assert not recorder.whole and recorder.store.failures == 1
        monkeypatch.undo()

    asyncio.run(test())
    render, files = next_start(tmp_path)
    assert render.outcome.state == "running" if "a.checkpoint" in files else render.outcome == ENDED
