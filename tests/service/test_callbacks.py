"""Callbacks: who is told of an end and how it is signed, what is tried again, and where none goes."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from standardwebhooks import Webhook

from service.cli import callback_secret
from service.config import Config
from service.problems import InvalidDocument, NotFound, TooManyRequests
from service.server.callbacks import posting
from service.server.callbacks.queue import AT_ONCE, EACH, OF_ONE_HOST, PAUSES, Callbacks
from service.server.storage.callback_rows import RETAINED, Callback, CallbackRows, insert
from service.server.storage.database import Database
from service.system.shares import CALLER
from sunbox import Client
from tests.calls import is_problem, metrics
from tests.service.receiving import Heard, Receiver
from tests.serving import CALLBACK_SECRETS, ENDLESS, SCENE, SMALL, Server, kill, wait_until

SECRET, OTHER = CALLBACK_SECRETS


@pytest.fixture
def calling(mortal: Server, listening: Receiver) -> Iterator[Server]:
    """A server that may call `listening`, and signs with two secrets."""
    yield mortal
    listening.answer = lambda heard: 204


def started(server: Server, url: str, kind: str = "renders", settings: Any = SMALL, **more: Any) -> str:
    body = {"scene": SCENE, "settings": settings, "callback": url, **more}
    return str(server.http.post(f"/v1/{kind}", json=body).raise_for_status().json()["id"])


def about(receiver: Receiver, id: str) -> list[Heard]:
    return [heard for heard in list(receiver.heard) if heard.event["data"]["id"] == id]


def listed(server: Server, id: str) -> Any:
    return next(each for each in server.http.get("/v1/callbacks").raise_for_status().json() if each["of"] == id)


def test_a_render_s_end_is_told_and_signed(calling: Server, listening: Receiver) -> None:
    id = started(calling, f"{listening.url}/ended?shop=7", label="poster")
    wait_until(lambda: listed(calling, id)["state"] == "delivered")
    (heard,) = about(listening, id)
    assert heard.path == "/ended?shop=7" and heard.headers["content-type"] == "application/json"
    assert heard.headers["host"] == f"127.0.0.1:{listening.port}"
    for secret in (SECRET, OTHER):
        assert Webhook(secret).verify(heard.body, heard.headers) == heard.event
    assert heard.event["type"] == "render.ended" and heard.event["timestamp"].endswith("Z")
    status = calling.http.get(f"/v1/renders/{id}").json()
    told = heard.event["data"]
    assert told == {name: status[name] for name in told} and (told["state"], told["label"]) == ("done", "poster")
    found = listed(calling, id)
    assert found["id"] == heard.headers["webhook-id"] and (found["attempts"], found["status"]) == (1, 204)
    assert found["kind"] == "render" and found["next"] is None and found["ended"]


def test_the_python_client_asks_for_callbacks(calling: Server, listening: Receiver) -> None:
    with Client(calling.url, calling.key) as client:
        id = client.submit(SCENE, "\N{TEAPOT}" * 200, callback=listening.url, **SMALL).id
        over = {"/materials/ball/roughness": [0.5]}
        batch = client.batch(SCENE, over, callback=listening.url, **SMALL).id
    wait_until(lambda: about(listening, id) and about(listening, batch))
    (heard,) = about(listening, id)
    assert heard.event["data"]["label"] == "\N{TEAPOT}" * 200 and len(heard.body) < 4096
    assert Webhook(SECRET).verify(heard.body, heard.headers)


def test_a_batch_has_one_callback(calling: Server, listening: Receiver) -> None:
    over = [{"path": "/materials/ball/roughness", "values": [0.1, 0.9]}]
    id = started(calling, listening.url, "batches", over=over)
    members = [each["id"] for each in calling.http.get(f"/v1/batches/{id}?wait=60").json()["renders"]]
    wait_until(lambda: about(listening, id))
    (heard,) = about(listening, id)
    assert heard.event["type"] == "batch.ended" and heard.event["data"]["counts"]["done"] == 2
    assert not any(about(listening, member) for member in members)


def test_what_is_cancelled_has_ended(calling: Server, listening: Receiver) -> None:
    id = started(calling, listening.url, settings=ENDLESS)
    assert listed(calling, id)["state"] == "waiting"
    calling.http.delete(f"/v1/renders/{id}").raise_for_status()
    wait_until(lambda: about(listening, id))
    assert about(listening, id)[0].event["data"]["state"] == "cancelled"


def test_what_fails_is_tried_again_and_redirects_are_not_followed(calling: Server, listening: Receiver) -> None:
    listening.answer = lambda heard: 204 if len(about(listening, heard.event["data"]["id"])) > 1 else 307
    id = started(calling, listening.url)
    wait_until(lambda: listed(calling, id)["attempts"] == 1)
    due = listed(calling, id)
    assert due["state"] == "due" and due["status"] == 307 and "redirects are not followed" in due["error"]
    wait_until(lambda: listed(calling, id)["state"] == "delivered")
    first, second = about(listening, id)
    assert (first.path, second.path) == ("/", "/") and first.body == second.body
    assert first.headers["webhook-id"] == second.headers["webhook-id"]
    assert first.headers["webhook-timestamp"] < second.headers["webhook-timestamp"]
    counted = metrics(calling)
    assert counted['sunbox_callback_attempts_total{outcome="retried"}'] == 1
    assert counted['sunbox_callback_attempts_total{outcome="delivered"}'] >= 1
    assert counted["sunbox_callbacks_pending"] == 0


def test_a_receiver_that_wants_no_more_is_left_alone(calling: Server, listening: Receiver) -> None:
    listening.answer = lambda heard: 410
    id = started(calling, listening.url)
    wait_until(lambda: listed(calling, id)["state"] != "waiting" and listed(calling, id)["attempts"])
    listening.answer = lambda heard: 204
    failed = calling.http.get("/v1/callbacks?state=failed").json()
    assert [each["of"] for each in failed] == [id] and failed[0]["error"] == "it answered 410"


def test_callbacks_come_in_pages(calling: Server) -> None:
    first = calling.http.get("/v1/callbacks?limit=1")
    assert len(first.json()) == 1 and 'rel="next"' in first.headers["link"]
    then = calling.http.get("/v1/" + first.headers["link"].split("<")[1].split(">")[0]).json()
    assert then and then[0]["id"] != first.json()[0]["id"]
    assert is_problem(calling.http.get("/v1/callbacks?state=odd"), 422, "/state")


@pytest.mark.parametrize("kind", ["renders", "batches"])
@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("https://evil.example/", "SUNBOX_CALLBACK_HOSTS"),
        ("https://127.0.0.1:{port}/", "SUNBOX_CALLBACK_HOSTS"),  # named is http
        ("http://127.0.0.1:{port}@evil.example/", "user name"),
        ("http://127.0.0.1:{port}\\@evil.example/", "https URL"),
        ("file:///etc/passwd", "https URL"),
        ("http://127.0.0.1:{port}/\r\nx: y", "https URL"),
        (7, "text"),
    ],
)
def test_other_urls_are_refused(calling: Server, listening: Receiver, kind: str, url: Any, says: str) -> None:
    given = url.format(port=listening.port) if isinstance(url, str) else url
    over = {"over": [{"path": "/materials/ball/roughness", "values": [0.1]}]} if kind == "batches" else {}
    answer = calling.http.post(f"/v1/{kind}", json={"scene": SCENE, "callback": given, **over})
    assert is_problem(answer, 422, "/callback") and says in answer.json()["errors"][0]["detail"]


def test_without_hosts_no_callback_is_taken(server: Server) -> None:
    answer = server.http.post("/v1/renders", json={"scene": SCENE, "callback": "https://hooks.example.org/"})
    assert is_problem(answer, 422, "/callback") and "SUNBOX_CALLBACK_HOSTS" in answer.json()["detail"]
    assert server.http.get("/v1/callbacks").json() == []


def test_callbacks_outlive_the_server(calling: Server, listening: Receiver) -> None:
    """One is due again when the server is killed, and the render of another one goes on."""
    listening.answer = lambda heard: 503
    due, waiting = started(calling, listening.url), started(calling, listening.url, settings=ENDLESS)
    wait_until(lambda: listed(calling, due)["attempts"])
    kill(calling)
    listening.answer = lambda heard: 204
    calling.start()
    wait_until(lambda: listed(calling, due)["state"] == "delivered")
    calling.http.delete(f"/v1/renders/{waiting}").raise_for_status()
    wait_until(lambda: listed(calling, waiting)["state"] == "delivered")
    assert {heard.headers["webhook-id"] for heard in about(listening, due)} == {listed(calling, due)["id"]}
    for heard in (*about(listening, due), *about(listening, waiting)):
        assert Webhook(SECRET).verify(heard.body, heard.headers)


def filled(folder: Path, subjects: dict[str, str], owner: str = "") -> CallbackRows:
    """Callbacks that are due, by subject to these URLs."""
    with Database(folder).open() as database, database:
        for subject, url in subjects.items():
            insert(database, "render", subject, owner, url, 1.0)
    rows = CallbackRows(Database(folder))
    for subject in subjects:
        rows.make_due("render", subject, "{}", time.time())
    return rows


def missing(kind: str, id: str, owner: str) -> Any:
    raise NotFound("There is no render of this id.")


def test_a_host_that_does_not_answer_leaves_room_for_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = filled(
        tmp_path, {f"{i:02}": "https://silent.example/" for i in range(20)} | {"last": "https://quick.example/"}
    )
    silent, delivered = list[str](), asyncio.Event()

    async def fake(url: str, *arguments: Any) -> int:
        if "silent" in url:
            silent.append(url)
            await asyncio.sleep(1e9)
        delivered.set()
        return 200

    monkeypatch.setattr(posting, "post", fake)

    async def run() -> None:
        config = Config(data_dir=tmp_path, callback_hosts=["silent.example", "quick.example"])
        callbacks = Callbacks(config, missing)
        await callbacks.start()
        await asyncio.wait_for(delivered.wait(), 60)
        while not rows.listed("", "delivered", 10, None):
            await asyncio.sleep(0.01)
        await callbacks.close()

    asyncio.run(run())
    assert len(silent) == OF_ONE_HOST < AT_ONCE
    assert [each.subject for each in rows.listed("", "delivered", 10, None)] == ["last"]


def test_a_host_is_the_same_however_it_is_written(tmp_path: Path) -> None:
    urls = (
        "http://h.example:8328/",
        "http://H.example:08328/a",
        "http://h.example.:8328",
        "http://h.example:008328/?b",
    )
    rows = filled(tmp_path, {str(i): url for i, url in enumerate(urls)})
    assert {each.host for each in rows.listed("", None, 10, None)} == {"h.example:8328"}


def test_turns_go_round_owners(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever has thousands that are due, to whichever hosts, delays itself: also where none of these answers."""
    hosts = [f"silent{i}.example" for i in range(AT_ONCE)]
    anna = {f"{i:03}": f"https://{hosts[i % AT_ONCE]}/" for i in range(100)}
    filled(tmp_path, anna, "anna")
    rows = filled(tmp_path, {"first": f"https://{hosts[0]}/bert", "second": f"https://{hosts[1]}/bert"}, "bert")
    attempts, delivered = list[str](), list[str]()

    async def fake(url: str, *arguments: Any) -> int:
        attempts.append(CALLER.get())
        if not url.endswith("bert"):
            await asyncio.sleep(1e9)
        delivered.append(url)
        return 200

    monkeypatch.setattr(posting, "post", fake)

    async def run() -> None:
        callbacks = Callbacks(Config(data_dir=tmp_path, callback_hosts=hosts), missing)
        await callbacks.start()
        while len(rows.listed("bert", "delivered", 10, None)) < 2 or attempts.count("anna") < AT_ONCE // 2:
            await asyncio.sleep(0.01)
        await callbacks.close()

    asyncio.run(asyncio.wait_for(run(), 60))
    assert attempts.count("anna") == AT_ONCE // 2 and attempts.index("bert") <= 1


def test_a_host_that_is_silent_has_one_attempt_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = filled(tmp_path, {f"{i}": "https://silent.example/" for i in range(9)})
    under_way, most, silent = 0, list[int](), True

    async def fake(url: str, *arguments: Any) -> int:
        nonlocal under_way
        under_way += 1
        most.append(under_way)
        await asyncio.sleep(0.01)
        under_way -= 1
        if silent:
            raise posting.NotSent("no answer within 15 s")
        return 200

    monkeypatch.setattr(posting, "post", fake)

    async def run() -> None:
        nonlocal silent
        callbacks = Callbacks(Config(data_dir=tmp_path, callback_hosts=["silent.example"]), missing)
        await callbacks.start()
        while callbacks.outcomes["retried"] < 9:
            await asyncio.sleep(0.01)
        silent = False
        assert callbacks._most_of("silent.example") == 1
        filled(tmp_path, {"late": "https://silent.example/"})
        callbacks._woken.set()
        while not rows.listed("", "delivered", 10, None):
            await asyncio.sleep(0.01)
        assert callbacks._most_of("silent.example") == OF_ONE_HOST
        await callbacks.close()

    asyncio.run(asyncio.wait_for(run(), 60))
    assert max(most[:3]) == OF_ONE_HOST and set(most[5:]) == {1}


def test_eight_attempts_are_made(tmp_path: Path) -> None:
    rows = filled(tmp_path, {"a": "https://hooks.example.org/"})
    callbacks = Callbacks(Config(data_dir=tmp_path, callback_hosts=["hooks.example.org"]), missing)
    callback: Callback | None = rows.next([""], [], [], time.time())
    assert callback is not None
    for pause in PAUSES:
        now = time.time()
        callback = callbacks._after(callback, None, "no answer")
        assert callback.state == "due" and callback.next_at is not None
        assert 0.89 * pause < callback.next_at - now < 1.11 * pause + 60
    callback = callbacks._after(callback, 500, "it answered 500")
    assert (callback.state, callback.attempts) == ("failed", 8) and callbacks.outcomes["failed"] == 1


def test_what_is_kept_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.server.storage.callback_rows.RETAINED", 2)
    assert RETAINED == 1000
    rows = filled(tmp_path, {str(i): "https://hooks.example.org/" for i in range(5)})
    callbacks = Callbacks(Config(data_dir=tmp_path, callback_hosts=["hooks.example.org"]), missing)
    for answer in (410, 200, 200, 200, 200):
        found = rows.next([""], [], [], time.time())
        assert found is not None
        rows.attempted(callbacks._after(found, answer, None if answer == 200 else "it answered 410"))
    assert [each.subject for each in rows.listed("", None, 10, None)] == ["4", "3", "0"]
    assert rows.listed("anna", None, 10, None) == []


def test_an_owner_has_so_many_callbacks(tmp_path: Path) -> None:
    callbacks = Callbacks(Config(data_dir=tmp_path, callback_hosts=["hooks.example.org"]), missing)
    callbacks._pending["anna"] = EACH
    with pytest.raises(TooManyRequests):
        callbacks.check("https://hooks.example.org/", "anna", True)
    callbacks.check("https://hooks.example.org/", "bert", True)
    with pytest.raises(InvalidDocument, match="data folder"):
        callbacks.check("https://hooks.example.org/", "bert", False)


def test_a_callback_whose_render_is_gone_has_failed(tmp_path: Path) -> None:
    with Database(tmp_path).open() as database, database:
        insert(database, "render", "gone", "", "https://hooks.example.org/", 1.0)

    async def run() -> None:
        callbacks = Callbacks(Config(data_dir=tmp_path, callback_hosts=["hooks.example.org"]), missing)
        await callbacks.start()
        while not callbacks.listed("", "failed", 10, None):
            await asyncio.sleep(0.01)
        await callbacks.close()

    asyncio.run(run())


def test_the_secret_is_made_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    for _ in range(2):
        assert callback_secret.run(None) == 0  # type: ignore[arg-type]
    first, second = capsys.readouterr().out.split()
    assert first == second and first.startswith("whsec_")
    kept = tmp_path / "data" / "callback.secret"
    assert kept.stat().st_mode & 0o777 == 0o600 and [path.name for path in kept.parent.iterdir()] == [kept.name]
    monkeypatch.setenv("SUNBOX_CALLBACK_SECRET", f"{SECRET},{OTHER}")
    assert callback_secret.run(None) == 0  # type: ignore[arg-type]
    assert capsys.readouterr().out.split() == [SECRET, OTHER]
