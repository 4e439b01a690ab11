"""The store of renders without a server: what is on the disk is whole, counted, and keeps its assets."""

from __future__ import annotations

import asyncio
import errno
import os
import threading
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli import program as cli
from service.config import Config
from service.ipc.messages import Progress, Restore, SavedPicture
from service.problems import FieldError, Internal, InvalidDocument, Unavailable
from service.server.renders.store import rows
from service.server.renders.store import store as store_module
from service.server.renders.store.pictures import DamagedPicture, PictureFiles
from service.server.renders.store.record import IdempotencyKey, Outcome
from service.server.renders.store.store import RenderStore
from service.server.storage.asset_access import NO_USES, AllowedUses
from service.server.storage.database import Database
from service.server.storage.stores import storage
from tests.service.rendering.stored import DOCUMENT, PROGRESS, order, picture

OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def run(test: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(test())


def test_a_picture_comes_back_as_it_was(tmp_path: Path) -> None:
    files = PictureFiles(tmp_path / "renders")
    files.write("a", "checkpoint", picture(1))
    files.write("a", "checkpoint", picture(2))
    back, put = files.read("a", "checkpoint", 7), picture(2)
    assert (back.reason, back.progress, back.saved.samples, back.saved.under_way) == (None, PROGRESS, 8, (2, 1, 0))
    assert [each.tobytes() for each in back.saved.buffers] == [each.tobytes() for each in put.saved.buffers]
    assert files.progress("a", "checkpoint") == PROGRESS
    path = files.path("a", "checkpoint")
    assert files.usage.bytes == files.size("a") == path.stat().st_blocks * 512 and files.usage.files == 1
    assert [each.name for each in path.parent.iterdir()] == ["a.checkpoint"]


@pytest.mark.parametrize("damage", [lambda data: data[:-1], lambda data: data[:-1] + b"x", lambda data: b"x" + data])
def test_a_damaged_picture_is_seen(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    files = PictureFiles(tmp_path)
    files.write("a", "picture", picture())
    path = files.path("a", "picture")
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(DamagedPicture):
        files.read("a", "picture", 7)


def test_what_a_crash_left_is_deleted(tmp_path: Path) -> None:
    files = PictureFiles(tmp_path)
    for id in ("known", "gone"):
        files.write(id, "picture", picture())
    (tmp_path / ".half.tmp").write_bytes(b"half")
    (tmp_path / "notes.txt").write_bytes(b"somebody's")
    again = PictureFiles(tmp_path)
    again.prepare(["known"], ["gone"])
    assert sorted(each.name for each in tmp_path.iterdir()) == ["known.picture", "notes.txt"]
    assert again.usage.files == 1 and again.has("known", "picture")


def test_a_full_disk_leaves_the_picture_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test() -> None:
        store = RenderStore(tmp_path)
        await store.write("a", "checkpoint", picture(1))

        def full(fd: int) -> None:
            raise OSError(errno.ENOSPC, "full")

        monkeypatch.setattr("os.fsync", full)
        with pytest.raises(Unavailable):
            await store.write("a", "checkpoint", picture(2))
        monkeypatch.undo()
        back = await store.read("a", "checkpoint", 7)
        assert back is not None and back.saved.buffers[0][0] == 1
        assert os.listdir(tmp_path / "renders") == ["a.checkpoint"]

    run(test)


def test_no_small_render_waits_for_a_large_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its end is written, read and deleted while a large one's checkpoint is on its way to the disk."""
    monkeypatch.setattr(store_module, "LARGE", 5000)
    began, go_on = threading.Event(), threading.Event()
    write = PictureFiles.write

    def slow(self: PictureFiles, id: str, kind: Any, restore: Restore) -> None:
        if id == "large":
            began.set()
            assert go_on.wait(60)
        write(self, id, kind, restore)

    monkeypatch.setattr(PictureFiles, "write", slow)

    async def test() -> None:
        store = RenderStore(tmp_path)
        large = replace(picture(), saved=SavedPicture(8, (2, 1, 0), [np.zeros(10_000, np.uint8)]))
        await store.write("before", "picture", large)
        writing = asyncio.ensure_future(store.write("large", "checkpoint", large, "anna"))
        try:
            await asyncio.to_thread(began.wait, 60)
            await store.write("small", "picture", picture(), "bert")
            assert await store.read("small", "picture", 7) is not None
            assert await store.read("before", "picture", 7) is not None  # and a large one is read
            await store.delete("small", "picture")
            assert not writing.done()
        finally:
            go_on.set()
            await writing

    run(test)


@pytest.mark.parametrize(("number", "usable"), [(errno.EROFS, False), (errno.EACCES, False), (errno.ENOSPC, True)])
def test_a_folder_that_cannot_be_written_to_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, usable: bool
) -> None:
    """A full disk may have room later; without a folder renders end with the server."""
    assert RenderStore(tmp_path / "new").usable()

    def refuse(dir: Path) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    assert RenderStore(tmp_path).usable() is usable


def test_rows_come_back_in_their_order(tmp_path: Path) -> None:
    async def test() -> None:
        store = RenderStore(tmp_path)
        numbers = [await store.insert(order(id, "anna"), Outcome(), DOCUMENT, NO_USES) for id in "abc"]
        error = InvalidDocument([FieldError("/scene", "is too large")])
        failed = Outcome(warnings=["w"], progress=PROGRESS, setup_s=2.0).failed(error, 200.0)
        await store.update(numbers[0], failed)
        await store.update(numbers[1], Outcome("running"))
        await store.write("b", "checkpoint", picture())
        back = RenderStore(tmp_path).load()
        assert [each.order for each in back] == [order(id, "anna") for id in "abc"]
        assert [each.outcome.state for each in back] == ["failed", "running", "queued"]
        assert back[0].outcome.ended_at == 200.0 and back[0].outcome.warnings == ["w"]
        assert isinstance(back[0].outcome.error, InvalidDocument) and "too large" in str(back[0].outcome.error)
        assert back[1].outcome.progress == PROGRESS and back[2].outcome.progress == Progress()
        assert await store.document(numbers[2]) == DOCUMENT

    run(test)


def test_what_is_gone_is_remembered_and_its_key_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test() -> None:
        store = RenderStore(tmp_path)
        number = await store.insert(order("a"), Outcome(), DOCUMENT, NO_USES, IdempotencyKey("k", "digest"))
        await store.write("a", "picture", picture())
        await store.forget([(number, "a")])
        assert [(each.order.id, each.gone) for each in RenderStore(tmp_path).load()] == [("a", True)]
        assert not os.listdir(tmp_path / "renders") and store.pictures.bytes == 0
        with pytest.raises(Internal):
            await store.document(number)
        known = await store.keyed("", "k")
        assert known is not None and known[0] == "digest" and known[1].gone
        assert await store.keyed("anna", "k") is None
        monkeypatch.setattr(rows, "KEY_S", 0.0)
        assert await store.keyed("", "k") is None

    run(test)


def test_rows_of_gone_renders_are_small(tmp_path: Path) -> None:
    """Only the id and the state stay, which the key of a request may still ask for."""

    async def test() -> None:
        store = RenderStore(tmp_path)
        warned = Outcome("done", "max_samples", PROGRESS, warnings=["w" * 1000], ended_at=200.0)
        number = await store.insert(order("a"), Outcome(), DOCUMENT, NO_USES, IdempotencyKey("k", "digest"))
        await store.update(number, warned)
        await store.forget([(number, "a")])
        with Database(tmp_path).open() as database:
            assert database.execute("SELECT settings, outcome FROM renders").fetchall() == [("{}", "{}")]
        known = await store.keyed("", "k")
        assert known is not None and known[1].outcome == Outcome("done", ended_at=200.0)
        assert known[1].order.label == "label" and known[1].unfit is None

    run(test)


def test_a_start_reads_only_the_gone_ones_that_are_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rows, "REMEMBERED", 2)

    async def test() -> None:
        store = RenderStore(tmp_path)
        numbers = [
            await store.insert(order(id), Outcome(), DOCUMENT, NO_USES, IdempotencyKey(id, "d")) for id in "abcde"
        ]
        await store.forget([(number, id) for number, id in zip(numbers[:4], "abcd", strict=True)])
        assert [(each.order.id, each.gone) for each in RenderStore(tmp_path).load()] == [
            ("c", True),
            ("d", True),
            ("e", False),
        ]
        assert await store.keyed("", "a") is not None  # by its key it is still known

    run(test)


def test_keys_of_one_owner_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The oldest go first, and with them what is remembered of their renders; another owner's stay."""
    monkeypatch.setattr(rows, "MOST_KEYS", 3)
    monkeypatch.setattr(rows, "REMEMBERED", 0)

    async def test() -> None:
        store = RenderStore(tmp_path)
        await store.insert(order("bert's", "bert"), Outcome(), DOCUMENT, NO_USES, IdempotencyKey("0", "d"))
        numbers = [
            await store.insert(order(key, "anna"), Outcome(), DOCUMENT, NO_USES, IdempotencyKey(key, "d"))
            for key in "01234"
        ]
        known = [await store.keyed("anna", key) is not None for key in "01234"]
        assert known == [False, False, True, True, True] and await store.keyed("bert", "0") is not None
        await store.forget([(number, key) for number, key in zip(numbers, "01234", strict=True)])
        with Database(tmp_path).open() as database:
            ids = {id for (id,) in database.execute("SELECT id FROM renders")}
        assert ids == {"bert's", "2", "3", "4"}

    run(test)


def test_assets_of_stored_renders_stay(tmp_path: Path) -> None:
    async def test() -> None:
        kept = storage(Config(data_dir=tmp_path, data_quota=436_000))
        store = RenderStore(tmp_path, kept.quota.room)
        used, other = (kept.assets.add(OBJ + b"#" * size).id for size in (10, 20))
        number = await store.insert(order("a"), Outcome(), DOCUMENT, AllowedUses("", (used,)))
        for size in range(40):  # until room has to be made
            kept.assets.add(OBJ + b"#" * (9000 + size))
        assert kept.assets.holds(used) and not kept.assets.holds(other)
        await store.forget([(number, "a")])
        for size in range(40):
            kept.assets.add(OBJ + b"#" * (9100 + size))
        assert not kept.assets.holds(used)
        before = kept.quota.used()
        await store.write("b", "picture", picture())
        assert kept.quota.used().files == before.files + 1  # pictures count, too
        kept.assets.close()

    run(test)


def test_check_data_reads_renders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    async def test() -> None:
        store = RenderStore(tmp_path)
        for id in "abc":
            uses = AllowedUses("", ("sha256:" + "0" * 64,)) if id == "c" else NO_USES
            number = await store.insert(order(id), Outcome(), DOCUMENT, uses)
            await store.write(id, "picture", picture(reason="max_samples"))
            await store.update(number, Outcome("done", "max_samples", PROGRESS, ended_at=200.0))

    run(test)
    with Database(tmp_path).open() as database, database:
        database.execute("UPDATE render_documents SET body = x'00' WHERE number = 1")
    path = tmp_path / "renders" / "b.picture"
    path.write_bytes(path.read_bytes()[:-1])
    (tmp_path / "renders" / "c.picture").rename(tmp_path / "renders" / "d.picture")
    assert cli.main(["check-data", str(tmp_path)]) == 1
    said = capsys.readouterr()
    assert "3 renders" in said.out and "renders/d.picture: the database does not know its render" in said.out
    faults = [line for line in said.err.splitlines() if line.startswith("fault:")]
    assert len(faults) == 4
    assert "renders/a: its document is damaged" in faults[0] and "renders/b: its picture is damaged" in faults[1]
    assert "renders/c: there is no asset" in faults[2] and "renders/c: its picture is not there" in faults[3]
