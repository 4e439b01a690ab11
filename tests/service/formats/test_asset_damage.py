"""Assets whose bytes went bad on the disk: found by their hash, never served, and healed by sending them again."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from service.problems import AssetError, NotFound
from service.server.assets import AssetStore, integrity
from tests import asset_files as make
from tests.asset_files import OBJ
from tests.marks import seldom

PNG = make.png(np.arange(48, dtype=np.uint8).reshape(4, 4, 3))
GLB = make.glb(make.gltf())


@pytest.fixture
def store(tmp_path: Path) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path)
    yield store
    store.close()


@pytest.fixture
def restarted(tmp_path: Path) -> Iterator[AssetStore]:
    """Another process's: it has parsed and checked nothing yet."""
    store = AssetStore(tmp_path)
    yield store
    store.close()


def file(folder: Path, id: str, suffix: str = "") -> Path:
    return folder / "assets" / (id.removeprefix("sha256:") + suffix)


def damage(path: Path) -> None:
    """As a loss of power leaves what was not on the disk yet: as long as it should be, and zero."""
    path.write_bytes(bytes(path.stat().st_size))


def names(folder: Path) -> set[str]:
    return {path.name for path in (folder / "assets").iterdir()}


@pytest.mark.parametrize("data", seldom([OBJ, PNG, GLB], [PNG]))
@pytest.mark.parametrize("suffix", ["", ".json"])
def test_sending_it_again_heals(
    data: bytes, suffix: str, store: AssetStore, restarted: AssetStore, tmp_path: Path
) -> None:
    info = store.add(data)
    before = names(tmp_path)
    for one in (store, restarted):
        damage(file(tmp_path, info.id, suffix))
        assert one.add(data) == info
        assert one.read(info.id) == data and names(tmp_path) == before


def test_sending_it_again_heals_what_the_disk_lost_in_silence(store: AssetStore, tmp_path: Path) -> None:
    """The file's time of change is what it was when its hash was right."""
    path = file(tmp_path, store.add(OBJ).id)
    changed = path.stat().st_mtime_ns
    damage(path)
    os.utime(path, ns=(changed, changed))
    store.add(OBJ)
    assert path.read_bytes() == OBJ


def test_damage_is_found_at_the_first_load(store: AssetStore, restarted: AssetStore, tmp_path: Path) -> None:
    """It is told by name, served to nobody, and kept for whoever looks into it."""
    mesh, image = store.add(OBJ).id, store.add(PNG).id
    for id in (mesh, image):
        damage(file(tmp_path, id))
    damaged = f"the stored bytes of {mesh} are damaged; upload the file again"
    with pytest.raises(AssetError, match=damaged):
        restarted.mesh(mesh)
    with pytest.raises(AssetError, match="damaged"):
        restarted.image(image)
    for one in (store, restarted):
        for ask in (one.read, one.info):
            with pytest.raises(NotFound, match="damaged"):
                ask(mesh)
        assert not one.holds(mesh) and "damaged" in str(one.missing(mesh))
    assert file(tmp_path, mesh, ".damaged").read_bytes() == bytes(len(OBJ))
    restarted.add(OBJ)
    assert len(restarted.mesh(mesh).faces) == 1 and not file(tmp_path, mesh, ".damaged").exists()


def test_a_file_is_hashed_once(
    store: AssetStore, restarted: AssetStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not when it was just stored, and not at later loads unless it has changed."""
    hashed: list[int] = []
    digest = integrity.digest
    monkeypatch.setattr(integrity, "digest", lambda source: hashed.append(1) or digest(source))
    id = store.add(PNG).id
    for _ in range(3):
        assert store.read(id) == PNG
    assert not hashed
    for _ in range(3):
        assert restarted.read(id) == PNG
    assert len(hashed) == 1
    damage(file(tmp_path, id))
    with pytest.raises(NotFound, match="damaged"):
        restarted.read(id)


def test_what_cannot_be_read_is_damaged(
    store: AssetStore, restarted: AssetStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(source: object) -> str:
        raise OSError(5, "Input/output error")

    id = store.add(PNG).id
    monkeypatch.setattr(integrity, "digest", broken)
    with pytest.raises(NotFound, match="damaged"):
        restarted.read(id)


@pytest.mark.parametrize("how", seldom(["import", "scene", "scene without its document"], ["scene"]))
def test_importing_a_scene_again_heals_its_parts(
    how: str, store: AssetStore, restarted: AssetStore, tmp_path: Path
) -> None:
    id = store.add(GLB).id
    document = store.scene(id).document
    part = document["shapes"][0]["asset"]
    good = file(tmp_path, part).read_bytes()
    for one in (store, restarted):
        damage(file(tmp_path, part))
        if how == "import":
            one.add(GLB)
        else:
            if how != "scene":
                file(tmp_path, id, ".scene.json").unlink()
            assert one.scene(id).document == document
        assert one.read(part) == good and len(one.mesh(part).faces) == 1


def test_a_part_that_is_damaged_says_where_it_came_from(
    store: AssetStore, restarted: AssetStore, tmp_path: Path
) -> None:
    part = store.scene(store.add(GLB).id).document["shapes"][0]["asset"]
    damage(file(tmp_path, part))
    with pytest.raises(AssetError, match="or the glTF file or zip that it is part of"):
        restarted.mesh(part)


@pytest.mark.parametrize("record", [b"", b"{}", b"[]", b"\0" * 50, b'{"document": {}, "warnings": [], "lit": true}'])
def test_a_damaged_record_of_an_import_is_made_again(record: bytes, store: AssetStore, tmp_path: Path) -> None:
    id = store.add(GLB).id
    written, document = file(tmp_path, id, ".scene.json").read_bytes(), store.scene(id).document
    file(tmp_path, id, ".scene.json").write_bytes(record)
    assert store.scene(id).document == document
    assert json.loads(file(tmp_path, id, ".scene.json").read_bytes()) == json.loads(written)


def test_a_damaged_scene_is_told_of(store: AssetStore, restarted: AssetStore, tmp_path: Path) -> None:
    id = store.add(GLB).id
    damage(file(tmp_path, id))
    file(tmp_path, id, ".scene.json").unlink()
    with pytest.raises(NotFound, match="damaged"):
        restarted.scene(id)


def test_what_is_replaced_meanwhile_is_not_set_aside(store: AssetStore, tmp_path: Path) -> None:
    """One thread finds it damaged while another stores it again."""
    id = store.add(OBJ).id
    damage(file(tmp_path, id))
    with file(tmp_path, id).open("rb") as found:
        os.replace(file(tmp_path, id), tmp_path / "old")
        store.add(OBJ)
        store._files.set_aside(id, found)
    assert store.read(id) == OBJ
