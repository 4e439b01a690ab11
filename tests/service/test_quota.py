"""Room on the disk: who makes way, who stays, and what does not count."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.config import Config
from service.problems import AssetError, InvalidDocument, NotFound, TooLarge, Unavailable, UnsupportedMedia
from service.server.assets import AssetStore
from service.server.assets.folder import TOTALS
from service.server.storage.documents import checked
from service.server.storage.stores import Storage, storage
from service.system.disk_usage import BLOCK, Usage
from tests.asset_files import OBJ, glb, gltf
from tests.service.stored_assets import ASSET, file, here, mesh_scene
from tests.serving import SCENE

LIMIT = 20 * ASSET
TIGHT = 24 * ASSET  # for the fixture `full`: the documents' file takes 16 of them while it is empty


@pytest.fixture
def kept(tmp_path: Path) -> Iterator[Storage]:
    kept = storage(Config(data_dir=tmp_path, data_quota=LIMIT))
    yield kept
    kept.assets.close()


def uploads(kept: Storage, folder: Path, count: int, size: int = 1000) -> list[str]:
    """Ids, the one that was used longest ago first."""
    ids = [kept.assets.add(OBJ + b"#" * (size - len(OBJ) + i)).id for i in range(count)]
    for i, id in enumerate(ids, 1):
        os.utime(file(folder, id), (i, i))
    return ids


def used(kept: Storage) -> int:
    return kept.quota.used().bytes


def make_room(kept: Storage, size: int) -> None:
    with kept.quota.room(Usage(size)):
        pass


def test_what_was_used_longest_ago_makes_way(kept: Storage, tmp_path: Path) -> None:
    ids = uploads(kept, tmp_path, 4)
    kept.assets.read(ids[0])  # used just now
    kept.assets.add(OBJ + b"#" * (1000 - len(OBJ) + 1))  # ids[1] again
    make_room(kept, 0)
    assert here(kept, ids) == [True] * 4
    make_room(kept, LIMIT - used(kept) + 500)
    assert here(kept, ids) == [True, True, False, True]
    make_room(kept, LIMIT)
    assert here(kept, ids) == [False] * 4 and kept.quota.used() == Usage()
    with pytest.raises(NotFound):
        kept.assets.read(ids[0])
    with pytest.raises(TooLarge):
        make_room(kept, LIMIT + 1)


def test_assets_of_documents_stay(tmp_path: Path) -> None:
    kept = storage(Config(data_dir=tmp_path, data_quota=LIMIT))
    ids = uploads(kept, tmp_path, 2)
    kept.documents.put("scenes", "mine", checked("scenes", mesh_scene(ids[0])))
    make_room(kept, LIMIT - used(kept) + 500)
    assert here(kept, ids) == [True, False]
    other = kept.assets.add(OBJ).id
    with pytest.raises(Unavailable, match="SUNBOX_DATA_QUOTA"):
        make_room(kept, LIMIT - 100)  # the document and its asset are in the way
    assert kept.assets.holds(other)  # it would not have helped
    kept.documents.delete("scenes", "mine")
    make_room(kept, LIMIT - kept.documents.usage().bytes)
    assert not kept.assets.holds(ids[0])
    kept.assets.close()


def test_deleted_documents_do_not_count(tmp_path: Path) -> None:
    kept = storage(Config(data_dir=tmp_path, data_quota=1_100_000))
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "ball"}
    for name in "ab":
        kept.documents.put("scenes", name, checked("scenes", {**SCENE, "shapes": [ball] * 6000}))
    with pytest.raises(Unavailable):
        make_room(kept, 900_000)
    for name in "ab":
        kept.documents.delete("scenes", name)
    make_room(kept, 900_000)
    kept.assets.close()


@pytest.fixture
def full(tmp_path: Path) -> Iterator[tuple[Storage, list[str]]]:
    """Storage without room for one more file of more than a block, and the assets in it."""
    kept = storage(Config(data_dir=tmp_path, data_quota=TIGHT))
    kept.documents.put("scenes", "first", checked("scenes", SCENE))  # the file of the documents, with its empty pages
    ids = uploads(kept, tmp_path, 3)
    size = TIGHT - used(kept) - 2 * BLOCK
    ids += [kept.assets.add(OBJ + b"#" * (size - len(OBJ))).id]
    assert used(kept) == TIGHT - BLOCK
    yield kept, ids
    kept.assets.close()


def test_what_is_refused_costs_nobody_anything(full: tuple[Storage, list[str]]) -> None:
    kept, ids = full
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "ball"}
    missing = {**mesh_scene("sha256:" + "0" * 64), "lights": SCENE["lights"] * 100}
    for document in (missing, {**SCENE, "shapes": [ball] * 100 + [{"type": "sphere"}]}):
        with pytest.raises(InvalidDocument):
            kept.documents.put("scenes", "refused", checked("scenes", document))
    with pytest.raises(TooLarge):
        kept.documents.put("scenes", "refused", checked("scenes", {**SCENE, "shapes": [ball] * 4000}))
    with pytest.raises(UnsupportedMedia):
        kept.assets.add(b"hello" * 2000)
    with pytest.raises(AssetError):
        kept.assets.add(b"v 0 0 0\nf 7 8 9\n" + b"#" * 9000)
    with pytest.raises(AssetError):
        kept.assets.add(glb(gltf(meshes=[]), bytes(9000)))
    assert all(here(kept, ids))
    assert [entry["name"] for entry in kept.documents.names("scenes")[0]] == ["first"]


def test_a_document_makes_room_but_not_of_its_own_assets(full: tuple[Storage, list[str]]) -> None:
    """The one used longest ago is named by the very document that needs room."""
    kept, ids = full
    kept.documents.put("scenes", "mine", checked("scenes", {**mesh_scene(ids[0]), "lights": SCENE["lights"] * 100}))
    assert here(kept, ids) == [True, False, True, True]


def test_no_asset_goes_between_the_look_and_the_saving(
    full: tuple[Storage, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept, ids = full
    holds = AssetStore.holds

    def looked(self: AssetStore, id: str) -> bool:
        monkeypatch.undo()
        found = holds(self, id)
        make_room(kept, TIGHT - kept.documents.usage().bytes - ASSET)  # somebody else's upload
        return found

    monkeypatch.setattr(AssetStore, "holds", looked)
    kept.documents.put("scenes", "mine", checked("scenes", mesh_scene(ids[0])))
    assert here(kept, ids) == [True, False, False, False]


def test_what_is_being_stored_has_its_room(kept: Storage, tmp_path: Path) -> None:
    ids = uploads(kept, tmp_path, 2)
    free = LIMIT - used(kept)
    with kept.quota.room(Usage(free - 2000)):
        make_room(kept, 2000)
        assert all(here(kept, ids))
        make_room(kept, 2500)
        assert here(kept, ids) == [False, True]
        with pytest.raises(Unavailable):
            make_room(kept, 2001 + 2 * ASSET)
        assert here(kept, ids) == [False, True]
    make_room(kept, free)
    assert here(kept, ids) == [False, True]


def test_parts_of_scenes_need_room_too(kept: Storage, tmp_path: Path) -> None:
    ids = uploads(kept, tmp_path, 19, 1500)
    info = kept.assets.add(glb(gltf()))
    kept.assets.scene(info.id)
    assert used(kept) <= LIMIT and not kept.assets.holds(ids[0]) and kept.assets.holds(ids[18])


def test_what_a_killed_upload_leaves_does_not_count(kept: Storage, tmp_path: Path) -> None:
    """Killed in the middle of its writing: the next start clears that away, and not what others are writing."""
    kept.assets.add(OBJ)
    before = kept.quota.used()
    program = f"""
import os, sys
from pathlib import Path
from service.server.assets.folder import AssetFolder
def stop(fd):
    print(flush=True)
    sys.stdin.read()
os.fsync = stop
AssetFolder(Path({str(tmp_path / "assets")!r})).put("sha256:" + "a" * 64, {{"": b"x" * 100_000, ".json": b""}})
"""
    writer = subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert writer.stdout is not None and writer.stdout.readline()
    folder = tmp_path / "assets"
    assert len(list(folder.iterdir())) == 3 and kept.quota.used() == before
    kept.quota.clear()
    assert len(list(folder.iterdir())) == 3  # it is still being written
    writer.send_signal(signal.SIGKILL)
    writer.communicate()
    assert len(list(folder.iterdir())) == 3
    kept.quota.clear()
    assert len(list(folder.iterdir())) == 2 and kept.quota.used() == before


def test_leftovers_are_cleared_away(kept: Storage, tmp_path: Path) -> None:
    id = kept.assets.add(OBJ).id
    before, folder = kept.quota.used(), tmp_path / "assets"
    lost = "sha256:" + "b" * 64
    file(tmp_path, lost, ".json").write_bytes(b"{}" * 9000)
    file(tmp_path, lost, ".scene.json").write_bytes(b"{}" * 9000)
    file(tmp_path, "c" * 64).write_bytes(b"bytes without a record" * 1000)
    (folder / ".abcd.tmp").write_bytes(b"half" * 9000)
    (folder / "a friend's notes").write_bytes(b"not ours")
    assert kept.quota.used() == before
    make_room(kept, LIMIT - before.bytes)
    assert kept.assets.holds(id)
    make_room(kept, LIMIT - before.bytes + 1)
    assert [path.name for path in folder.iterdir()] == ["a friend's notes"]


def test_a_server_clears_away_what_a_crash_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import uvicorn

    from service.server import launch

    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / ".abcd.tmp").write_bytes(b"half")
    monkeypatch.setattr(uvicorn.Server, "run", lambda self, sockets: sockets[0].close())
    launch.run(Config(port=0, data_dir=tmp_path))
    assert not list((tmp_path / "assets").iterdir())


def test_damaged_bytes_make_way_first(kept: Storage, tmp_path: Path) -> None:
    ids = uploads(kept, tmp_path, 2)
    file(tmp_path, ids[1]).write_bytes(bytes(1001))
    with pytest.raises(NotFound, match="damaged"):
        kept.assets.read(ids[1])
    assert file(tmp_path, ids[1], ".damaged").exists()
    make_room(kept, LIMIT - used(kept) + 500)
    assert not file(tmp_path, ids[1], ".damaged").exists() and kept.assets.holds(ids[0])


def counted(folder: Path) -> Usage:
    """What the assets take, by walking through the folder."""
    found = [path.stat() for path in (folder / "assets").iterdir()]
    return Usage(sum(one.st_blocks * 512 for one in found), len(found))


def test_blocks_count_and_not_bytes(tmp_path: Path) -> None:
    kept = storage(Config(data_dir=tmp_path, data_quota=LIMIT))
    kept.assets.add(OBJ)
    kept.assets.add(OBJ + b"#" * BLOCK)
    assert kept.quota.used() == Usage(5 * BLOCK, 4) == counted(tmp_path)
    kept.assets.close()


def test_files_have_a_limit_too(tmp_path: Path) -> None:
    kept = storage(Config(data_dir=tmp_path, data_files=8))
    ids = uploads(kept, tmp_path, 4)
    ids.append(kept.assets.add(OBJ).id)
    assert here(kept, ids) == [False, True, True, True, True] and kept.quota.used().files == 8
    with pytest.raises(TooLarge, match="SUNBOX_DATA_FILES"), kept.quota.room(Usage(1, 9)):
        pass
    kept.documents.put("scenes", "a", checked("scenes", mesh_scene(*ids[1:4])))
    with pytest.raises(Unavailable, match="SUNBOX_DATA_FILES"), kept.quota.room(Usage(1, 3)):
        pass
    kept.assets.close()


def test_totals_are_kept_and_not_counted_again(
    kept: Storage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By whatever comes, is replaced, is damaged or goes, and by other processes too."""
    kept.quota.clear()
    ids = uploads(kept, tmp_path, 3)
    assert kept.quota.used() == counted(tmp_path)
    walks = []
    scandir = os.scandir
    monkeypatch.setattr("os.scandir", lambda path: walks.append(path) or scandir(path))
    kept.assets.scene(kept.assets.add(glb(gltf())).id)
    kept.assets.add(OBJ)
    other = storage(Config(data_dir=tmp_path, data_quota=LIMIT))
    ids += [other.assets.add(OBJ + b"#" * 9000).id]
    file(tmp_path, ids[1]).write_bytes(bytes(1001))
    with pytest.raises(NotFound, match="damaged"):
        kept.assets.read(ids[1])
    assert kept.quota.used() == counted(tmp_path) == other.quota.used()
    kept.assets.add(OBJ + b"#" * (1000 - len(OBJ) + 1))  # ids[1] is healed
    assert kept.quota.used() == counted(tmp_path) and not walks
    make_room(kept, LIMIT - used(kept) + 1)
    assert not kept.assets.holds(ids[0]) and kept.quota.used() == counted(tmp_path)
    other.assets.close()


def test_a_start_counts_what_was_copied_by_hand(kept: Storage, tmp_path: Path) -> None:
    id = kept.assets.add(OBJ).id
    file(tmp_path, id).unlink()
    file(tmp_path, id, ".json").unlink()
    kept.quota.clear()
    assert kept.quota.used() == Usage()


def test_a_change_that_was_killed_is_counted(kept: Storage, tmp_path: Path) -> None:
    """Nobody believes totals that were written before it."""
    kept.assets.add(OBJ)
    program = f"""
import os, signal
from pathlib import Path
from service.server.assets.folder import AssetFolder
replace = os.replace
def stop(*paths):
    replace(*paths)
    if str(paths[1]).endswith(".json"):
        os.kill(os.getpid(), signal.SIGKILL)
os.replace = stop
AssetFolder(Path({str(tmp_path / "assets")!r})).put("sha256:" + "a" * 64, {{"": b"x" * 100_000, ".json": b"{{}}"}})
"""
    subprocess.run([sys.executable, "-c", program])
    assert counted(tmp_path).bytes > 100_000 and kept.quota.used() == counted(tmp_path)


def test_a_full_disk_costs_the_totals_only(kept: Storage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where they cannot be written the folder is counted."""
    kept.assets.add(OBJ)

    write = os.pwrite

    def pwrite(fd: int, data: bytes, offset: int) -> int:
        if len(data) == TOTALS.size:
            raise OSError(28, "No space left on device")
        return write(fd, data, offset)

    monkeypatch.setattr("os.pwrite", pwrite)
    kept.assets.add(OBJ + b"#" * 9000)
    assert kept.quota.used() == counted(tmp_path)
