"""What one key uploads has a bound, within which its own assets make room."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from service.config import Config
from service.problems import TooLarge, Unavailable
from service.server.storage.database import Database
from service.server.storage.documents import checked
from service.server.storage.stores import Storage, storage
from service.system.disk_usage import Usage
from tests.asset_files import OBJ, glb, gltf
from tests.service.stored_assets import ASSET, file, here, mesh_scene


@pytest.fixture
def shared(tmp_path: Path) -> Iterator[Storage]:
    """Each owner may have four small assets."""
    kept = storage(Config(data_dir=tmp_path, max_key_assets=4 * ASSET))
    yield kept
    kept.assets.close()


def upload(kept: Storage, folder: Path, owner: str, number: int, size: int = 1000) -> str:
    """An id; the higher its number, the later it was used."""
    data = OBJ + b"#" * (size - len(OBJ) + number)
    info = kept.assets.add(data, room=partial(kept.shares.room, owner))
    kept.shares.uploaded(owner, kept.assets.parts(info))
    os.utime(file(folder, info.id), (number, number))
    return info.id


def test_an_owner_s_own_assets_make_room(shared: Storage, tmp_path: Path) -> None:
    """Those unused longest, which no document uses and nobody else has uploaded."""
    others = [upload(shared, tmp_path, "bert", number) for number in (1, 2)]
    mine = [upload(shared, tmp_path, "anna", number) for number in (2, 3, 4, 5)]
    assert mine[0] == others[1]  # the same bytes
    shared.documents.put("scenes", "a", checked("scenes", mesh_scene(mine[1])))
    mine.append(upload(shared, tmp_path, "anna", 6))
    assert here(shared, mine) == [True, True, False, True, True] and all(here(shared, others))
    mine.append(upload(shared, tmp_path, "anna", 7))
    assert here(shared, mine) == [True, True, False, False, True, True]
    shared.documents.put("scenes", "b", checked("scenes", mesh_scene(*mine[4:])))
    with pytest.raises(Unavailable, match="SUNBOX_MAX_KEY_ASSETS"):
        upload(shared, tmp_path, "anna", 8)
    with pytest.raises(TooLarge, match="SUNBOX_MAX_KEY_ASSETS"):
        upload(shared, tmp_path, "carl", 0, 5 * ASSET)
    assert len({upload(shared, tmp_path, "", number) for number in range(10, 16)}) == 6  # without keys


def test_what_others_uploaded_before_needs_room_as_well(shared: Storage, tmp_path: Path) -> None:
    """Else whoever has none learns from the answer that it is here."""
    others = [upload(shared, tmp_path, "bert", number) for number in (1, 2)]
    mine = [upload(shared, tmp_path, "anna", number) for number in (3, 4, 5, 6)]
    upload(shared, tmp_path, "anna", 1)
    assert here(shared, mine) == [False, True, True, True] and all(here(shared, others))
    shared.documents.put("scenes", "a", checked("scenes", mesh_scene(*mine[1:])), None, "anna")
    shared.documents.put("scenes", "b", checked("scenes", mesh_scene(others[0])), None, "anna")
    with pytest.raises(Unavailable, match="SUNBOX_MAX_KEY_ASSETS"):
        upload(shared, tmp_path, "anna", 2)
    assert ("anna", others[1]) not in noted(tmp_path)


def test_what_made_room_for_others_counts_no_longer(shared: Storage, tmp_path: Path) -> None:
    mine = [upload(shared, tmp_path, "anna", number) for number in range(4)]
    with shared.quota._files.locked():
        shared.quota._files.delete(mine[2])
    mine.append(upload(shared, tmp_path, "anna", 5))
    assert here(shared, mine) == [True, True, False, True, True]


def test_the_parts_of_a_scene_are_its_owner_s(shared: Storage, tmp_path: Path) -> None:
    scene = shared.assets.add(glb(gltf()), room=partial(shared.shares.room, "anna"))
    parts = shared.assets.parts(scene)
    assert len(parts) == 2
    shared.shares.uploaded("anna", parts)
    for part in parts:
        os.utime(file(tmp_path, part), (0, 0))  # unused for long
    assert upload(shared, tmp_path, "anna", 1) and shared.assets.holds(scene.id)
    upload(shared, tmp_path, "anna", 2, 1000)
    assert not all(here(shared, parts))


def noted(folder: Path) -> list[tuple[str, str]]:
    with Database(folder).open() as database:
        return database.execute("SELECT owner, asset FROM asset_owners ORDER BY owner, asset").fetchall()


def test_nothing_is_noted_of_what_is_deleted(tmp_path: Path) -> None:
    """Without a bound of one key, too, when assets make room for any others."""
    kept = storage(Config(data_dir=tmp_path, data_quota=80 * ASSET))
    first = [upload(kept, tmp_path, owner, number) for owner in ("anna", "bert") for number in (1, 2)]
    stays = upload(kept, tmp_path, "anna", 3)
    assert len(noted(tmp_path)) == 5
    with kept.quota.room(Usage(80 * ASSET - kept.quota.used().bytes + 2 * ASSET)):
        assert not any(here(kept, first)) and noted(tmp_path) == [("anna", stays)]
    kept.assets.close()


def test_a_start_forgets_what_was_deleted_by_hand(tmp_path: Path) -> None:
    kept = storage(Config(data_dir=tmp_path))
    kept.shares.clear()  # where there is no database yet
    ids = [upload(kept, tmp_path, "anna", number) for number in (1, 2)]
    file(tmp_path, ids[0]).unlink()
    kept.shares.clear()
    assert noted(tmp_path) == [("anna", ids[1])]
    kept.assets.close()


def test_what_is_uploaded_again_meanwhile_stays_noted(tmp_path: Path) -> None:
    kept = storage(Config(data_dir=tmp_path))
    id = upload(kept, tmp_path, "anna", 1)
    kept.shares.forget([id])  # it had been deleted, and is there again
    assert noted(tmp_path) == [("anna", id)]
    kept.assets.close()
