"""What users save stays: valid, whole, and with its assets."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
import uvicorn
from starlette.requests import Request

from service.config import Config
from service.problems import Forbidden, NotFound, TooLarge, Unavailable
from service.server import launch
from service.server.assets import AssetStore
from service.server.http.downloads import Downloads, FileAnswer
from service.server.routes.documents import document
from service.server.storage import database, documents, migrations
from service.server.storage.database import DamagedFile
from service.server.storage.documents import Documents, checked
from tests.asset_files import OBJ
from tests.calls import is_problem
from tests.serving import SCENE, Server

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


def large_scene() -> dict[str, Any]:
    """0.9 MB of it."""
    ball = {"type": "sphere", "center": [0.123456789, 0.123456789, 0.123456789], "radius": 1, "material": "ball"}
    return {**SCENE, "shapes": [ball] * 10_000}


def test_a_document_comes_and_goes(server: Server) -> None:
    http: httpx.Client = server.http
    address = "/v1/documents/materials/my%20grey%20~%20%C3%A4"
    name = "my grey ~ ä"
    answer = http.put(address, json=MATERIAL)
    assert (answer.status_code, answer.json()) == (201, {"name": name, "title": name})
    answer = http.put(address, json={**MATERIAL, "albedo": 0.5}, params={"title": "Grey"})
    assert (answer.status_code, answer.json()["title"]) == (200, "Grey")
    assert http.get(address).json() == {"type": "diffuse", "albedo": 0.5}
    assert {"name": name, "title": "Grey"} in http.get("/v1/documents/materials").json()
    assert http.delete(address).status_code == 204
    assert is_problem(http.get(address), 404) and is_problem(http.delete(address), 404)
    assert name not in {each["name"] for each in http.get("/v1/documents/materials").json()}


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
    for name in ("x" * 101, "a%0Ab", "a%C2%9Bb", "a%E2%80%AEb"):
        assert is_problem(http.put(f"/v1/documents/scenes/{name}", json=SCENE), 422, "/name")
    assert is_problem(http.get("/v1/documents/scenes/a"), 404)
    allowed = http.post("/v1/documents/scenes/a", json=SCENE)
    assert is_problem(allowed, 405) and allowed.headers["allow"] == "DELETE, GET, HEAD, PUT"


def test_documents_survive_a_kill(saved: Documents, store: AssetStore, tmp_path: Path) -> None:
    """Killed in the middle of its writing: what it was told to be saved is there, and whole."""
    program = f"""
import sys
from pathlib import Path
from service.server.assets import AssetStore
from service.server.storage.documents import Documents, checked
folder = Path({str(tmp_path)!r})
documents = Documents(folder, AssetStore(folder))
for i in range(10 ** 6):
    grey = {{"type": "diffuse", "albedo": (i % 1000) / 1000}}
    documents.put("materials", f"m{{i % 50}}", checked("materials", grey))
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
    names = [entry["name"] for entry in saved.names("materials")[0]]
    found = {name: json.loads(saved.get("materials", name))["albedo"] for name in names}
    assert len(found) == 50
    for i in range(last - 48, last + 1):
        assert found[f"m{i % 50}"] >= (i % 1000) / 1000
    with sqlite3.connect(tmp_path / "documents.sqlite3") as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert database.execute("PRAGMA journal_mode").fetchone() == ("wal",)


def test_documents_give_their_room_back(saved: Documents, tmp_path: Path) -> None:
    """Deleted or replaced by smaller ones, also while somebody else has the file open."""
    file = tmp_path / "documents.sqlite3"
    saved.put("scenes", "0", checked("scenes", SCENE))
    little = saved.usage().bytes
    with closing(sqlite3.connect(file)) as other:
        other.execute("SELECT count(*) FROM documents").fetchone()
        for name in "123":
            saved.put("scenes", name, checked("scenes", large_scene()))
        assert saved.usage().bytes > little + 2_500_000
        saved.delete("scenes", "1")
        saved.delete("scenes", "3")
        saved.put("scenes", "2", checked("scenes", SCENE))
        assert saved.usage().bytes < little + 50_000
    saved.put("scenes", "0", checked("scenes", SCENE))
    assert sum(path.stat().st_size for path in tmp_path.glob("documents*")) < little + 50_000


def test_the_log_does_not_stay_large(saved: Documents, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody who reads all the time keeps SQLite from deleting it."""
    monkeypatch.setattr(database, "LOG_BYTES", 50_000)
    saved.put("scenes", "0", checked("scenes", SCENE))
    with closing(sqlite3.connect(tmp_path / "documents.sqlite3")) as other:
        other.execute("SELECT count(*) FROM documents").fetchone()
        large = checked("scenes", large_scene())
        for _ in range(6):  # it is written back when it has grown to 4 MB, and begins anew at the next saving
            saved.put("scenes", "1", large)
        log = tmp_path / "documents.sqlite3-wal"
        assert log.stat().st_size < 3_000_000


def test_documents_of_an_earlier_version_are_converted(saved: Documents, tmp_path: Path) -> None:
    """Nothing is lost, the pages that deleted ones left go back to the disk, and it happens once."""
    file, body = tmp_path / "documents.sqlite3", json.dumps(SCENE)
    with closing(sqlite3.connect(file)) as old, old:
        old.executescript(
            """
            PRAGMA journal_mode = WAL;
            CREATE TABLE documents (kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL,
                PRIMARY KEY (kind, name)) WITHOUT ROWID;
            CREATE TABLE uses (asset TEXT NOT NULL, kind TEXT NOT NULL, name TEXT NOT NULL,
                PRIMARY KEY (asset, kind, name)) WITHOUT ROWID;
            """
        )
        old.execute("INSERT INTO documents VALUES ('scenes', 'a', 'A', ?)", (body,))
        old.execute("INSERT INTO documents VALUES ('scenes', 'b', 'B', ?)", ("x" * 4_000_000,))
        old.execute("INSERT INTO uses VALUES ('sha256:1', 'scenes', 'a')")
        old.execute("DELETE FROM documents WHERE name = 'b'")
    assert file.stat().st_size > 4_000_000
    saved.prepare()
    assert file.stat().st_size < 200_000
    assert saved.names("scenes")[0] == [{"name": "a", "title": "A"}] and saved.get("scenes", "a") == body.encode()
    with saved.assets_in_use() as used:
        assert used == {"sha256:1"}
    before = file.stat().st_mtime_ns
    saved.prepare()
    assert file.stat().st_mtime_ns == before
    saved.put("scenes", "b", checked("scenes", large_scene()))
    saved.delete("scenes", "b")
    assert saved.usage().bytes < 200_000


def test_a_conversion_that_was_killed_goes_on(saved: Documents, tmp_path: Path) -> None:
    """The tables are new, and the file has not been compacted yet."""
    file = tmp_path / "documents.sqlite3"
    saved.put("materials", "m", checked("materials", MATERIAL))
    with closing(sqlite3.connect(file)) as database:
        database.execute("PRAGMA auto_vacuum = NONE")
        database.execute("VACUUM")
        assert database.execute("PRAGMA auto_vacuum").fetchone() == (0,)
    saved.prepare()
    with closing(sqlite3.connect(file)) as database:
        assert database.execute("PRAGMA auto_vacuum").fetchone() == (1,)


def test_looking_for_a_document_reads_no_other(saved: Documents) -> None:
    for name in "bcd":
        saved.put("scenes", name, checked("scenes", large_scene()))
    saved.put("scenes", "a", checked("scenes", SCENE))

    def bytes_read() -> int:
        return int(Path("/proc/self/io").read_text().split()[1])

    before = bytes_read()
    saved.get("scenes", "a")
    saved.names("scenes")[0]
    assert bytes_read() - before < 500_000


def test_a_large_document_is_sent_from_a_file(tmp_path: Path) -> None:
    """In memory, those that slow clients fetch would add up."""
    text = b'{"a": ' + b"1" * 3_000_000 + b"}"
    stored = SimpleNamespace(documents=SimpleNamespace(get=lambda *key: text))
    saved = SimpleNamespace(storage=stored, downloads=Downloads(tmp_path))
    scope = {"type": "http", "app": SimpleNamespace(state=SimpleNamespace(sunbox=saved)), "client": ("::1", 1)}
    answer: Any = asyncio.run(document(Request(scope), "scenes", "large"))
    assert isinstance(answer, FileAnswer) and answer.media_type == "application/json"
    with open(answer._file.fileno(), "rb", closefd=False) as file:
        file.seek(0)
        assert file.read() == text


def test_a_damaged_file_is_told_of(
    saved: Documents, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the start by its name, and it is left as it is; later as what the caller can't help."""
    file, nonsense = tmp_path / "documents.sqlite3", b"no database at all" * 100
    file.write_bytes(nonsense)
    with pytest.raises(Unavailable, match="disk"):
        saved.names("scenes")[0]
    monkeypatch.setattr(uvicorn.Server, "run", lambda self, sockets: pytest.fail("it was started"))
    assert launch.run(Config(port=0, data_dir=tmp_path)) == 1
    assert str(file) in caplog.text and "backup" in caplog.text and "Traceback" not in caplog.text
    assert file.read_bytes() == nonsense


def test_a_later_version_s_file_is_refused(saved: Documents, tmp_path: Path) -> None:
    saved.put("materials", "m", checked("materials", MATERIAL))
    with closing(sqlite3.connect(tmp_path / "documents.sqlite3")) as database:
        database.execute("PRAGMA user_version = 99")
    with pytest.raises(DamagedFile, match="newer version"):
        saved.prepare()


def dim(albedo: float) -> documents.CheckedDocument:
    return checked("materials", {"type": "diffuse", "albedo": albedo})


def test_documents_belong_to_who_saved_them(saved: Documents, store: AssetStore) -> None:
    saved.put("materials", "old", dim(0.1))  # before there were keys
    for owner, albedo in (("anna", 0.2), ("bert", 0.3)):
        saved.put("materials", "mine", dim(albedo), owner.title(), owner)
    assert saved.names("materials", "anna")[0] == [{"name": "mine", "title": "Anna"}, {"name": "old", "title": "old"}]
    assert json.loads(saved.get("materials", "mine", "bert"))["albedo"] == 0.3
    with pytest.raises(NotFound):
        saved.get("materials", "mine", "carl")
    saved.put("materials", "gift", dim(0.4), None, "anna", shared=True)
    saved.put("materials", "gift", dim(0.5), None, "anna")  # as it was: shared
    assert json.loads(saved.get("materials", "gift", "bert"))["albedo"] == 0.5
    with pytest.raises(Forbidden):
        saved.delete("materials", "gift", "bert")
    saved.put("materials", "gift", dim(0.6), "Bert's", "bert")  # one of his own, which he sees in its place
    assert {"name": "gift", "title": "Bert's"} in saved.names("materials", "bert")[0]
    assert json.loads(saved.get("materials", "gift", "anna"))["albedo"] == 0.5
    saved.put("materials", "gift", dim(0.5), None, "anna", shared=False)
    with pytest.raises(NotFound):
        saved.get("materials", "gift", "carl")
    with pytest.raises(NotFound):
        saved.delete("materials", "mine", "carl")
    saved.delete("materials", "old", "carl")
    saved.delete("materials", "mine", "anna")
    assert [entry["name"] for entry in saved.names("materials", "anna")[0]] == ["gift"]
    mesh = store.add(OBJ).id
    saved.put("scenes", "a", checked("scenes", mesh_scene(mesh)), None, "anna")
    saved.put("scenes", "a", checked("scenes", mesh_scene(mesh)), None, "bert")
    saved.delete("scenes", "a", "anna")
    with saved.assets_in_use() as used:
        assert used == {mesh}  # the other one's


def test_one_key_s_documents_have_a_bound(tmp_path: Path, store: AssetStore) -> None:
    saved = Documents(tmp_path, store, each=2 * len(dim(0.5).body) + 5)
    for name in "ab":
        saved.put("materials", name, dim(0.5), None, "anna")
    with pytest.raises(TooLarge, match="SUNBOX_MAX_KEY_DOCUMENTS"):
        saved.put("materials", "c", dim(0.5), None, "anna")
    saved.put("materials", "b", dim(0.6), None, "anna")  # in the place of as much
    saved.put("materials", "c", dim(0.5), None, "bert")
    for name in "abcd":
        saved.put("materials", name, dim(0.5))  # without a key
    saved.delete("materials", "a", "anna")
    saved.put("materials", "c", dim(0.5), None, "anna")


def test_a_document_is_replaced_only_if_it_is_the_expected_one(server: Server) -> None:
    http, address = server.http, "/v1/documents/materials/tagged"
    tags = []
    for albedo, headers, status in (
        (0.1, {"if-match": "*"}, 412),
        (0.1, {"if-none-match": "*"}, 201),
        (0.2, {"if-none-match": "*"}, 412),
        (0.2, {"if-match": "*"}, 200),
    ):
        answer = http.put(address, json={**MATERIAL, "albedo": albedo}, headers=headers)
        assert answer.status_code == status
        tags += [answer.headers["etag"]] if status < 300 else []
    first, second = tags
    assert is_problem(http.put(address, json=MATERIAL, headers={"if-match": first}), 412)
    got = http.get(address)
    assert got.headers["etag"] == second and got.json()["albedo"] == 0.2
    unchanged = http.get(address, headers={"if-none-match": f'"other", W/{second}'})
    assert unchanged.status_code == 304 and not unchanged.content
    assert http.get(address, headers={"if-none-match": first}).status_code == 200
    assert http.put(address, json=MATERIAL, headers={"if-match": f"{first}, {second}"}).status_code == 200
    assert is_problem(http.delete(address, headers={"if-match": second}), 412)
    third = http.get(address).headers["etag"]
    assert http.delete(address, headers={"if-match": third}).status_code == 204
    assert is_problem(http.put(address, json=MATERIAL, headers={"if-match": third}), 412)


def test_what_is_saved_by_link_is_listed_to_nobody_and_read_by_all(saved: Documents) -> None:
    saved.put("materials", "secret", dim(0.2), None, "anna", shared=documents.BY_LINK)
    saved.put("materials", "secret", dim(0.3), None, "anna")  # as it was
    assert saved.names("materials", "anna")[0] == saved.names("materials", "bert")[0] == []
    assert json.loads(saved.get("materials", "secret", "bert"))["albedo"] == 0.3
    saved.put("materials", "secret", dim(0.3), None, "anna", shared=documents.SHARED)
    assert len(saved.names("materials", "bert")[0]) == 1


def test_what_is_saved_by_link_goes_when_nobody_reads_it(
    saved: Documents, store: AssetStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    asset, day = store.add(OBJ).id, [0.0]
    monkeypatch.setattr(documents, "time", SimpleNamespace(time=lambda: day[0] * documents.DAY_S))
    for name in ("read", "forgotten"):
        saved.put("scenes", name, checked("scenes", mesh_scene(asset)), None, "anna", shared=documents.BY_LINK)
    day[0] = 60
    saved.get("scenes", "read", "bert")
    day[0] = 100
    saved.prepare()
    saved.get("scenes", "read", "carl")
    with pytest.raises(NotFound):
        saved.get("scenes", "forgotten", "anna")
    day[0] = 300
    saved.put("materials", "other", dim(0.2))
    with saved.assets_in_use() as used:
        assert not used, "assets of links that are gone may make room"


def test_names_come_in_pages(saved: Documents) -> None:
    for i in range(5):
        saved.put("materials", f"m{i}", dim(0.1), f"title {9 - i}", "anna")
    page, more = saved.names("materials", "anna", 3)
    assert [each["name"] for each in page] == ["m2", "m1", "m0"] and more
    page, more = saved.names("materials", "anna", 3, "m2")
    assert [each["name"] for each in page] == ["m4", "m3"] and not more


def test_links_of_before_are_listed_no_more(tmp_path: Path, store: AssetStore) -> None:
    before = next(i for i, each in enumerate(migrations.MIGRATIONS) if "only a link" in each.about)
    name = "shared-0123456789abcdef"
    with sqlite3.connect(tmp_path / "documents.sqlite3") as old:
        for each in migrations.MIGRATIONS[:before]:
            for statement in each.statements:
                old.execute(statement)
        old.execute(f"PRAGMA user_version = {before}")
        for each, shared in ((name, 1), ("shared-lamp", 1), ("shared-fedcba9876543210", 0)):
            row = ("materials", each, "anna", shared, each, 2, json.dumps(MATERIAL))
            old.execute("INSERT INTO documents VALUES (?, ?, ?, ?, ?, ?, ?)", row)
    saved = Documents(tmp_path, store)
    saved.prepare()
    assert [each["name"] for each in saved.names("materials", "bert")[0]] == ["shared-lamp"]
    assert [each["name"] for each in saved.names("materials", "anna")[0]] == [
        "shared-fedcba9876543210",
        "shared-lamp",
    ]
    assert json.loads(saved.get("materials", name, "bert")) == MATERIAL


def test_pages_and_links_over_http(server: Server) -> None:
    for name in ("page-a", "page-b"):
        assert server.http.put(f"/v1/documents/materials/{name}", json=MATERIAL).status_code == 201
    link = server.http.put("/v1/documents/materials/by-link", params={"by_link": "true"}, json=MATERIAL)
    assert link.status_code == 201 and server.http.get("/v1/documents/materials/by-link").json() == MATERIAL
    names, address = [], "/v1/documents/materials?limit=1"
    while address:
        answer = server.http.get(address)
        names += [each["name"] for each in answer.json()]
        address = answer.links.get("next", {}).get("url", "") and f"/v1/documents/{answer.links['next']['url']}"
    assert names == sorted(set(names)) and {"page-a", "page-b"} <= set(names) and "by-link" not in names
    for name in ("page-a", "page-b", "by-link"):
        server.http.delete(f"/v1/documents/materials/{name}")
