"""Batches over REST: what their renders are, what is refused, and what a restart leaves."""

from __future__ import annotations

import io
import sqlite3
import zipfile
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.server.renders.store.check import check_renders
from service.server.storage.data_check import check
from service.server.storage.database import FILE
from tests.serving import ENDLESS, KEYS, SCENE, SMALL, Server, kill, wait_until

ROUGHNESS = {"path": "/materials/ball/roughness", "values": [0.1, 0.9]}
TURN = {"turntable": 3, "degrees": 90}


def started(server: Server, over: Any, settings: Any = SMALL, **more: Any) -> str:
    body = {"scene": SCENE, "settings": settings, "over": over, **more}
    return str(server.http.post("/v1/batches", json=body).raise_for_status().json()["id"])


def status(server: Server, id: str, wait: float = 0) -> Any:
    return server.http.get(f"/v1/batches/{id}", params={"wait": wait}).raise_for_status().json()


def pixels(server: Server, render: str) -> np.ndarray:
    answer = server.http.get(f"/v1/renders/{render}/image?format=npy").raise_for_status()
    found: np.ndarray = np.load(io.BytesIO(answer.content))
    return found


@pytest.fixture(scope="module")
def done(server: Server) -> Any:
    """The status of a batch whose renders are done."""
    id = started(server, [ROUGHNESS, TURN])
    found = status(server, id, 60)
    assert found["state"] == "done" and found["counts"]["done"] == 6 and found["eta_s"] is None
    return found


def file(server: Server, batch: Any, path: str) -> bytes:
    return server.http.get(f"/v1/batches/{batch['id']}/{path}").raise_for_status().content


def test_a_render_of_a_batch_is_the_single_one(server: Server, done: Any) -> None:
    id = done["renders"][5]["id"]
    document = server.http.get(f"/v1/renders/{id}/scene").json()
    assert document["scene"]["materials"]["ball"]["roughness"] == 0.9
    assert np.allclose(document["scene"]["camera"]["position"], [4 * np.sin(np.pi / 3), 0, 4 * np.cos(np.pi / 3)])
    alone = server.http.post("/v1/renders?wait=60", json=document).json()
    assert np.array_equal(pixels(server, id), pixels(server, alone["id"]))
    assert not np.array_equal(pixels(server, id), pixels(server, done["renders"][4]["id"]))
    assert server.http.get(f"/v1/renders/{id}").json()["label"] == "roughness 0.9, 60 degrees"


def test_renders_of_batches_are_not_listed_and_not_deleted_alone(server: Server, done: Any) -> None:
    listed = {each["id"] for each in server.http.get("/v1/renders").json()}
    assert not listed & {each["id"] for each in done["renders"]}
    assert server.http.delete(f"/v1/renders/{done['renders'][0]['id']}").status_code == 409


def test_zip(server: Server, done: Any) -> None:
    with zipfile.ZipFile(io.BytesIO(file(server, done, "images.zip"))) as archive:
        assert archive.testzip() is None
        names = archive.namelist()
        assert names[0] == "0000-roughness-0.1-0-degrees.png" and len(names) == 6
        alone = server.http.get(f"/v1/renders/{done['renders'][2]['id']}/image").content
        assert archive.read(names[2]) == alone
    assert zipfile.ZipFile(io.BytesIO(file(server, done, "images.zip?format=npy"))).namelist()[1].endswith(".npy")


def test_sheet(server: Server, done: Any) -> None:
    sheet = Image.open(io.BytesIO(file(server, done, "sheet")))
    small = Image.open(io.BytesIO(file(server, done, "sheet?format=webp&width=16")))
    assert sheet.format == "PNG" and sheet.width > 3 * 32 and sheet.height > 2 * 24 and small.width < sheet.width
    assert file(server, done, "sheet") == file(server, done, "sheet") != file(server, done, "sheet?exposure=2")


@pytest.mark.parametrize("format", ["apng", "webp", "gif", "avif"])
def test_animation(server: Server, done: Any, format: str) -> None:
    shown = Image.open(io.BytesIO(file(server, done, f"animation?format={format}&fps=10&width=16")))
    assert shown.size == (16, 12) and shown.n_frames == 6  # type: ignore[attr-defined]


def test_mp4_without_ffmpeg(server: Server, done: Any) -> None:
    answer = server.http.get(f"/v1/batches/{done['id']}/animation?format=mp4")
    if answer.status_code == 200:
        assert answer.content[4:8] == b"ftyp"
    else:
        assert answer.status_code == 501 and "ffmpeg" in answer.json()["detail"]


def test_what_has_not_begun(server: Server) -> None:
    id = started(server, [{"turntable": 1000}], ENDLESS, label="long", priority=-1)
    found = status(server, id)
    assert len(found["renders"]) == 1000 and found["label"] == "long"
    last = found["renders"][-1]["id"]
    assert server.http.get(f"/v1/renders/{last}").json()["state"] == "queued"
    assert server.http.get(f"/v1/renders/{last}/image").status_code == 409
    for path in ("images.zip", "sheet", "animation"):
        assert server.http.get(f"/v1/batches/{id}/{path}").status_code == 409
    assert server.http.delete(f"/v1/batches/{id}").status_code == 204
    ended = status(server, id, 60)
    assert ended["state"] == "cancelled" and ended["counts"]["cancelled"] == 1000
    assert server.http.delete(f"/v1/batches/{id}").status_code == 204
    assert server.http.get(f"/v1/batches/{id}").status_code == 410


@pytest.mark.parametrize(
    ("over", "pointer", "detail"),
    [
        ([{"turntable": 10_001}], "/over", "SUNBOX_MAX_BATCH"),
        ([{"turntable": 101}, {"turntable": 101}], "/over", "10201"),
        ([{"path": "/materials/none/roughness", "values": [1]}], "/over/0/path", "none"),
        ([TURN, {**ROUGHNESS, "values": [0.1, 0.2, 7]}], "/over/1/values/2", "/scene/materials/ball/roughness"),
        ([TURN, {**ROUGHNESS, "values": [7, 0.2]}], "/over/1/values/0", "/scene/materials/ball/roughness"),
        ([{"patches": [{}, {"settings": {"width": 0}}]}], "/over/0/patches/1", "/settings/width"),
        ([{"patches": [{"label": "x"}]}], "/over/0/patches/0", "label"),
        ([{"turntable": 2, "values": [1]}], "/over/0/values", ""),
        ([], "/over", ""),
    ],
)
def test_refusals(server: Server, over: Any, pointer: str, detail: str) -> None:
    answer = server.http.post("/v1/batches", json={"scene": SCENE, "settings": SMALL, "over": over})
    assert answer.status_code == 422
    error = answer.json()["errors"][0]
    assert error["pointer"] == pointer and detail in error["detail"], answer.json()


def test_a_mistake_of_the_base_is_its_own(server: Server) -> None:
    scene = {**SCENE, "shapes": [{"type": "sphere", "material": "none"}]}
    answer = server.http.post("/v1/batches", json={"scene": scene, "settings": SMALL, "over": [TURN]})
    assert answer.status_code == 422 and answer.json()["errors"][0]["pointer"].startswith("/scene/shapes/0")
    assert server.http.get("/v1/batches/0123/sheet").status_code == 404


def test_an_idempotency_key_starts_one_batch(server: Server) -> None:
    body = {"scene": SCENE, "settings": SMALL, "over": [{"turntable": 1}]}
    first, again = (
        server.http.post("/v1/batches", json=body, headers={"idempotency-key": "sweep"}).json() for _ in range(2)
    )
    assert first == again
    other = server.http.post("/v1/batches", json={**body, "label": "x"}, headers={"idempotency-key": "sweep"})
    assert other.status_code == 409


def test_a_sheet_is_a_picture_like_others(strict: Server) -> None:
    """Of two pictures of 768 pixels each, where 1 000 are the most."""
    key = {"authorization": f"Bearer {KEYS[0]}"}
    body = {"scene": SCENE, "settings": SMALL, "over": [{"turntable": 2}]}
    id = strict.http.post("/v1/batches", json=body, headers=key).raise_for_status().json()["id"]
    assert strict.http.get(f"/v1/batches/{id}", params={"wait": 60}, headers=key).json()["state"] == "done"
    assert strict.http.get(f"/v1/batches/{id}/sheet", headers=key).status_code == 413


def test_a_restart_goes_on(mortal: Server) -> None:
    """After a kill, with one render at a time; what was done stays, and the data folder is sound."""
    folder = mortal.folder / "data"
    id = started(mortal, [{"turntable": 5, "degrees": 90}], {**SMALL, "max_samples": 512})
    wait_until(lambda: status(mortal, id)["counts"]["done"] >= 2)
    gone = started(mortal, [ROUGHNESS], ENDLESS)  # later, as none of a key's renders interrupts another
    mortal.http.delete(f"/v1/batches/{gone}").raise_for_status()
    cut = started(mortal, [{"turntable": 3}], ENDLESS)
    before = {each["id"]: pixels(mortal, each["id"]) for each in status(mortal, id)["renders"][:2]}
    kill(mortal)
    with closing(sqlite3.connect(folder / FILE)) as database, database:  # between that and its renders
        database.execute("UPDATE batches SET cancelled = 1 WHERE id = ?", (cut,))
    mortal.start()
    found = status(mortal, id, 60)
    assert found["state"] == "done" and found["counts"]["done"] == 5
    assert all(np.array_equal(picture, pixels(mortal, render)) for render, picture in before.items())
    assert status(mortal, gone)["state"] == "cancelled"
    assert status(mortal, cut)["state"] == "cancelled" and status(mortal, cut)["counts"]["cancelled"] == 3
    document = mortal.http.get(f"/v1/renders/{found['renders'][4]['id']}/scene").json()
    alone = mortal.http.post("/v1/renders?wait=60", json=document).json()
    assert np.array_equal(pixels(mortal, alone["id"]), pixels(mortal, found["renders"][4]["id"]))
    assert Image.open(io.BytesIO(file(mortal, found, "sheet"))).width > 32
    assert mortal.stop() == 0
    report = check(folder)
    check_renders(folder, report)
    assert report.faults == []
