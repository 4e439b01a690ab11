"""How many requests of a caller are open at a time, and who the caller is behind a proxy."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest

from service.config import Config, ConfigError, load_config
from service.server.app import create_app, server_settings
from service.server.http.guard import OPEN_OF_A_KEY, Guard
from service.server.routes.errors import respond
from tests.calls import is_problem
from tests.serving import Server


class Waiting:
    """An application behind a guard, whose requests are open until `end`."""

    def __init__(self, **settings: Any) -> None:
        self._guard = Guard(self._app, config=Config(**settings), refuse=respond)
        self._ended = asyncio.Event()
        self._open: list[asyncio.Task[int]] = []

    async def _app(self, scope: Any, receive: Any, send: Any) -> None:
        if scope["path"] != "/healthz":
            await self._ended.wait()
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body"})

    async def ask(self, key: str, path: str = "/v1/renders", client: str = "10.0.0.1", kind: str = "http") -> int:
        """The status, or the close code; 0 where the request stays open."""
        heard: list[int] = []

        async def receive() -> Any:
            return {"type": f"{kind}.disconnect"}

        async def send(message: Any) -> None:
            heard.extend(message[name] for name in ("status", "code") if name in message)

        headers = [(b"host", b"x"), (b"authorization", f"Bearer {key}".encode())]
        scope: Any = {"type": kind, "method": "GET", "path": path, "headers": headers, "client": (client, 1)}
        task = asyncio.ensure_future(self._guard({**scope, "server": ("10.0.0.9", 80)}, receive, send))
        self._open.append(task)  # type: ignore[arg-type]
        await asyncio.sleep(0)
        if not task.done() and heard:
            await task
        return heard[0] if heard else 0

    async def end(self) -> None:
        self._ended.set()
        await asyncio.gather(*self._open)
        self._ended.clear()


def test_a_key_has_so_many_open_requests() -> None:
    async def test() -> None:
        there = Waiting(api_key=["a", "b"])
        assert {await there.ask("a") for _ in range(OPEN_OF_A_KEY)} == {0}
        assert await there.ask("a") == 429
        assert await there.ask("a", "/v1/stream", kind="websocket") == 4429
        assert await there.ask("b") == 0
        assert await there.ask("", "/") == 0, "the editor's files need no key"
        await there.end()
        assert await there.ask("a") == 0
        await there.end()

    asyncio.run(test())


def test_an_address_leaves_room_for_others() -> None:
    async def test() -> None:
        there = Waiting(max_connections=8)
        addresses = ["10.0.0.1"] * 5 + ["2001:db8::1"] * 2 + ["2001:db8::2", "10.0.0.2", "10.0.0.4", "10.0.0.3"]
        assert [await there.ask("", client=each) for each in addresses] == [0, 0, 0, 0, 429, 0, 0, 429, 0, 0, 503]
        assert await there.ask("", "/healthz", "10.0.0.3") == 200, "the health check is always answered"
        assert await there.ask("", "/healthz", "10.0.0.1") == 200
        await there.end()

    asyncio.run(test())


@pytest.fixture(scope="module")
def proxied(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server to which this test is a trusted proxy."""
    limits = {"SUNBOX_TRUSTED_PROXIES": "127.0.0.0/8", "SUNBOX_MAX_CONNECTIONS": "16"}
    served = Server(tmp_path_factory.mktemp("proxied"), **limits)
    yield served
    assert served.stop() == 0


def half_sent(server: Server, forwarded: str) -> socket.socket:
    """An upload that has begun."""
    address = urlsplit(server.url)
    connection = socket.create_connection((address.hostname, address.port), 60)
    head = f"POST /v1/assets HTTP/1.1\r\nHost: {address.netloc}\r\nX-Forwarded-For: {forwarded}\r\n"
    connection.sendall(f"{head}Content-Length: 100\r\nExpect: 100-continue\r\n\r\n".encode())
    return connection


def test_behind_a_proxy_addresses_are_told_apart(proxied: Server) -> None:
    """By the last one that no trusted proxy has: what a client writes before it changes nothing."""
    with ExitStack() as stack:
        for i in range(9):
            connection = stack.enter_context(half_sent(proxied, f"10.1.1.{i}, 192.0.2.1, 127.0.0.7"))
            assert (b" 100 " if i < 8 else b" 429 ") in connection.recv(1000)
        for forwarded, status in (("198.51.100.1", 200), ("10.1.1.99, 192.0.2.1", 429)):
            answer = httpx.get(f"{proxied.url}/v1/presets/scenes", headers={"x-forwarded-for": forwarded})
            assert answer.status_code == status
        assert is_problem(httpx.get(f"{proxied.url}/docs", headers={"x-forwarded-for": "192.0.2.1"}), 429)
        health = httpx.get(f"{proxied.url}/healthz", headers={"x-forwarded-for": "192.0.2.1"})
        assert health.status_code == 200


def test_without_trusted_proxies_nobody_can_say_who_calls(tmp_path: Path) -> None:
    for proxies in ([], ["10.0.0.1"]):
        config = Config(data_dir=tmp_path, trusted_proxies=proxies)
        app = create_app(config)
        app.state.sunbox.storage.assets.close()
        settings = server_settings(app, config, 10)
        assert settings.proxy_headers is bool(proxies) and "127.0.0.1" not in settings.forwarded_allow_ips


def test_proxies_are_addresses_or_networks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_TRUSTED_PROXIES", "10.0.0.1, 172.16.3.4/12,2001:db8::1/64")
    assert load_config().trusted_proxies == ["10.0.0.1/32", "172.16.0.0/12", "2001:db8::/64"]
    for wrong in ("caddy", "10.0.0.0/99", "*"):
        monkeypatch.setenv("SUNBOX_TRUSTED_PROXIES", wrong)
        with pytest.raises(ConfigError, match=r"SUNBOX_TRUSTED_PROXIES.*10\.0\.0\.0/8"):
            load_config()
