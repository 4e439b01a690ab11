"""What users save stays: valid, whole, and with its assets."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.assets import AssetStore
from service.documents import Documents
from service.problems import NotFound, TooLarge, Unavailable
from service.quota import Quota
from tests.serving import SCENE, Server
from tests.test_rest import OBJ, is_problem

MATERIAL = {"type": "diffuse", "albedo": [0.1, 0.2, 0.3]}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path)
    yield store
    store.close()


@pytest.fixture
def saved(tmp_path: Path, store: AssetStore) -> Documents:
    return Documents(tmp_path, store)


def mesh_scene(asset: str) -> dict[str, Any]:
    return {**SCENE, "shapes": [{"type": "mesh", "asset": asset, "material": "ball"}]}


def test_a_document_comes_and_goes(server: Server) -> None:
    http: httpx.Client = server.http
    address = "/v1/documents/materials/my%20grey%20~%20%C3%A4"
    name = "my grey ~ ä"
    answer = http.put(address, json=MATERIAL)
    assert (answer.status_code, answer.json()) == (201, {"name": name, "title": name})
    answer = http.put(address, json={**MATERIAL, "albedo": 0.5}, params={"title": "Grey"})
    assert (answer.status_code, answer.json()["title"]) == (200, "Grey")
    assert http.get(address).json() == {"type": "diffuse", "albedo": 0.5}
    assert http.get("/v1/documents/materials").json() == [{"name": name, "title": "Grey"}]
    assert http.delete(address).status_code == 204
    assert is_problem(http.get(address), 404) and is_problem(http.delete(address), 404)
    assert http.get("/v1/documents/materials").json() == []


def test_only_valid_documents_are_saved(server: Server) -> None:
    http = server.http
    bad = {**SCENE, "materials": {**SCENE["materials"], "ball": {"type": "diffuse", "albedo": 2}}}
    assert is_problem(http.put("/v1/documents/scenes/a", json=bad), 422, "/materials/ball/albedo")
    missing = "sha256:" + "0" * 64
    assert is_problem(http.put("/v1/documents/scenes/a", json=mesh_scene(missing)), 422, "/shapes/0/asset")
    assert is_problem(http.put("/v1/documents/materials/a", json={**MATERIAL, "albdo": 1}), 422, "/albdo")
    assert is_problem(http.put("/v1/documents/scenes/a", content=b"{"), 400)
    assert is_problem(http.put("/v1/documents/scenes/a", content=b"{}", headers={"content-type": "text/html"}), 415)
    assert is_problem(http.put("/v1/documents/shapes/a", json={}), 404)
    assert is_problem(http.put(f"/v1/documents/scenes/{'x' * 101}", json=SCENE), 422, "/name")
    assert is_problem(http.get("/v1/documents/scenes/a"), 404)
    allowed = http.post("/v1/documents/scenes/a", json=SCENE)
    assert is_problem(allowed, 405) and allowed.headers["allow"] == "DELETE, GET, HEAD, PUT"


def test_documents_survive_a_kill(saved: Documents, store: AssetStore, tmp_path: Path) -> None:
    """Killed in the middle of its writing: what it was told to be saved is there, and whole."""
    program = f"""
import sys
from pathlib import Path
from service.assets import AssetStore
from service.documents import Documents
folder = Path({str(tmp_path)!r})
documents = Documents(folder, AssetStore(folder))
for i in range(10 ** 6):
    documents.put("materials", f"m{{i % 50}}", {{"type": "diffuse", "albedo": (i % 1000) / 1000}})
    print(i, flush=True)
"""
    writer = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    for line in writer.stdout:
        if int(line) >= 120:
            break
    os.kill(writer.pid, signal.SIGKILL)
    last = int((writer.stdout.read().split() or [line])[-1])
    writer.wait()
    found = {entry["name"]: saved.get("materials", entry["name"])["albedo"] for entry in saved.names("materials")}
    assert len(found) == 50
    for i in range(last - 48, last + 1):
        assert found[f"m{i % 50}"] >= (i % 1000) / 1000
    with sqlite3.connect(tmp_path / "documents.sqlite3") as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert database.execute("PRAGMA journal_mode").fetchone() == ("wal",)


def test_the_log_may_go_while_it_is_measured(saved: Documents, tmp_path: Path) -> None:
    saved.put("materials", "m", MATERIAL)
    size = saved.bytes
    (tmp_path / "documents.sqlite3-wal").symlink_to("gone")  # listed, and not there when it is looked at
    assert saved.bytes == size > 0


def test_a_damaged_file_is_told_of(saved: Documents, tmp_path: Path) -> None:
    (tmp_path / "documents.sqlite3").write_bytes(b"no database at all" * 100)
    with pytest.raises(Unavailable, match="disk"):
        saved.names("scenes")


def test_assets_of_documents_are_never_evicted(saved: Documents, store: AssetStore, tmp_path: Path) -> None:
    ids = [store.add(OBJ + b"#" * (1000 + i)).id for i in range(4)]
    for i, id in enumerate(ids):
        os.utime(tmp_path / "assets" / id.removeprefix("sha256:"), (i, i))
    saved.put("scenes", "mine", mesh_scene(ids[0]))
    store.read(ids[1])  # used just now
    quota = Quota(tmp_path, 6000, saved.assets_in_use)
    quota.make_room(0)
    assert all(store.holds(id) for id in ids)
    quota.make_room(6000 - quota.used() + 500)
    assert [store.holds(id) for id in ids] == [True, True, False, True]
    quota.make_room(4000)
    assert [store.holds(id) for id in ids] == [True, False, False, False]
    with pytest.raises(Unavailable, match="SUNBOX_DATA_QUOTA"):
        quota.make_room(5900)
    with pytest.raises(TooLarge):
        quota.make_room(6001)
    saved.delete("scenes", "mine")
    quota.make_room(5900)
    assert quota.used() == 0 and not store.holds(ids[0])
    with pytest.raises(NotFound):
        store.read(ids[0])
