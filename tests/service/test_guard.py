"""Keys, and limits that a real server keeps."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from starlette.responses import PlainTextResponse
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from service.config import Config, ConfigError, load_config
from service.problems import TooLarge, Unauthorized
from service.server.http.downloads import disconnected
from service.server.http.guard import Guard, Keys, _Body
from service.server.routes.errors import respond
from tests.asset_files import OBJ
from tests.calls import is_problem
from tests.serving import ENDLESS, PATIENCE_S, SCENE, SMALL, SPARE_KEY, Client, Server

ANNA, BERT = {"authorization": "Bearer anna-key"}, {"authorization": "bearer  bert-key"}
CARA = {"authorization": f"Bearer {SPARE_KEY}"}
BODY = {"scene": SCENE, "settings": SMALL}


@pytest.fixture
def http(strict: Server) -> httpx.Client:
    return strict.http


@pytest.mark.parametrize("shown", [{}, {"authorization": "Bearer wrong"}, {"authorization": "Basic anna-key"}])
def test_a_key_is_asked_for(http: httpx.Client, shown: dict[str, str]) -> None:
    for method, address in (("GET", "/v1/info"), ("POST", "/v1/renders"), ("GET", "/v1/renders/x"), ("GET", "/v1")):
        answer = http.request(method, address, headers=shown)
        assert is_problem(answer, 401) and answer.headers["www-authenticate"] == "Bearer"
        assert "anna" not in answer.text
    for address in ("/", "/healthz", "/readyz", "/metrics", "/docs", "/openapi.json"):
        assert http.get(address, headers=shown).status_code == 200, address
    assert http.get("/v1/info", headers=ANNA).status_code == http.get("/v1/info", headers=BERT).status_code == 200


def test_renders_belong_to_their_key(http: httpx.Client) -> None:
    def ended() -> str:
        answer = http.post("/v1/renders", json={**BODY, "label": "annas"}, headers=ANNA, params={"wait": PATIENCE_S})
        assert answer.json()["state"] == "done"
        return f"/v1/{answer.headers['location']}"

    address = ended()
    for method, under in (("GET", ""), ("DELETE", ""), ("GET", "/image")):
        assert is_problem(http.request(method, address + under, headers=BERT), 404)
    assert http.get(address + "/image", headers=ANNA).status_code == 200
    listed = {"label": "annas"}
    assert http.get("/v1/renders", headers=BERT, params=listed).json() == []
    found = http.get("/v1/renders", headers=ANNA, params=listed).json()
    assert [f"/v1/renders/{render['id']}" for render in found] == [address]
    for _ in range(2):
        http.post("/v1/render", json=BODY, headers=ANNA)  # not kept, and makes nobody go
    assert http.get(address, headers=ANNA).status_code == 200
    for _ in range(int(http.get("/v1/info", headers=ANNA).json()["limits"]["keep_renders"])):
        ended()
    assert is_problem(http.get(address, headers=ANNA), 410)
    assert is_problem(http.get(address, headers=BERT), 404)


def test_there_is_an_end_to_what_one_may_ask_for(http: httpx.Client) -> None:
    endless = {"scene": SCENE, "settings": ENDLESS}
    started = []
    try:
        for key in (ANNA, ANNA, BERT):
            answer = http.post("/v1/renders", json=endless, headers=key)
            assert answer.status_code == 202
            started.append((f"/v1/{answer.headers['location']}", key))
        too_many = http.post("/v1/renders", json=endless, headers=ANNA)
        assert is_problem(too_many, 429) and int(too_many.headers["retry-after"]) > 0
        full = http.post("/v1/render", json=endless, headers=BERT)
        assert is_problem(full, 503) and int(full.headers["retry-after"]) > 0
    finally:
        for address, key in started:
            http.delete(address, headers=key)


def test_time_has_its_limit(http: httpx.Client) -> None:
    long = {"scene": SCENE, "settings": {**SMALL, "time_limit": 6}}
    assert is_problem(http.post("/v1/renders", json=long, headers=ANNA), 422, "/settings/time_limit")
    answer = http.post("/v1/renders", json=BODY, headers=BERT)
    assert answer.json()["settings"]["time_limit"] == 5


@pytest.mark.parametrize(
    ("protocols", "headers", "welcome"),
    [
        (["sunbox.v1", "sunbox.key.anna-key"], {}, True),
        (["sunbox.v1"], BERT, True),
        (["sunbox.key.wrong", "sunbox.v1"], {}, False),
        (["sunbox.v1"], {}, False),
    ],
)
def test_a_stream_shows_its_key(strict: Server, protocols: list[str], headers: Any, welcome: bool) -> None:
    address = strict.url.replace("http", "ws") + "/v1/stream"
    offered = [Subprotocol(protocol) for protocol in protocols]
    with connect(address, subprotocols=offered, additional_headers=headers) as stream:
        assert stream.subprotocol == "sunbox.v1"
        if welcome:
            assert json.loads(stream.recv(20))["type"] == "hello"
            return
        with pytest.raises(ConnectionClosed) as closed:
            stream.recv(20)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 4401


@pytest.mark.parametrize("origin", ["http://example.com", "null", "http://127.0.0.1:1"])
def test_a_stream_from_a_foreign_page_is_closed(server: Server, origin: str) -> None:
    stream = Client(server.url, origin=origin)
    with stream, pytest.raises(ConnectionClosed) as closed:
        stream.until("hello")
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 4403


def test_a_stream_from_the_servers_own_page_is_welcome(server: Server) -> None:
    stream = Client(server.url, origin=server.url)
    with stream:
        assert stream.until("hello")


def test_a_page_of_a_friend_reads_answers(http: httpx.Client) -> None:
    origin = {"origin": "https://friend.example"}
    asking = {**origin, "access-control-request-method": "PUT", "access-control-request-headers": "authorization"}
    preflight = http.options("/v1/documents/scenes/x", headers=asking)
    assert preflight.status_code == 204 and preflight.headers["access-control-allow-origin"] == origin["origin"]
    assert "PUT" in preflight.headers["access-control-allow-methods"]
    refused = http.get("/v1/info", headers=origin)
    assert is_problem(refused, 401) and refused.headers["access-control-allow-origin"] == origin["origin"]
    stranger = http.options("/v1/info", headers={**asking, "origin": "https://evil.example"})
    assert "access-control-allow-origin" not in stranger.headers and stranger.status_code >= 400


def test_a_body_that_stops_is_ended(strict: Server) -> None:
    address = urlsplit(strict.url)
    with socket.create_connection((address.hostname, address.port), 60) as connection:
        head = f"POST /v1/assets HTTP/1.1\r\nHost: {address.netloc}\r\nAuthorization: Bearer anna-key\r\n"
        connection.sendall(f"{head}Content-Length: 100\r\n\r\nonly this".encode())
        assert b" 408 " in connection.recv(1000)


def test_announced_bodies_are_refused_unread(strict: Server) -> None:
    address = urlsplit(strict.url)
    with socket.create_connection((address.hostname, address.port), 5) as connection:
        head = f"POST /v1/assets HTTP/1.1\r\nHost: {address.netloc}\r\nAuthorization: Bearer anna-key\r\n"
        connection.sendall(f"{head}Content-Length: 64001\r\n\r\n".encode())
        assert b" 413 " in connection.recv(100)


def test_unannounced_bodies_are_counted(http: httpx.Client) -> None:
    answer = http.post("/v1/assets", content=iter([b"x" * 1000] * 65), headers=ANNA)
    assert is_problem(answer, 413)
    assert http.post("/v1/assets", content=iter([OBJ]), headers=ANNA).status_code == 201


def test_compressed_bodies_are_not_taken(http: httpx.Client) -> None:
    assert is_problem(http.post("/v1/assets", content=OBJ, headers={**ANNA, "content-encoding": "gzip"}), 415)


def test_pixels(http: httpx.Client) -> None:
    large = {"scene": SCENE, "settings": {"width": 40, "height": 26}}
    answer = http.post("/v1/renders", json=large, headers=ANNA)
    assert is_problem(answer, 422, "/settings/width")
    assert http.get("/v1/info", headers=ANNA).json()["limits"]["max_pixels"] == 1000


def test_allowed_origins(http: httpx.Client) -> None:
    for origin in ("https://friend.example", "http://other.example:81"):
        answer = http.post("/v1/assets", content=OBJ, headers={**ANNA, "origin": origin})
        assert answer.status_code == 201 and answer.headers["access-control-allow-origin"] == origin
    assert http.get("/v1/info", headers={**ANNA, "host": "friend.example"}).status_code == 200
    stranger = {**ANNA, "origin": "http://friend.example"}
    assert is_problem(http.post("/v1/assets", content=OBJ, headers=stranger), 403)


def test_no_address_in_a_document_is_asked(strict: Server) -> None:
    with socket.create_server(("127.0.0.1", 0)) as trap:
        trap.settimeout(0.3)
        url = f"http://127.0.0.1:{trap.getsockname()[1]}/secret.exr"
        gltf = json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": url, "byteLength": 4}]})
        places = {
            "/scene/environment/asset": {"environment": {"type": "image", "asset": url}},
            "/scene/shapes/0/asset": {"shapes": [{"type": "mesh", "asset": url, "material": "ball"}]},
            "/scene/textures/t/asset": {"textures": {"t": {"asset": url}}},
        }
        for pointer, change in places.items():
            answer = strict.http.post("/v1/renders", json={**BODY, "scene": {**SCENE, **change}}, headers=ANNA)
            errors = [error["pointer"] for error in answer.json().get("errors", [])]
            assert (answer.status_code == 422 and errors == [pointer]) or "textures" in pointer
        strict.http.post("/v1/assets", content=gltf, headers=ANNA)
        with pytest.raises(TimeoutError):
            trap.accept()


def test_head_is_get_without_the_body(http: httpx.Client) -> None:
    got, head = (http.request(method, "/v1/schema", headers=ANNA) for method in ("GET", "HEAD"))
    assert head.status_code == 200 and head.content == b""
    assert head.headers["content-length"] == got.headers["content-length"]
    assert http.head("/v1/nothing", headers=ANNA).status_code == 404


def test_every_answer_is_guarded(http: httpx.Client) -> None:
    for address in ("/", "/docs", "/v1/info", "/nothing"):
        headers = http.get(address).headers
        assert headers["x-content-type-options"] == "nosniff" and headers["referrer-policy"] == "no-referrer"
        assert "unsafe-inline" not in headers["content-security-policy"]
        assert "server" not in headers


def test_keys_are_told_apart() -> None:
    keys = Keys(["one", "two"])
    assert keys.owner("Bearer one") != keys.owner(None, ["sunbox.v1", "sunbox.key.two"])
    assert keys.owner("Bearer two") == keys.owner(None, ["sunbox.key.two"]) and "two" not in keys.owner("Bearer two")
    for authorization in ("Bearer", "Bearer onetwo", "Bearer ", "one", None, "Bearer ön"):
        with pytest.raises(Unauthorized):
            keys.owner(authorization)


@pytest.mark.parametrize("value", [",", "a,,b", "a b", "schlüssel"])
def test_useless_keys_are_refused(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_API_KEY", value)
    with pytest.raises(ConfigError, match="SUNBOX_API_KEY"):
        load_config()


def test_no_key_is_in_the_configurations_text() -> None:
    assert "secret" not in repr(Config(api_key=["secret"]))


@pytest.mark.parametrize(
    ("server", "hosts", "host", "status"),
    [
        ("127.0.0.1", [], "evil.example", 403),
        ("127.0.0.1", ["render.example"], "render.example:8000", 200),
        ("127.0.0.1", ["render.example"], "evil.example", 403),
        ("127.0.0.1", ["render.example"], "127.0.0.1:8000", 200),  # the container's own HEALTHCHECK
        ("172.17.0.2", [], "evil.example", 200),  # which names lead here is not known
        ("172.17.0.2", ["render.example"], "RENDER.example", 200),
        ("172.17.0.2", ["render.example"], "localhost:8000", 200),  # published on the host's loopback
        ("172.17.0.2", ["render.example"], "evil.example", 403),
        ("172.17.0.2", ["render.example"], "172.17.0.2", 403),
    ],
)
def test_hosts_that_may_be_asked(server: str, hosts: list[str], host: str, status: int) -> None:
    """DNS rebinding leads a browser that knows a foreign name to this server; in a container its address is no
    loopback one, so the operator says which names are its own."""
    statuses: list[int] = []

    async def send(message: Any) -> None:
        if message["type"] == "http.response.start":
            statuses.append(message["status"])

    async def receive() -> Any:
        return {"type": "http.request", "body": b"", "more_body": False}

    guard = Guard(PlainTextResponse("here"), config=Config(allowed_hosts=hosts), refuse=respond)
    scope: Any = {"type": "http", "method": "GET", "path": "/", "headers": [(b"host", host.encode())]}
    asyncio.run(guard({**scope, "server": (server, 8000)}, receive, send))
    assert statuses == [status]


@pytest.mark.parametrize("path", ["/healthz", "/readyz", "/v1/info", "/"])
@pytest.mark.parametrize("version", ["1.0", "1.1"])
def test_a_balancer_may_ask_without_a_host(path: str, version: str) -> None:
    """HAProxy's check is HTTP/1.0 and names none. Browsers always do, so this is no way to rebind a name."""
    statuses: list[int] = []

    async def send(message: Any) -> None:
        if message["type"] == "http.response.start":
            statuses.append(message["status"])

    async def receive() -> Any:
        return {"type": "http.request", "body": b"", "more_body": False}

    guard = Guard(PlainTextResponse("here"), config=Config(), refuse=respond)
    scope: Any = {"type": "http", "method": "GET", "path": path, "headers": [], "http_version": version}
    asyncio.run(guard({**scope, "server": ("127.0.0.1", 8000)}, receive, send))
    assert statuses == [200 if version == "1.0" and path in ("/healthz", "/readyz") else 403]


def test_who_sends_a_refused_body_hears_why() -> None:
    """Answered at once; what still comes is taken before the connection is closed, which would lose the answer."""
    body: list[Any] = [{"type": "http.request", "body": b"x" * 9, "more_body": True}] * 3
    coming = [*body, {"type": "http.request", "body": b"", "more_body": False}]
    happened: list[str] = []

    async def receive() -> Any:
        happened.append("read")
        return coming.pop(0)

    async def send(message: Any) -> None:
        if message["type"] == "http.response.body":
            happened.append("answered" if message.get("body") else "ended")
            assert message.get("more_body", False) is bool(message.get("body"))

    headers = [(b"host", b"127.0.0.1"), (b"content-length", b"99")]
    scope: Any = {
        "type": "http",
        "method": "POST",
        "path": "/v1/assets",
        "headers": headers,
        "server": ("127.0.0.1", 80),
    }
    taken, config = PlainTextResponse("taken"), Config(max_body=10)
    guard = Guard(taken, config=config, refuse=lambda error: PlainTextResponse(str(error), 413))
    asyncio.run(guard(scope, receive, send))
    assert happened == ["answered", "read", "read", "read", "read", "ended"]


def test_the_pieces_of_a_body_are_added_up() -> None:
    """As they come one by one; a server on the same machine often takes several at once."""
    coming = [{"type": "http.request", "body": b"x" * 4, "more_body": True}] * 3
    sizes = []

    async def receive() -> Any:
        return coming.pop()

    async def send(message: Any) -> None: ...

    async def reading(scope: Any, receive: Any, send: Any) -> None:
        while True:
            sizes.append(len((await receive())["body"]))

    scope = {"type": "http", "method": "POST", "path": "/v1/assets", "headers": [(b"host", b"127.0.0.1")]}
    with pytest.raises(TooLarge, match="larger than 10 bytes"):
        asyncio.run(Guard(reading, config=Config(max_body=10), refuse=respond)(scope, receive, send))
    assert sizes == [4, 4]


def test_saved_documents_are_their_key_s(http: httpx.Client) -> None:
    address, grey = "/v1/documents/materials/grey", {"type": "diffuse", "albedo": 0.5}
    assert http.put(address, json=grey, headers=ANNA).status_code == 201
    assert is_problem(http.get(address, headers=BERT), 404)
    assert http.get("/v1/documents/materials", headers=BERT).json() == []
    assert http.put(address, json=grey, headers=ANNA, params={"shared": "true"}).status_code == 200
    assert http.get(address, headers=BERT).json() == grey
    assert is_problem(http.delete(address, headers=BERT), 403)
    assert http.delete(address, headers=ANNA).status_code == 204


def test_a_key_s_assets_have_a_bound(http: httpx.Client) -> None:
    """Two of 24 KiB: the one that was used longest ago makes room for the third, and the other key's stays."""

    def uploaded(mark: bytes, key: dict[str, str]) -> str:
        answer = http.post("/v1/assets", content=OBJ + mark * 20_000, headers=key).raise_for_status()
        return str(answer.json()["id"])

    ids, other = [uploaded(mark, CARA) for mark in (b"#", b" ")], uploaded(b"\n", BERT)
    time.sleep(0.02)  # file systems write times in steps
    assert http.get(f"/v1/assets/{ids[1]}", headers=CARA).status_code == 200  # used last
    ids.append(uploaded(b"\t", CARA))
    assert [http.get(f"/v1/assets/{id}", headers=CARA).status_code for id in ids] == [404, 200, 200]
    assert http.get(f"/v1/assets/{other}", headers=BERT).status_code == 200


@pytest.mark.parametrize("steps", range(6))
def test_who_stops_listening_is_let_go_at_any_moment(steps: int) -> None:
    """An answer that is ready at once ends the watch on its client just as the body's last message arrives."""

    async def run() -> None:
        messages = [{"type": "http.request", "body": b"", "more_body": False}]

        async def receive() -> Any:
            return messages.pop() if messages else await asyncio.sleep(3600)

        body = _Body(Config(), receive)
        listening = asyncio.create_task(disconnected(body.receive))
        for _ in range(steps):
            await asyncio.sleep(0)
        listening.cancel()
        done, _ = await asyncio.wait({listening}, timeout=1)
        assert done

    asyncio.run(run())
