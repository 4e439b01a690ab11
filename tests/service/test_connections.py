"""Connections: small answers in one piece."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from service.server.http.connections import JOINED, MOST_BESIDE, JoinedWrites
from tests.serving import Server


@contextmanager
def connected(server: Server) -> Iterator[socket.socket]:
    address = urlsplit(server.url)
    with socket.create_connection((address.hostname, address.port), 10) as connection:
        yield connection


def test_head_and_body_come_in_one_piece(server: Server) -> None:
    """In two packets they wait for each other: 43 ms by the client's delayed acknowledgement."""
    with connected(server) as connection:
        for _ in range(3):
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            head, _, body = connection.recv(65536).partition(b"\r\n\r\n")
            assert head.startswith(b"HTTP/1.1 200") and body == b'{"status":"ok"}'


def test_an_answer_on_a_stream_comes_in_one_piece(server: Server) -> None:
    """And alone: frames of RFC 6455 by hand, as a client's library reads ahead."""
    with connected(server) as connection:
        head = "GET /v1/stream HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        head += "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
        connection.sendall(f"{head}Sec-WebSocket-Protocol: sunbox.v1\r\n\r\n".encode())
        received = b""
        while b'"hello"' not in received:
            received += connection.recv(65536)
        ping = b'{"type":"ping"}'
        for _ in range(3):
            connection.sendall(bytes([0x81, 0x80 | len(ping)]) + bytes(4) + ping)
            answer = connection.recv(65536)
            assert (answer[0], answer[1]) == (0x81, len(answer) - 2) and json.loads(answer[2:])["type"] == "pong"


class Written:
    """A transport that keeps what is written to it."""

    def __init__(self) -> None:
        self.writes: list[bytes] = []
        self.unsent = 0
        self.ended = ""

    def write(self, data: bytes) -> None:
        assert not self.ended
        self.writes.append(bytes(data))

    def close(self) -> None:
        self.ended = "closed"

    def abort(self) -> None:
        self.ended = "aborted"

    def get_write_buffer_size(self) -> int:
        return self.unsent

    def get_extra_info(self, name: str, default: Any) -> Any:
        return self

    def setsockopt(self, *options: Any) -> None:
        self.options = options


def test_writes_of_one_turn_are_joined() -> None:
    async def run() -> None:
        written: Any = Written()
        joined = JoinedWrites(written)
        for data in (b"head", b"", b"body"):
            joined.write(data)
        assert joined.get_write_buffer_size() == 8 and not written.writes
        await asyncio.sleep(0)
        assert written.writes == [b"headbody"] and joined.get_write_buffer_size() == 0
        joined.write(b"head")
        joined.write(b"x" * JOINED)  # long ones are not copied, and keep their place
        joined.write(b"end")
        joined.close()
        assert written.writes[1:] == [b"head", b"x" * JOINED, b"end"] and written.ended == "closed"
        await asyncio.sleep(0)

    asyncio.run(run())


def test_what_is_aborted_writes_nothing() -> None:
    async def run() -> None:
        written: Any = Written()
        joined = JoinedWrites(written)
        joined.write(b"head")
        joined.abort()
        await asyncio.sleep(0)
        assert written.writes == [] and written.ended == "aborted"
        assert written.options[1] == socket.SO_LINGER

    asyncio.run(run())


def test_what_nobody_reads_has_an_end() -> None:
    """Pongs to a client that sends pings and reads nothing; a frame of any size may be on its way beside some."""

    async def run() -> None:
        written: Any = Written()
        joined = JoinedWrites(written)
        joined.write(bytes(8 * MOST_BESIDE))
        written.unsent = 8 * MOST_BESIDE
        count = 0
        while not written.ended:
            joined.write(bytes(JOINED + 1))
            written.unsent += JOINED + 1
            count += 1
        assert written.ended == "aborted" and count == MOST_BESIDE // (JOINED + 1) + 1
        joined.write(bytes(JOINED))  # the rest of the pings that came together
        written.ended = ""
        await asyncio.sleep(0)
        assert len(written.writes) == count

        written = Written()
        joined = JoinedWrites(written)
        for _ in range(100):  # a client that reads takes any number of frames
            joined.write(bytes(MOST_BESIDE))
            joined.write(bytes(125))
        assert not written.ended

    asyncio.run(run())


def test_a_vanished_peer_is_noticed(server: Server) -> None:
    """The kernel probes a connection that is silent; without that a render goes on for nobody."""
    with connected(server) as connection:
        address = connection.getsockname()
        table = Path("/proc/net/tcp").read_text().splitlines()[1:]
        ours = f"{address[1]:04X}"
        timers = [row.split()[5] for row in table if row.split()[2].endswith(f":{ours}")]
        assert timers and timers[0].startswith("02:"), "its timer is not the keep-alive's"


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_a_listener_hands_its_options_on(host: str) -> None:
    from service.server.launch import listen

    try:
        listener = listen(host, 0)
    except OSError:
        pytest.skip(f"there is no {host} here")
    with listener, socket.create_connection(listener.getsockname()[:2]):
        accepted, _ = listener.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
