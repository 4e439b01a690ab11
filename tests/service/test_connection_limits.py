"""Connections that stand still are ended, slow ones are not; who keeps many can't keep others out."""

from __future__ import annotations

import asyncio
import base64
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest
import uvicorn
from starlette.types import Message, Receive, Scope, Send

from service.config import Config
from service.problems import Unavailable
from service.server.http import connection_limits, guard
from service.server.http.connection_limits import Room, Watch
from service.server.http.connections import connection_class
from service.server.http.guard import Guard, open_for_health, turning_away
from service.server.launch import listen
from service.server.routes.errors import respond

LARGE = 4 << 20
RATE = 2 << 20  # bytes a second, of the slow reader


async def app(scope: Scope, receive: Receive, send: Send) -> None:
    """Answers without reading the body; /large with LARGE bytes, /wait after a second."""
    if scope["type"] == "lifespan":
        return
    if scope["path"] == "/wait":
        await asyncio.sleep(1)
    if scope["path"] == "/body":
        while (await receive()).get("more_body"):
            pass
    body = b"x" * (LARGE if scope["path"] == "/large" else 2)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"%d" % len(body))]})
    await send({"type": "http.response.body", "body": body})


class _Server(uvicorn.Server):
    watch = Watch()

    async def on_tick(self, counter: int) -> bool:
        self.watch.check(self.server_state.connections)
        return await super().on_tick(counter)


@contextmanager
def serving(most: int = 100, asgi: Any = app) -> Iterator[tuple[str, int]]:
    listener = listen("127.0.0.1", 0)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 16)
    refuse = turning_away(Unavailable("There is no room.", 5), respond)
    http = connection_class(most, open_for_health(asgi, refuse))
    config = uvicorn.Config(asgi, http=http, lifespan="off", log_config=None, access_log=False, timeout_keep_alive=60)
    server = _Server(config)
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    try:
        yield listener.getsockname()[:2]
    finally:
        server.should_exit = server.force_exit = True
        thread.join(10)


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HEAD_S", "REST_S", "UNREAD_S"):
        monkeypatch.setattr(connection_limits, name, 0.5)


def connected(address: tuple[str, int], said: bytes = b"") -> socket.socket:
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 14)
    connection.settimeout(10)
    connection.connect(address)
    connection.sendall(said)
    return connection


def get(path: str = "/", extra: bytes = b"") -> bytes:
    return b"GET " + path.encode() + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n" + extra + b"\r\n"


def is_ended(connection: socket.socket) -> bool:
    try:
        return connection.recv(65536) == b""
    except ConnectionError:
        return True


def answer(connection: socket.socket, request: bytes) -> bytes:
    connection.sendall(request)
    return connection.recv(65536)


def is_ended_in_spite_of_bytes(connection: socket.socket, pieces: int = 2000) -> bool:
    """Whether it is ended although a byte is sent now and then."""
    connection.setblocking(False)
    try:
        for _ in range(pieces):
            connection.send(b"x")
            time.sleep(0.05)
    except ConnectionError:
        return True
    return False


def test_heads_that_never_end() -> None:
    with serving() as address:
        silent, half = connected(address), connected(address, b"GET / HT")
        again = connected(address)
        assert answer(again, get()).startswith(b"HTTP/1.1 200")
        resting, busy = connected(address), connected(address, get("/wait"))
        assert answer(resting, get()).startswith(b"HTTP/1.1 200")
        assert is_ended_in_spite_of_bytes(again), "a second head"
        assert is_ended(silent) and is_ended(half)
        assert busy.recv(65536).startswith(b"HTTP/1.1 200")
        assert answer(resting, get()).startswith(b"HTTP/1.1 200"), "it rested between two requests"


def test_what_is_left_of_a_body() -> None:
    with serving() as address:
        post = connected(address, b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 100000\r\n\r\n")
        assert post.recv(65536).startswith(b"HTTP/1.1 200")
        assert is_ended_in_spite_of_bytes(post)


def test_a_slow_download_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four times as long as an unread answer may take."""
    with serving() as address:
        connection = connected(address, get("/large"))
        received, began = 0, time.monotonic()
        while received < LARGE:
            piece = connection.recv(1 << 14)
            assert piece, f"cut off after {received} bytes"
            received += len(piece)
            time.sleep(max(0.0, received / RATE - (time.monotonic() - began)))
        assert time.monotonic() - began > 3 * connection_limits.UNREAD_S


@pytest.mark.parametrize("piece", [0, 1])
def test_a_download_that_nobody_reads(piece: int) -> None:
    """Or at a byte in a tenth of a second."""
    with serving() as address:
        connection, began = connected(address, get("/large")), time.monotonic()
        left = LARGE
        while time.monotonic() - began < 1.5:
            time.sleep(0.1)
            if piece:
                left -= len(connection.recv(piece))
        with pytest.raises(ConnectionError):  # a reset: what waited in the kernel is gone, too
            while left > 0:
                left -= len(connection.recv(1 << 20)) or LARGE


def test_pings_of_a_client_that_reads_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is answered at once; unread, the answers took a hundred megabytes in ten seconds."""
    monkeypatch.setattr(connection_limits, "UNREAD_S", 1000.0)

    async def stream(scope: Scope, receive: Receive, send: Send) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        while (await receive())["type"] != "websocket.disconnect":
            pass

    upgrade = b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    upgrade += b"Sec-WebSocket-Key: " + base64.b64encode(bytes(16)) + b"\r\n"
    pings = (b"\x89\xfd" + bytes(4) + b"x" * 125) * 1000
    with serving(asgi=stream) as address:
        connection = connected(address)
        assert b" 101 " in answer(connection, get(extra=upgrade))
        with pytest.raises(ConnectionError):
            for _ in range(500):  # 65 MB
                connection.sendall(pings)


def test_a_frame_goes_on() -> None:
    """A stream's is in memory as a whole, so a quarter of it must be taken in the time of 30 KiB of an answer."""
    least = connection_limits.LEAST_RATE * connection_limits.UNREAD_S
    stream, download = Frame(1 << 20), Frame(1 << 20)
    download.cycle = download.conn = SimpleNamespace(response_complete=False, their_state=None)  # type: ignore[attr-defined]
    assert connection_limits._least(stream) == 1 << 18 and connection_limits._least(download) == least
    assert connection_limits._least(Frame(100)) == least

    watch = Watch()
    with pytest.MonkeyPatch.context() as patch:
        now = 0.0
        patch.setattr(connection_limits, "time", SimpleNamespace(monotonic=lambda: now))
        patch.setattr(connection_limits, "_delivered", lambda transport: transport.read)
        for _ in range(3):
            for connection in (stream, download):
                connection.read += int(least)
            watch.check([stream, download])
            now += 0.9 * connection_limits.UNREAD_S
        assert stream.ended and not download.ended


class Frame:
    """A WebSocket's connection with so many unsent bytes."""

    def __init__(self, unsent: int) -> None:
        self.transport, self.unsent, self.read, self.ended = self, unsent, 0, False

    def get_write_buffer_size(self) -> int:
        return self.unsent - self.read

    def abort(self) -> None:
        self.ended = True


def test_a_full_server_says_so() -> None:
    with serving(most=4) as address:
        busy = [connected(address, get("/wait")) for _ in range(2)]
        full = connected(address)
        head, _, body = answer(full, get()).partition(b"\r\n\r\n")
        assert b" 503 " in head and b"retry-after: 5" in head and b"connection: close" in head and b"no room" in body
        assert answer(connected(address), get("/healthz")).startswith(b"HTTP/1.1 200")
        assert all(each.recv(65536).startswith(b"HTTP/1.1 200") for each in busy)
        # Both rest now: the one that has done so longer makes room.
        assert answer(connected(address), get()).startswith(b"HTTP/1.1 200")
        assert is_ended(busy[0]) and answer(busy[1], get()).startswith(b"HTTP/1.1 200")


class Peer:
    """A connection as uvicorn has it."""

    def __init__(
        self,
        address: str,
        idle_since: float | None = None,
        began: float = 0.0,
        cycle: Any = None,
        refused: bool = False,
    ) -> None:
        self.refused = refused
        self.client, self.began, self.cycle, self.transport = (address, 1), began, cycle, self
        self.timeout_keep_alive_task = None if idle_since is None else self
        self.when = lambda: idle_since
        self.ended = False

    def is_closing(self) -> bool:
        return self.ended

    def shutdown(self) -> None:
        self.ended = True

    abort = shutdown


def test_one_address_has_half_of_the_room() -> None:
    now = time.monotonic()
    room, crowd = Room(8), [Peer("10.0.0.1", cycle=1) for _ in range(4)]
    for address, entered in (("10.0.0.1", False), ("::ffff:10.0.0.1", False), ("10.0.0.2", True)):
        newcomer = Peer(address, began=now)
        assert room.enter(newcomer, [*crowd, newcomer]) is entered
    second = [Peer("10.0.0.2", cycle=1) for _ in range(2)]  # half of what is left
    for address, entered in (("10.0.0.2", False), ("10.0.0.3", True)):
        newcomer = Peer(address, began=now)
        assert room.enter(newcomer, [*crowd, *second, newcomer]) is entered
    v6 = [Peer(f"2001:db8::{i}", cycle=1) for i in range(4)]
    for address, entered in (("2001:db8::99", False), ("2001:db8:0:1::1", True)):
        newcomer = Peer(address, began=now)
        assert room.enter(newcomer, [*v6, newcomer]) is entered
    full = [Peer(f"10.0.1.{i}", cycle=1) for i in range(8)]
    newcomer = Peer("10.0.0.3", began=now)
    assert not room.enter(newcomer, [*full, newcomer])


def test_the_refused_take_no_room() -> None:
    """They are answered one after the other: a flood of them does not keep out whoever asks for the health check."""
    now, room = time.monotonic(), Room(8)
    crowd = [Peer("10.0.0.1", cycle=1) for _ in range(4)]
    flood = [Peer("10.0.0.1", began=now + i, cycle=1, refused=True) for i in range(connection_limits.REFUSALS)]
    newcomer = Peer("10.0.0.2", began=now)
    assert room.enter(newcomer, [*crowd, *flood, newcomer])
    newcomer = Peer("10.0.0.1", began=now)
    assert not room.enter(newcomer, [*crowd, *flood, newcomer])
    assert [each for each in (*crowd, *flood, newcomer) if each.ended] == flood[:1]


def test_a_proxy_has_no_share_of_its_own() -> None:
    now, room = time.monotonic(), Room(8, ["10.0.0.0/24", "2001:db8::/64"])
    for address, other in (("10.0.0.1", "10.0.1.1"), ("2001:db8::1", "2001:db9::1")):
        crowd = [Peer(address, cycle=1) for _ in range(6)]
        assert room.enter(Peer(address, began=now), [*crowd, Peer(address, began=now)])
        others = [Peer(other, cycle=1) for _ in range(5)]
        assert not room.enter(others[0], others)
        assert not room.enter(Peer(address, began=now), [*crowd, *others[:3]])


def test_who_rests_makes_room() -> None:
    now = time.monotonic()
    resting, longest = Peer("a", idle_since=now, cycle=1), Peer("a", idle_since=now - 9, cycle=1)
    slow, fresh, newcomer = Peer("a", began=now - 5), Peer("a", began=now), Peer("a", began=now)
    everybody = [Peer("a", cycle=1), resting, fresh, slow, longest, newcomer]
    room = Room(4)
    for first in (longest, resting, slow):
        assert room.enter(newcomer, everybody) and first.ended
    assert not room.enter(newcomer, everybody) and not fresh.ended


def test_a_body_that_drips(monkeypatch: pytest.MonkeyPatch) -> None:
    """A byte now and then is no pause, and would hold a place for ever, however fast the body came before."""
    now = 0.0
    monkeypatch.setattr(guard, "time", SimpleNamespace(monotonic=lambda: now))
    answers, pieces = list[Message](), list[bytes]()

    async def receive() -> Message:
        nonlocal now
        pieces.append(b"x" * (1 << 20) if not pieces else b"x")
        now += 5
        await asyncio.sleep(0)
        return {"type": "http.request", "body": pieces[-1], "more_body": True}

    async def send(message: Message) -> None:
        answers.append(message)

    async def reading(scope: Scope, receive: Receive, send: Send) -> None:
        with pytest.raises(guard.TimedOut, match="too slowly"):
            for _ in range(100):
                await receive()

    headers = [(b"host", b"127.0.0.1")]
    scope = {"type": "http", "method": "POST", "path": "/", "headers": headers, "server": ("127.0.0.1", 80)}
    asyncio.run(Guard(reading, config=Config(), refuse=respond)(scope, receive, send))
    assert len(pieces) == 8, "the first, and seven bytes in 30 s"


def test_a_slow_body_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """1 KiB/s is enough, for hours."""
    now, received = 0.0, 0
    monkeypatch.setattr(guard, "time", SimpleNamespace(monotonic=lambda: now))

    async def receive() -> Message:
        nonlocal now
        now += 10
        await asyncio.sleep(0)
        return {"type": "http.request", "body": bytes(10 * guard.LEAST_RATE), "more_body": True}

    async def reading(scope: Scope, receive: Receive, send: Send) -> None:
        nonlocal received
        for _ in range(1000):
            received += len((await receive())["body"])

    scope = {"type": "http", "method": "POST", "path": "/", "headers": [], "server": ("10.0.0.1", 80)}
    asyncio.run(Guard(reading, config=Config(), refuse=respond)(scope, receive, None))  # type: ignore[arg-type]
    assert received == 10_000 * guard.LEAST_RATE
