"""Large answers: in pieces, without memory, one client's beside another's."""

from __future__ import annotations

import asyncio
import gc
import os
import socket
import tempfile
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import urlsplit

import numpy as np
import pytest
from starlette.types import Message, Receive, Scope, Send

from service.problems import TooManyRequests, Unavailable
from service.server.http import downloads
from service.server.http.downloads import PIECE, SMALL, Downloads, FileAnswer, Pieces
from service.system.memory import MemoryBudget
from tests.calls import metrics
from tests.serving import PATIENCE_S, SCENE, Server, wait_until

SIZE = 768  # of a picture of 9 MiB in float32
UNREAD = 30


class Connection:
    """The other end of an answer, which goes away after so many pieces."""

    def __init__(self, goes_after: int = 1 << 30) -> None:
        self.body, self.pieces, self.whole = b"", 0, False
        self.headers: dict[bytes, bytes] = {}
        self._goes_after = goes_after
        self._gone = asyncio.Event()

    async def receive(self) -> Message:
        await self._gone.wait()
        return {"type": "http.disconnect"}

    async def send(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self.headers = dict(message["headers"])
            return
        assert len(message["body"]) <= PIECE and not self.whole
        self.body += message["body"]
        self.pieces += 1
        self.whole = not message.get("more_body", False)
        if self.pieces == self._goes_after:
            self._gone.set()
        await asyncio.sleep(0)


def file_of(data: bytes) -> BinaryIO:
    file = tempfile.TemporaryFile()  # noqa: SIM115 (closed with its answer)
    file.write(data)
    file.flush()
    return file


@pytest.mark.parametrize("size", [0, 5, PIECE, 3 * PIECE + 1])
def test_a_file_and_a_body_in_pieces(size: int) -> None:
    data = np.random.default_rng(size).bytes(size)

    async def in_memory(scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "headers": [], "status": 200})
        await send({"type": "http.response.body", "body": data})

    async def test(answer: Any) -> Connection:
        there = Connection()
        await answer({"type": "http"}, there.receive, there.send)
        return there

    for answer in (FileAnswer(file_of(data), "image/png", {}), Pieces(in_memory)):
        there = asyncio.run(test(answer))
        assert there.body == data and there.whole and there.pieces == max(1, -(-size // PIECE))
    there = asyncio.run(test(FileAnswer(file_of(data), "image/png", {"cache-control": "no-store"})))
    assert there.headers[b"content-length"] == b"%d" % size and there.headers[b"content-type"] == b"image/png"


def test_a_file_is_not_read_for_nobody() -> None:
    async def test() -> None:
        there = Connection(goes_after=2)
        await FileAnswer(file_of(b"x" * 100 * PIECE), "image/png", {})({"type": "http"}, there.receive, there.send)
        assert not there.whole and there.pieces < 10

    asyncio.run(test())


def test_each_client_has_its_turn(tmp_path: Path) -> None:
    """Who asks for many pictures has one in work at a time, so that another is next."""

    async def test() -> None:
        room, order, let_go = Downloads(tmp_path), list[str](), asyncio.Event()

        async def ask(client: str) -> None:
            async with room.turn(client):
                order.append(client)
                await let_go.wait()

        many = [asyncio.create_task(ask("many")) for _ in range(10)]
        await asyncio.sleep(0.01)
        few = asyncio.create_task(ask("few"))
        await asyncio.sleep(0.01)
        assert order == ["many", "few"]
        let_go.set()
        await asyncio.gather(few, *many)

    asyncio.run(test())


def test_there_is_room_for_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a thread drops last is counted back by the loop, whose shares have no lock."""
    monkeypatch.setattr(downloads, "ROOM", 1000)

    async def test() -> None:
        room = Downloads(tmp_path)
        one = room.write(lambda file: file.write(b"x" * 400), 400)
        room.admit("many", 5000)  # whatever its size, one goes
        room.keep("many", "key", one)
        assert room.find("key") is one and not list(tmp_path.iterdir())
        with pytest.raises(TooManyRequests):
            room.admit("many", 101)
        room.admit("few", 600)
        two = room.write(lambda file: file.write(b"x" * 600), 600)
        room.keep("few", None, two)
        with pytest.raises(Unavailable):
            room.admit("third", 1)
        both = [one, two]
        del one, two
        await asyncio.to_thread(both.clear)
        gc.collect()
        await asyncio.sleep(0.01)
        assert room.find("key") is None
        room.admit("many", 1000)

    asyncio.run(test())


class FullDisk(Downloads):
    """Files are made on the disk, and none has room for a byte."""

    tried = 0

    def _new_file(self) -> BinaryIO:
        self.tried += 1
        return open("/dev/full", "wb")


@pytest.mark.parametrize("size", [1, SMALL, SMALL + 1, 8 * SMALL])
def test_on_a_full_disk_answers_come_from_memory(tmp_path: Path, size: int) -> None:
    """Small ones always do. Their memory counts until the last reference."""
    memory = MemoryBudget(10 * SMALL)
    room, data = FullDisk(tmp_path, memory), np.random.default_rng(size).bytes(size)
    written = room.write(lambda file: file.write(data), size)
    assert os.pread(written.file.fileno(), size + 1, 0) == data and written.bytes == size
    assert memory.used()["pictures"] == size and room.tried == (size > SMALL)
    del written
    gc.collect()
    assert memory.used()["pictures"] == 0


@pytest.mark.parametrize("size", [1, 8 * SMALL])
def test_without_disk_and_memory_the_reason_is_named(tmp_path: Path, size: int) -> None:
    with pytest.raises(Unavailable, match=r"the server's disk is full.*SUNBOX_MEMORY"):
        FullDisk(tmp_path, MemoryBudget(0)).write(lambda file: file.write(bytes(size)), size)
    written = Downloads(tmp_path, MemoryBudget(0)).write(lambda file: file.write(bytes(size)), size)
    assert written.bytes == size, "with one of the two there is room"


def test_a_large_answer_in_memory_does_not_stay(tmp_path: Path) -> None:
    async def test() -> None:
        memory = MemoryBudget(10 * SMALL)
        for room, size in ((FullDisk(tmp_path, memory), SMALL), (FullDisk(tmp_path, memory), 2 * SMALL)):
            written = room.write(partial(lambda size, file: file.write(bytes(size)), size), size)
            room.keep("a", "key", written, lasting=True)
            del written
            gc.collect()
            assert (room.find("key") is not None) == (size == SMALL)

    asyncio.run(test())


def resident(server: Server) -> int:
    pages = Path(f"/proc/{server.process.pid}/statm").read_text().split()[1]
    return int(pages) * 4096


def test_downloads_that_nobody_reads(server: Server) -> None:
    """They hold no memory, and nobody waits for them. In one piece each they took 20 MiB apiece."""
    settings = {"width": SIZE, "height": SIZE, "max_samples": 1}
    id = server.http.post("/v1/renders", json={"scene": SCENE, "settings": settings}).json()["id"]
    assert server.http.get(f"/v1/renders/{id}", params={"wait": PATIENCE_S}).json()["state"] == "done"
    pixels = server.http.get(f"/v1/renders/{id}/image", params={"format": "npy"}).content
    picture = server.http.get(f"/v1/renders/{id}/image", params={"format": "exr"}).content
    asset = server.http.post("/v1/assets", content=picture).json()["id"]
    address = urlsplit(server.url)
    targets = [f"/v1/renders/{id}/image?format=npy", f"/v1/assets/{asset}"]
    name = 'sunbox_requests_total{method="GET",route="/v1/assets/{id}",status="200"}'
    before = metrics(server).get(name, 0)
    with ExitStack() as stack:
        for i in range(UNREAD):
            connection = stack.enter_context(socket.socket())
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.connect((address.hostname, address.port))
            connection.sendall(f"GET {targets[i % 2]} HTTP/1.1\r\nHost: {address.netloc}\r\n\r\n".encode())
            connection.settimeout(PATIENCE_S)
            assert connection.recv(16, socket.MSG_PEEK).startswith(b"HTTP/1.1 200")
        assert server.http.get("/healthz").status_code == 200
        assert server.http.get(targets[0]).content == pixels
        held = resident(server)
    wait_until(lambda: metrics(server).get(name, 0) >= before + UNREAD // 2)
    assert held - resident(server) < 50 << 20
