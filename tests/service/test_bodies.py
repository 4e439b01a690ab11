"""Bodies that are on their way: one caller's never refuse another's."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from service.config import Config
from service.document.text import most_bytes
from service.problems import Unavailable
from service.server.app import create_app
from service.server.renders.render import Render
from service.server.requests.bodies import SMALL
from service.server.routes.submission import allowed
from service.server.state import AppState
from service.system.executors import Pool, packing, saving, storing
from tests.calls import loaded

MIB = 1 << 20
GREY = b'{"type": "diffuse", "albedo": 0.5}'
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


class Call:
    """A request to an application in this process; `end` lets its body end."""

    def __init__(self, app: Any, key: str, method: str, path: str, body: bytes, half: bool = False) -> None:
        self._coming = [{"type": "http.request", "body": body, "more_body": half}]
        self._ending = asyncio.Event()
        self.status, self.body, self.waiting = 0, b"", asyncio.Event()
        headers = [(b"host", b"127.0.0.1"), (b"authorization", f"Bearer {key}".encode())]
        scope = {"type": "http", "method": method, "path": path, "raw_path": path.encode(), "query_string": b""}
        scope |= {"headers": headers, "server": ("127.0.0.1", 80), "client": ("127.0.0.1", 1), "http_version": "1.1"}
        self.task = asyncio.create_task(app(scope, self._receive, self._send))

    async def _receive(self) -> Any:
        if self._coming:
            return self._coming.pop()
        self.waiting.set()
        await self._ending.wait()
        return {"type": "http.disconnect"}

    async def _send(self, message: Any) -> None:
        self.status = message.get("status", self.status)
        self.body += message.get("body", b"")

    async def answered(self) -> int:
        await self.task
        return self.status

    async def stalled(self) -> bool:
        """Whether the body's first half was received, and the rest is waited for; else it was answered."""
        waiting = asyncio.create_task(self.waiting.wait())
        await asyncio.wait({waiting, self.task}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        return self.status == 0

    async def end(self) -> None:
        self._ending.set()
        await self.task


def calling(folder: Path, test: Callable[[Any], Awaitable[None]], **limits: Any) -> None:
    """Run a test with an application that asks for the key a or b; nothing renders."""

    async def run() -> None:
        app = create_app(Config(data_dir=folder, api_key=["a", "b"], **limits))
        state: AppState = app.state.sunbox
        state.storage.documents.prepare()
        await loaded(state)
        try:
            await test(app)
            assert state.uploads.total == 0 and state.memory.used()["bodies"] == 0, "something still counts"
        finally:
            state.storage.assets.close()
            state.bodies.close()

    asyncio.run(run())


def test_half_sent_uploads_refuse_nobody_else(tmp_path: Path) -> None:
    async def test(app: Any) -> None:
        half: list[Call] = []
        for received in (True, True, False, False):
            half.append(Call(app, "a", "POST", "/v1/assets", bytes(MIB - 60), half=True))
            assert await half[-1].stalled() is received
        assert half[3].status == 429 and b"SUNBOX_MAX_BODIES" in half[3].body
        large = OBJ + b"#" * (MIB - 60)
        for body, status in ((OBJ, 201), (large, 201)):
            assert await Call(app, "b", "POST", "/v1/assets", body).answered() == status
        assert await Call(app, "a", "POST", "/v1/assets", OBJ).answered() == 201, "small ones are not counted"
        for each in half:
            await each.end()

    calling(tmp_path, test, max_body=MIB, max_bodies=4 * MIB)


@pytest.mark.parametrize("size", [100, 3 * SMALL])
def test_half_sent_json_refuses_nobody_else(tmp_path: Path, size: int) -> None:
    async def test(app: Any) -> None:
        address = "/v1/documents/materials/grey"
        half: list[Call] = []
        for received in (True, True, False, False):
            half.append(Call(app, "a", "PUT", address, b" " * 4 * SMALL, half=True))
            assert await half[-1].stalled() is received
        assert half[3].status == 429 and b"SUNBOX_MAX_JSON" in half[3].body
        other = Call(app, "b", "PUT", address, GREY + b" " * size)
        assert await other.answered() == 201, other.body
        for each in half:
            await each.end()

    calling(tmp_path, test, max_json=4 * SMALL)


def test_a_body_counts_while_it_is_in_memory(tmp_path: Path) -> None:
    """One that is too large is received to its end, but nothing of it is stored."""

    async def test(app: Any) -> None:
        memory = app.state.sunbox.memory
        call = Call(app, "a", "PUT", "/v1/documents/materials/grey", b" " * 3 * SMALL, half=True)
        assert await call.stalled() and memory.used()["bodies"] == 3 * SMALL
        too_large = Call(app, "b", "PUT", "/v1/documents/materials/grey", b" " * 5 * SMALL, half=True)
        assert await too_large.stalled() and memory.used()["bodies"] == 3 * SMALL
        for each in (call, too_large):
            await each.end()
        whole = Call(app, "b", "PUT", "/v1/documents/materials/grey", json.dumps({}).encode() + b" " * 5 * SMALL)
        assert await whole.answered() == 413

    calling(tmp_path, test, max_json=4 * SMALL)


def test_large_uploads_hold_back_nobody_else(tmp_path: Path) -> None:
    """While one caller's are parsed for minutes: another's files are stored, found and pinned."""

    async def test(app: Any) -> None:
        state: AppState = app.state.sunbox
        go_on = threading.Event()
        large = [asyncio.ensure_future(storing(lambda: go_on.wait(60), name)) for name in ("a", "a", "a", "c")]
        try:
            async with asyncio.timeout(50):
                small = Call(app, "b", "POST", "/v1/assets", OBJ)
                assert await small.answered() == 201
                id = json.loads(small.body)["id"]
                assert await Call(app, "b", "GET", f"/v1/assets/{id}", b"").answered() == 200
                async with allowed(state, "", [("", id)]):
                    pass
            assert not any(each.done() for each in large)
        finally:
            go_on.set()
        await asyncio.gather(*large)

    calling(tmp_path, test)


# Calls whose values wait for nothing: they are answered as soon as the body is parsed.
AT_ONCE = {"/v1/materials/convert"}


@pytest.mark.parametrize("blanks", [0, 2 * SMALL])
def test_a_body_s_values_count_until_they_are_packed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, blanks: int
) -> None:
    """By every call that takes JSON: while they wait for a thread, for the disk and for a renderer."""

    async def test(app: Any) -> None:
        state: AppState = app.state.sunbox
        seen = list[int]()

        async def able(seconds: float) -> None: ...

        async def waits(*args: Any, **values: Any) -> Any:
            seen.append(state.memory.used()["bodies"])
            for job in args:
                if isinstance(job, Render):
                    assert state.memory.used()["scenes"] > 0, "what was packed counts, too"
                    job.release()  # as the queue does with one that it refuses
            raise Unavailable("It has been waiting.")

        async def work(pool: Pool, *args: Any) -> Any:
            if pool in (packing, storing, saving):
                seen.append(state.memory.used()["bodies"])
            return await run(pool, *args)

        run = Pool.__call__
        monkeypatch.setattr(Pool, "__call__", work)
        monkeypatch.setattr(state.renderers, "able", able)
        for waiting, name in ((state.render_queue, "submit"), (state.batches, "submit"), (state.bsdf, "ask")):
            monkeypatch.setattr(waiting, name, waits)
        for path, method, name, example in _examples(app.openapi()):
            seen.clear()
            address = path.replace("{kind}", f"{name}s").replace("{name}", "example")
            body = json.dumps(example).encode().ljust(blanks)
            call = Call(app, "a", method.upper(), address, body)
            assert await call.answered() in (200, 201, 503), (path, call.body)
            assert len(seen) > 0 or path in AT_ONCE, path
            assert all(counted >= most_bytes(body) for counted in seen), (path, seen, most_bytes(body))
            assert state.memory.used()["bodies"] == state.memory.used()["documents"] == 0, path

    calling(tmp_path, test)


def _examples(description: Any) -> Iterator[tuple[str, str, str, Any]]:
    """Each call that takes JSON, with its method, and an example's name and value."""
    for path, methods in description["paths"].items():
        for method, call in methods.items():
            if (content := call.get("requestBody", {}).get("content", {}).get("application/json")) is not None:
                assert content["examples"], path
                for name, example in content["examples"].items():
                    yield path, method, name, example["value"]
