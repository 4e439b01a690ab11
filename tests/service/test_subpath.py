"""Behind a proxy that serves it under a path of its own: the editor, the API and the stream."""

from __future__ import annotations

import re
import socket
import socketserver
import threading
from collections.abc import Iterator
from typing import Any
from urllib.parse import urljoin, urlsplit

import httpx
import pytest

from tests.serving import PATIENCE_S, SCENE, SMALL, Client, Server

PREFIX = "/deep/sunbox"


class Proxy(socketserver.ThreadingTCPServer):
    """As much of a reverse proxy as it takes: one request each connection, the prefix stripped, upgrades passed."""

    allow_reuse_address = daemon_threads = True

    def __init__(self, upstream: str) -> None:
        super().__init__(("127.0.0.1", 0), Passing)
        parts = urlsplit(upstream)
        self.upstream = (parts.hostname, parts.port)
        self.url = f"http://127.0.0.1:{self.server_address[1]}{PREFIX}"


class Passing(socketserver.BaseRequestHandler):
    server: Any

    def handle(self) -> None:
        head = b""
        while b"\r\n\r\n" not in head:
            more = self.request.recv(65536)
            if not more:
                return
            head += more
        first, _, rest = head.partition(b"\r\n")
        if f" {PREFIX}/".encode() not in first:
            self.request.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
            return
        first = first.replace(f" {PREFIX}/".encode(), b" /", 1)
        if b"upgrade: websocket" not in rest.lower():
            rest = b"Connection: close\r\n" + re.sub(rb"(?im)^connection:[^\n]*\n", b"", rest)
        with socket.create_connection(self.server.upstream) as upstream:
            upstream.sendall(first + b"\r\n" + rest)
            back = threading.Thread(target=pump, args=(upstream, self.request), daemon=True)
            back.start()
            pump(self.request, upstream)
            back.join()


def pump(source: socket.socket, sink: socket.socket) -> None:
    try:
        while data := source.recv(65536):
            sink.sendall(data)
        sink.shutdown(socket.SHUT_WR)
    except OSError:
        pass


@pytest.fixture(scope="module")
def proxy(server: Server) -> Iterator[Proxy]:
    with Proxy(server.url) as proxy:
        threading.Thread(target=proxy.serve_forever, daemon=True).start()
        yield proxy
        proxy.shutdown()


def test_pages_lead_nowhere_else(proxy: Proxy) -> None:
    with httpx.Client() as http:
        for page in ("/", "/docs"):
            answer = http.get(proxy.url + page)
            assert answer.status_code == 200
            names = re.findall(r'(?:src|href)="([^"#]+)"', answer.text)
            assert names
            for name in names:
                address = urljoin(str(answer.url), name)
                assert address.startswith(proxy.url + "/") and http.get(address).status_code == 200, name


def test_a_render_is_found_where_it_is_said_to_be(proxy: Proxy) -> None:
    with httpx.Client() as http:
        origin = proxy.url.removesuffix(PREFIX)
        body = {"scene": SCENE, "settings": SMALL}
        answer = http.post(f"{proxy.url}/v1/renders", json=body, headers={"origin": origin})
        address = urljoin(str(answer.url), answer.headers["location"])
        assert http.get(address, params={"wait": PATIENCE_S}, timeout=PATIENCE_S).json()["state"] == "done"
        assert http.get(f"{address}/image").content.startswith(b"\x89PNG")
        assert http.get(f"{proxy.url}/openapi.json").json().get("servers") is None, "relative to itself"


def test_the_stream_passes(proxy: Proxy) -> None:
    client = Client(proxy.url, origin=proxy.url.removesuffix(PREFIX))
    with client:
        assert client.until("hello")
        client.start()
        done, last = client.finished()
        assert done["samples"] == last.samples == 8
