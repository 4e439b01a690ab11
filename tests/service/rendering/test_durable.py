"""Renders outlive the server: every process is killed at any moment, and the next start goes on to the same bits."""

from __future__ import annotations

import asyncio
import json
import sqlite3
import threading
import time
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from gpu import Renderer
from service.config import MIB, Config
from service.document import parse_settings
from service.document.quality import resolve
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.store import RenderStore
from service.server.requests.request_parser import folded
from service.server.storage.asset_access import NO_USES
from service.server.storage.database import FILE
from tests.serving import ENDLESS, KEYS, PATIENCE_S, SCENE, SMALL, Server, kill, wait_until

LONG = {"width": 96, "height": 96, "max_samples": 500, "seed": 3}
ANNA, BERT = ({"authorization": f"Bearer {key}"} for key in KEYS)


def start(server: Server, settings: Any = SMALL, headers: Any = None, **more: Any) -> str:
    body = {"scene": SCENE, "settings": settings, **more}
    return str(server.http.post("/v1/renders", json=body, headers=headers).raise_for_status().json()["id"])


def status(server: Server, id: str, wait: float = 0) -> dict[str, Any]:
    found: dict[str, Any] = server.http.get(f"/v1/renders/{id}", params={"wait": wait}).raise_for_status().json()
    return found


def pixels(server: Server, id: str, aov: str = "color") -> bytes:
    return server.http.get(f"/v1/renders/{id}/image?format=npy&aov={aov}").raise_for_status().content


def until_samples(server: Server, id: str, samples: int) -> dict[str, Any]:
    by = time.monotonic() + PATIENCE_S
    while (found := status(server, id))["samples"] < samples:
        assert time.monotonic() < by and found["state"] in ("queued", "running"), found
        time.sleep(0.02)
    return found


def until_checkpoint(server: Server, id: str) -> None:
    wait_until((server.folder / "data" / "renders" / f"{id}.checkpoint").exists)


@pytest.fixture(scope="module")
def undisturbed(server: Server) -> bytes:
    """The picture of LONG from a server that nobody kills."""
    id = start(server, LONG)
    assert status(server, id, PATIENCE_S)["state"] == "done"
    return pixels(server, id)


def test_killed_and_ended_servers_leave_their_renders_to_the_next(undisturbed: bytes, mortal: Server) -> None:
    done = start(mortal, label="mine", priority=3)
    told = status(mortal, done, PATIENCE_S)
    assert told["state"] == "done" and (told["label"], told["priority"]) == ("mine", 3)
    times = [datetime.fromisoformat(told[name]) for name in ("created", "started", "ended")]
    assert times == sorted(times) and abs((times[2] - datetime.now(UTC)).total_seconds()) < 600
    seen = {aov: pixels(mortal, done, aov) for aov in ("color", "variance", "normal")}
    old = start(mortal)
    assert status(mortal, old, PATIENCE_S)["state"] == "done"
    running = start(mortal, LONG)
    queued = [start(mortal, {**SMALL, "seed": seed}) for seed in range(3)]
    waits = status(mortal, queued[0])
    assert (waits["started"], waits["ended"]) == (None, None) and waits["created"] >= told["ended"]
    until_checkpoint(mortal, running)
    before = until_samples(mortal, running, 100)
    kill(mortal)

    with closing(sqlite3.connect(mortal.folder / "data" / FILE)) as file, file:  # time counts while it is down
        file.execute("UPDATE renders SET ended_at = ended_at - 90000 WHERE id = ?", (old,))
    mortal.start()
    assert mortal.http.get(f"/v1/renders/{old}").status_code == 410
    assert status(mortal, done) == told
    after = status(mortal, running)
    assert after["samples"] > 0 and before["elapsed_s"] - after["elapsed_s"] < 10
    assert {aov: pixels(mortal, done, aov) for aov in seen} == seen  # brought back from the disk
    gone_on = until_samples(mortal, running, after["samples"] + 50)
    assert gone_on["elapsed_s"] > after["elapsed_s"]
    assert {status(mortal, id)["state"] for id in queued} == {"queued"}
    assert mortal.stop() == 0  # this time in good order: nothing is lost, and nothing is cancelled

    mortal.start()
    assert mortal.http.get(f"/v1/renders/{old}").status_code == 410  # and it is remembered
    assert status(mortal, running)["samples"] >= gone_on["samples"]
    ends = []
    for id in queued:
        assert status(mortal, id, PATIENCE_S)["state"] == "done"
        ends.append(status(mortal, running)["state"])
    assert ends == ["done"] * 3  # the one that was running went first, the others in their order
    assert pixels(mortal, running) == undisturbed
    assert mortal.http.delete(f"/v1/renders/{running}").status_code == 204  # of an ended one its picture goes
    assert mortal.http.get(f"/v1/renders/{running}").status_code == 410
    assert mortal.http.get(f"/v1/renders/{running}/image").status_code == 410
    assert running not in [each["id"] for each in mortal.http.get("/v1/renders").json()]
    for gone in (old, running):
        assert not list((mortal.folder / "data" / "renders").glob(f"{gone}*"))
    cancelled = start(mortal, ENDLESS)
    until_checkpoint(mortal, cancelled)
    assert mortal.http.delete(f"/v1/renders/{cancelled}").status_code == 204
    kill(mortal)

    mortal.start()
    assert status(mortal, cancelled)["state"] == "cancelled" and status(mortal, cancelled)["samples"] > 0
    assert pixels(mortal, cancelled)
    assert mortal.http.get(f"/v1/renders/{running}").status_code == 410
    assert mortal.http.delete(f"/v1/renders/{cancelled}").status_code == 204
    assert mortal.http.get(f"/v1/renders/{cancelled}").status_code == 410
    assert mortal.http.delete(f"/v1/renders/{cancelled}").status_code == 410


@pytest.mark.slow
def test_renders_with_large_documents_share_little_memory_after_a_restart(gpu: Renderer, tmp_path: Path) -> None:
    """All pictures would fit into the memory, but no document could be read beside them. What they wait for stops
    nobody else."""
    rng = np.random.default_rng(1)
    faces = rng.integers(0, 3000, (3000, 3))
    mesh = {"type": "mesh", "vertices": rng.random((3000, 3)).round(6).tolist(), "faces": faces.tolist()}
    document = folded({**SCENE, "shapes": [*SCENE["shapes"], {**mesh, "material": "ball"}]})
    settings = resolve(parse_settings({"width": 170, "height": 170, "max_samples": 2}, "", Config()))
    store, ids = RenderStore(tmp_path / "data"), [f"{number:032x}" for number in range(8)]

    async def stored() -> None:
        for id in ids:
            order = Order(id, "", settings, created_at=time.time(), bytes=len(document))
            await store.insert(order, Outcome("running"), document, NO_USES)
        await store.close()

    asyncio.run(stored())
    server = Server(tmp_path, SUNBOX_MEMORY=str(64 * MIB))
    try:
        image = server.http.post("/v1/render", json={"scene": SCENE, "settings": SMALL})
        assert image.status_code == 200
        assert {status(server, id, PATIENCE_S)["state"] for id in ids} == {"done"}
        assert "has to wait" in server.log.read_text()
    finally:
        kill(server)


def submit(server: Server, key: str | None, body: Any, headers: Any = ANNA) -> httpx.Response:
    sent = {**headers, "content-type": "application/json"} | ({} if key is None else {"idempotency-key": key})
    text = body if isinstance(body, str) else json.dumps(body)
    return server.http.post("/v1/renders", content=text, headers=sent)


def ended(server: Server, answer: httpx.Response, headers: Any) -> None:
    """Wait until a render that was accepted has ended."""
    assert answer.status_code == 202, answer.text
    found = server.http.get(f"/v1/{answer.headers['location']}", params={"wait": PATIENCE_S}, headers=headers)
    assert found.json()["state"] == "done"


def test_an_idempotency_key_gives_one_render(strict: Server) -> None:
    body = {"scene": SCENE, "settings": SMALL, "priority": 1}
    answers: list[httpx.Response] = []
    threads = [threading.Thread(target=lambda: answers.append(submit(strict, "once", body))) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {answer.status_code for answer in answers} == {202}
    (id,) = {answer.json()["id"] for answer in answers}
    assert {answer.headers["location"] for answer in answers} == {f"renders/{id}"}
    same = {**SCENE, "camera": {"target": [0, 0.0, 0], "position": [0, 0, 4.0]}}
    text = json.dumps({"priority": 1, "settings": SMALL, "scene": same}, indent=2)
    assert submit(strict, "once", text).json()["id"] == id
    assert submit(strict, "once", {**body, "priority": 2}).status_code == 409
    others = [submit(strict, "once", body, BERT), submit(strict, None, body)]
    for answer, headers in zip(others, (BERT, ANNA), strict=True):
        assert answer.json()["id"] != id
        ended(strict, answer, headers)


def test_only_an_accepted_request_takes_a_key(strict: Server) -> None:
    body = {"scene": SCENE, "settings": SMALL}
    assert submit(strict, "later", {**body, "settings": {"width": 0}}).status_code == 422
    ended(strict, submit(strict, "later", body), ANNA)
    for wrong in ("", "x" * 201):
        assert submit(strict, wrong, body).status_code == 422
    ended(strict, submit(strict, "x" * 200, body), ANNA)


def test_a_full_owner_is_refused_unread_but_for_a_repetition(strict: Server) -> None:
    body = {"scene": SCENE, "settings": ENDLESS}
    answers = [submit(strict, name, body) for name in ("first", "second")]
    assert submit(strict, "third", "no JSON").status_code == 429
    assert submit(strict, None, "no JSON").status_code == 429
    assert submit(strict, "first", "no JSON").status_code == 400
    assert submit(strict, "first", body).json()["id"] == answers[0].json()["id"]
    for answer in answers:
        strict.http.delete(f"/v1/{answer.headers['location']}", headers=ANNA).raise_for_status()


@pytest.mark.parametrize(
    ("wrong", "pointer"),
    [
        ({"label": "x" * 201}, "/label"),
        ({"label": 3}, "/label"),
        ({"priority": 11}, "/priority"),
        ({"priority": 0.5}, "/priority"),
        ({"priority": True}, "/priority"),
        ({"lable": "x"}, "/lable"),
    ],
)
def test_labels_and_priorities_are_checked(strict: Server, wrong: Any, pointer: str) -> None:
    answer = submit(strict, None, {"scene": SCENE, "settings": SMALL, **wrong})
    assert answer.status_code == 422 and [each["pointer"] for each in answer.json()["errors"]] == [pointer]


def test_lists_have_pages(strict: Server) -> None:
    def labelled(label: str) -> str:
        answer = submit(strict, None, {"scene": SCENE, "settings": SMALL, "label": label}, BERT)
        ended(strict, answer, BERT)
        return str(answer.json()["id"])

    ids = [labelled("page") for _ in range(5)]
    labelled("pages")
    found, address = [], "/v1/renders?label=page&limit=2"
    while address:
        answer = strict.http.get(address, headers=BERT)
        assert len(answer.json()) <= 2 and all(each["label"] == "page" for each in answer.json())
        found += [each["id"] for each in answer.json()]
        address = "/v1/" + answer.links["next"]["url"] if "next" in answer.links else ""
    assert found == ids[::-1]
    assert len(strict.http.get("/v1/renders?state=done&label=page", headers=BERT).json()) == 5
    assert strict.http.get("/v1/renders?label=page", headers=ANNA).json() == []
    for wrong in ("state=ended", "limit=0", "limit=201", "limit=x", f"after={'x' * 22}"):
        assert strict.http.get(f"/v1/renders?{wrong}", headers=BERT).status_code == 422


def events(server: Server, id: str) -> list[tuple[str, dict[str, Any]]]:
    found, name = [], ""
    with server.http.stream("GET", f"/v1/renders/{id}/events") as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        for line in answer.iter_lines():
            field, _, value = line.partition(": ")
            if field == "event":
                name = value
            elif field == "data":
                found.append((name, json.loads(value)))
    return found


def test_events_tell_how_far_a_render_is(server: Server) -> None:
    id = start(server, {**SMALL, "max_samples": 1 << 24, "time_limit": 1.0})
    told = events(server, id)
    assert [name for name, _ in told] == ["progress"] * (len(told) - 1) + ["done"]
    samples = [each["samples"] for _, each in told]
    assert len(told) >= 3 and samples == sorted(samples) and samples[-1] > samples[0]
    assert told[-1][1]["state"] == "done" and told[-1][1]["id"] == id
    assert [name for name, _ in events(server, id)] == ["done"]
    endless = start(server, ENDLESS)
    threading.Timer(0.5, lambda: server.http.delete(f"/v1/renders/{endless}")).start()
    assert events(server, endless)[-1][1]["state"] == "cancelled"


def test_the_head_of_events_has_an_end(server: Server) -> None:
    """Another request over the same connection is answered while the render goes on."""
    id = start(server, ENDLESS)
    with httpx.Client(base_url=server.url, limits=httpx.Limits(max_connections=1)) as one:
        for _ in range(2):
            head = one.head(f"/v1/renders/{id}/events")
            assert head.status_code == 200 and head.headers["content-type"].startswith("text/event-stream")
        assert one.get(f"/v1/renders/{id}").json()["state"] in ("queued", "running")
        assert one.delete(f"/v1/renders/{id}").status_code == 204


@pytest.mark.slow  # what fails where is tried in test_crash_safety.py
def test_a_full_disk_fails_no_server(tmp_path: Path) -> None:
    """The quota stands for the disk: there is room for the document, but not for the picture."""
    served = Server(tmp_path, SUNBOX_DATA_QUOTA=str(400_000))
    try:
        id = start(served, {**SMALL, "width": 256, "height": 256})
        told = status(served, id, PATIENCE_S)
        assert told["state"] == "done" and pixels(served, id)
        assert "could not store the picture" in served.log.read_text()
        lines = [line.split() for line in served.http.get("/metrics").text.splitlines()]
        counted = {line[0]: float(line[1]) for line in lines if line[0].startswith("sunbox_render_")}
        assert counted["sunbox_render_write_failures_total"] >= 1 and counted["sunbox_render_picture_bytes"] == 0
    finally:
        kill(served)
    again = Server(tmp_path)  # with room it is rendered again
    try:
        assert status(again, id, PATIENCE_S)["state"] == "done" and pixels(again, id)
    finally:
        assert again.stop() == 0
