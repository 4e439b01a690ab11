"""Whose assets a key may use: its own, those of documents and renders that it can read, and those of nobody."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from service.config import Config
from service.document import presets
from service.problems import InvalidDocument, NotFound
from service.server.storage.database import Database
from service.server.storage.documents import BY_LINK, PRIVATE, SHARED, checked
from service.server.storage.stores import Storage, storage
from tests.asset_files import OBJ, glb, gltf, png
from tests.calls import is_problem
from tests.service.stored_assets import mesh_scene
from tests.serving import ENDLESS, SCENE, SMALL, Client, Server

ANNA, BERT = {"authorization": "Bearer anna-key"}, {"authorization": "Bearer bert-key"}
MISSING = "sha256:" + "0" * 64


@pytest.fixture
def kept(tmp_path: Path) -> Iterator[Storage]:
    kept = storage(Config(data_dir=tmp_path))
    yield kept
    kept.assets.close()


def upload(kept: Storage, owner: str, data: bytes) -> str:
    info = kept.assets.add(data, room=partial(kept.shares.room, owner))
    kept.shares.uploaded(owner, kept.assets.parts(info))
    return info.id


def test_what_nobody_is_known_to_have_uploaded_is_everybody_s(kept: Storage) -> None:
    builtin = next(iter(presets.builtin_assets()))
    upload(kept, "anna", presets.builtin_assets()[builtin])
    assert kept.access.foreign("bert", [builtin, MISSING, "\ud800", upload(kept, "", OBJ)]) == set()


def test_documents_share_their_assets(kept: Storage) -> None:
    id = upload(kept, "anna", OBJ)
    assert kept.access.foreign("anna", [id]) == kept.access.foreign("", [id]) == set()
    for shared, foreign in ((PRIVATE, {id}), (SHARED, set()), (BY_LINK, {id}), (PRIVATE, {id})):
        kept.documents.put("scenes", "a", checked("scenes", mesh_scene(id)), None, "anna", shared)
        assert kept.access.foreign("bert", [id]) == foreign
    with pytest.raises(InvalidDocument) as refused:
        kept.documents.put("scenes", "b", checked("scenes", mesh_scene(MISSING, id)), None, "bert")
    first, second = refused.value.errors
    assert second.pointer == "/shapes/1/asset" and second.detail == first.detail.replace(MISSING, id)
    kept.documents.put("scenes", "a", checked("scenes", mesh_scene(id)), None, "anna", SHARED)
    kept.documents.put("scenes", "b", checked("scenes", mesh_scene(id)), None, "bert")
    kept.documents.delete("scenes", "a", "anna")
    assert kept.access.foreign("bert", [id]) == set(), "an own document uses it"
    with pytest.raises(NotFound, match="upload it first"):
        kept.access.check("carl", id)


def test_the_parts_of_a_scene_are_its_owner_s_also_where_they_are_made_again(kept: Storage, tmp_path: Path) -> None:
    id = upload(kept, "anna", glb(gltf()))
    parts = kept.assets.scene(id).references()
    assert parts and kept.access.foreign("bert", [id, *parts]) == {id, *parts}
    with Database(tmp_path).open() as database, database:
        database.executemany("DELETE FROM asset_owners WHERE asset = ?", [(part,) for part in parts])
    kept.shares.imported("bert", id, parts)
    kept.shares.imported("", id, parts)
    assert kept.access.foreign("bert", parts) == set(), "nobody has them"
    kept.shares.imported("anna", id, parts)
    assert kept.access.foreign("anna", parts) == set() and kept.access.foreign("bert", parts) == parts


def uploaded(server: Server, data: bytes, key: dict[str, str] = ANNA) -> Any:
    answer = server.http.post("/v1/assets", content=data, headers=key)
    assert answer.status_code == 201
    return answer.json()


def get(server: Server, path: str, key: dict[str, str] = BERT) -> httpx.Response:
    return server.http.get(f"/v1/assets/{path}", headers=key)


def render(server: Server, scene: Any, path: str = "/v1/renders", key: dict[str, str] = BERT) -> httpx.Response:
    return server.http.post(path, json={"scene": scene, "settings": SMALL}, headers=key)


def test_another_key_s_asset_does_not_exist(strict: Server) -> None:
    id = uploaded(strict, OBJ + b"# secret")["id"]
    assert get(strict, id, ANNA).content == OBJ + b"# secret"
    assert get(strict, id, ANNA).headers["cache-control"].startswith("private")

    def same(found: str, other: str) -> bool:
        return found.replace(id, MISSING) == other

    for path in ("{}", "{}/scene"):
        mine, missing = (get(strict, path.format(each)) for each in (id, MISSING))
        assert is_problem(mine, 404) and same(mine.text, missing.text)
    for path in ("/v1/render", "/v1/renders"):
        mine, missing = (render(strict, mesh_scene(each), path) for each in (id, MISSING))
        assert is_problem(mine, 422, "/scene/shapes/0/asset") and same(mine.text, missing.text)
    sky = {**SCENE, "environment": {"type": "image", "asset": id}}
    assert is_problem(render(strict, sky), 422, "/scene/environment/asset")
    mine, missing = (
        strict.http.put("/v1/documents/scenes/b", json=mesh_scene(each), headers=BERT) for each in (id, MISSING)
    )
    assert is_problem(mine, 422, "/shapes/0/asset") and same(mine.text, missing.text)
    with Client(strict.url, key="bert-key") as client:
        client.start(scene=mesh_scene(id))
        refused = client.until("error")[0]["problem"]
        assert [each["pointer"] for each in refused["errors"]] == ["/scene/shapes/0/asset"]
        client.start(2)
        client.frame(2)
        client.say("update", generation=3, scene={"shapes": mesh_scene(id)["shapes"]})
        assert client.until("error")[0]["problem"] == refused
    with Client(strict.url, key="anna-key") as client:
        client.start(scene=mesh_scene(id))
        client.frame()


def test_naming_an_asset_in_a_render_does_not_give_it(strict: Server) -> None:
    """Nor where nothing reads it: a stored render gives its key the assets that it refers to."""
    id = uploaded(strict, png(np.full((2, 2, 3), 7, np.uint8)))["id"]
    unread = {**SCENE, "textures": {"unread": {"asset": id}}}
    assert is_problem(render(strict, unread), 422, "/scene/textures/unread/asset")
    assert get(strict, id).status_code == 404


def test_the_asset_of_a_shared_document_can_be_used(strict: Server) -> None:
    id = uploaded(strict, OBJ + b"# shared")["id"]
    put = partial(strict.http.put, "/v1/documents/scenes/gift", json=mesh_scene(id), headers=ANNA)
    put(params={"shared": True}).raise_for_status()
    assert get(strict, id).content == OBJ + b"# shared" and get(strict, f"{id}/scene").status_code == 200
    put(params={"shared": False}).raise_for_status()
    assert get(strict, id).status_code == 404
    put(params={"shared": True}).raise_for_status()
    body = {"scene": mesh_scene(id), "settings": ENDLESS}
    mine = strict.http.post("/v1/renders", json=body, headers=BERT).raise_for_status().json()["id"]
    strict.http.delete("/v1/documents/scenes/gift", headers=ANNA).raise_for_status()
    assert get(strict, id).status_code == 200, "an own render uses it"
    for _ in range(2):  # cancelled, then deleted
        strict.http.delete(f"/v1/renders/{mine}", headers=BERT).raise_for_status()
    assert get(strict, id).status_code == 404


def test_the_same_bytes_give_access_and_tell_nothing(strict: Server) -> None:
    first, second = (uploaded(strict, glb(gltf()), key) for key in (ANNA, BERT))
    assert first == second
    document = get(strict, f"{first['id']}/scene").raise_for_status().json()
    assert get(strict, document["shapes"][0]["asset"]).status_code == 200
