"""Ways to learn how far renders are: waiting for one, following all, and what one caller may have of both."""

from __future__ import annotations

import json
import select
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest

from service.server.state import MOST_WAITS
from tests.calls import pixels, start
from tests.serving import ENDLESS, SCENE, SMALL, Server, wait_until


@pytest.fixture
def http(server: Server) -> httpx.Client:
    return server.http


@pytest.fixture
def endless(http: httpx.Client) -> Iterator[str]:
    id = start(http, ENDLESS)["id"]
    yield id
    http.delete(f"/v1/renders/{id}")


def asking(server: Server, path: str) -> socket.socket:
    """A connection that has asked for this, and whose answer nobody has read."""
    parts = urlsplit(server.url)
    assert parts.hostname and parts.port
    link = socket.create_connection((parts.hostname, parts.port), timeout=30)
    link.sendall(f"GET {path} HTTP/1.1\r\nhost: {parts.netloc}\r\n\r\n".encode())
    return link


def test_waiting_ends_with_the_connection_and_one_caller_waits_so_often(server: Server, endless: str) -> None:
    path = f"/v1/renders/{endless}"
    with ExitStack() as stack:
        links = [stack.enter_context(asking(server, f"{path}?wait=600")) for _ in range(MOST_WAITS + 1)]
        (refused,), _, _ = select.select(links, [], [], 30)
        assert refused.recv(32).startswith(b"HTTP/1.1 429 ")
        answer = server.http.get(f"{path}/events")
        assert answer.status_code == 429 and answer.json()["type"].endswith("too-many-requests")
        body = {"scene": SCENE, "settings": {**SMALL, "seed": 77}}
        assert server.http.post("/v1/renders", params={"wait": 1}, json=body).status_code == 429
        assert all(each["settings"]["seed"] != 77 for each in server.http.get("/v1/renders").json())
        assert server.http.get(path).status_code == 200
    wait_until(lambda: server.http.get(path, params={"wait": 0.01}).status_code == 200)


def test_the_end_of_a_render_answers_all_who_wait(server: Server) -> None:
    id = start(server.http, ENDLESS)["id"]
    with ExitStack() as stack:
        links = [stack.enter_context(asking(server, f"/v1/renders/{id}?wait=600")) for _ in range(MOST_WAITS)]
        time.sleep(0.5)  # most of them are waiting by then
        server.http.delete(f"/v1/renders/{id}")
        assert all(link.recv(15) == b"HTTP/1.1 200 OK" for link in links)


def test_a_render_is_started_and_awaited_at_once(http: httpx.Client) -> None:
    body = {"scene": SCENE, "settings": SMALL}
    ended = http.post("/v1/renders", params={"wait": 30}, json=body)
    assert ended.status_code == 200 and ended.json()["state"] == "done"
    assert ended.headers["location"] == f"renders/{ended.json()['id']}"
    begun = http.post("/v1/renders", params={"wait": 0.05}, json={**body, "settings": ENDLESS})
    assert begun.status_code == 202 and begun.json()["state"] in ("queued", "running")
    http.delete(f"/v1/renders/{begun.json()['id']}")
    assert http.post("/v1/renders", params={"wait": -1}, json=body).status_code == 422


def test_whoever_goes_away_leaves_the_render_that_was_started(server: Server) -> None:
    body = {"scene": SCENE, "settings": ENDLESS, "label": "left alone"}
    with pytest.raises(httpx.ReadTimeout):
        httpx.post(f"{server.url}/v1/renders", params={"wait": 60}, json=body, timeout=3)
    listed = server.http.get("/v1/renders", params={"label": "left alone"}).json()
    assert [each["state"] for each in listed if each["state"] in ("queued", "running")]
    for each in listed:
        server.http.delete(f"/v1/renders/{each['id']}")


class Followed:
    """The events of a stream, as they come."""

    def __init__(self, server: Server, **query: str) -> None:
        self.events: list[tuple[str, dict[str, Any]]] = []
        self.opened = threading.Event()
        self._client = httpx.Client(base_url=server.url, timeout=60)
        self._thread = threading.Thread(target=self._read, args=(query,), daemon=True)
        self._thread.start()
        assert self.opened.wait(30)

    def _read(self, query: dict[str, str]) -> None:
        name = ""
        try:
            with self._client.stream("GET", "/v1/renders/events", params=query) as answer:
                self.opened.set()
                for line in answer.iter_lines():
                    field, _, value = line.partition(": ")
                    if field == "event":
                        name = value
                    elif field == "data":
                        self.events.append((name, json.loads(value)))
        except (httpx.HTTPError, OSError, RuntimeError, ValueError):
            return  # closed by the test

    def of(self, id: str) -> list[tuple[str, dict[str, Any]]]:
        return [each for each in list(self.events) if each[1]["id"] == id]

    def close(self) -> None:
        self._client.close()


def test_one_stream_tells_of_all_renders(server: Server, endless: str) -> None:
    followed = Followed(server)
    try:
        wait_until(lambda: followed.of(endless))
        assert followed.of(endless)[0][0] == "progress", "it was under way before"
        ids = [start(server.http, {**SMALL, "seed": seed})["id"] for seed in range(3)]
        wait_until(lambda: all(followed.of(id) and followed.of(id)[-1][0] == "done" for id in ids))
        for id in ids:
            names = [name for name, _ in followed.of(id)]
            assert names.count("done") == 1 and followed.of(id)[-1][1]["state"] == "done"
        server.http.delete(f"/v1/renders/{endless}")
        wait_until(lambda: followed.of(endless)[-1][0] == "done")
        last = start(server.http, SMALL)["id"]
        wait_until(lambda: followed.of(last) and followed.of(last)[-1][0] == "done")  # and nothing came before that
        assert [name for name, _ in followed.of(endless)].count("done") == 1
        assert followed.of(endless)[-1][1]["state"] == "cancelled"
        assert "kernel" not in followed.of(endless)[-1][1]
    finally:
        followed.close()


def test_a_stream_of_one_label_tells_of_no_other(server: Server, endless: str) -> None:
    followed = Followed(server, label="mine")
    try:
        body = {"scene": SCENE, "settings": SMALL, "label": "mine"}
        id = server.http.post("/v1/renders", json=body).json()["id"]
        wait_until(lambda: followed.of(id) and followed.of(id)[-1][0] == "done")
        assert not followed.of(endless)
    finally:
        followed.close()


def test_a_render_gives_the_request_that_makes_it_again(http: httpx.Client) -> None:
    scene = {**SCENE, "materials": {**SCENE["materials"], "ünused": {"type": "diffuse", "albedo": 0.25}}}
    first = http.post(
        "/v1/renders", params={"wait": 30}, json={"scene": scene, "settings": {**SMALL, "quality": "draft"}}
    ).json()
    body = http.get(f"/v1/renders/{first['id']}/scene").json()
    assert body.keys() == {"scene", "settings"} and body["scene"] == scene
    again = http.post("/v1/renders", params={"wait": 30}, json=body).json()
    assert again["settings"] == first["settings"]
    assert (pixels(http, first["id"]) == pixels(http, again["id"])).all()
    assert http.get(f"/v1/renders/{'0' * 32}/scene").status_code == 404


def test_a_page_of_statuses_weighs_little(http: httpx.Client, endless: str) -> None:
    """One with the names of its kernel's flags has three times as many bytes."""
    assert len(http.get(f"/v1/renders/{endless}").content) < 1500
