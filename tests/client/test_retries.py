"""A server that is full, restarts, or is away."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, ClassVar

import pytest

import sunbox
from sunbox.transport import FIRST_CONTACT_S, FIRST_PAUSE_S, PATIENCE_S, SHORTEST_PAUSE_S, Again, _pause
from tests.counting import in_simulated_time

STATUS = {"id": "a", "state": "done", "samples": 1, "noise": None, "warnings": [], "settings": {"max_samples": 1}}
PROBLEM = {"title": "Full", "status": 503, "detail": "Too much is waiting.", "errors": []}


class Scripted(BaseHTTPRequestHandler):
    """Answers the n-th request by the n-th of `script`, and all further ones by the last: a status and a document;
    None breaks the connection."""

    protocol_version = "HTTP/1.1"
    script: ClassVar[list[Any]] = []
    asked: ClassVar[list[tuple[str, str, dict[str, str]]]] = []

    def do_GET(self) -> None:
        body = self.rfile.read(int(self.headers.get("content-length", 0)))
        self.asked.append(
            (self.command, self.path, {k.lower(): v for k, v in self.headers.items()} | {"body": body.decode()})
        )
        step = self.script.pop(0) if len(self.script) > 1 else self.script[0]
        if step is None:
            self.close_connection = True
            return
        status, answer, kind = step
        data = answer if isinstance(answer, bytes) else json.dumps(answer).encode()
        self.send_response(status)
        self.send_header("content-type", kind)
        self.send_header("content-length", str(len(data)))
        if status == 503:
            self.send_header("retry-after", "0")
        self.end_headers()
        self.wfile.write(data)

    do_POST = do_DELETE = do_GET

    def log_message(self, *ignored: Any) -> None:
        pass


@pytest.fixture
def scripted() -> Iterator[tuple[sunbox.Client, list[Any], list[Any]]]:
    Scripted.script, Scripted.asked = [], []
    with ThreadingHTTPServer(("127.0.0.1", 0), Scripted) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with sunbox.Client(f"http://127.0.0.1:{server.server_address[1]}", key="k") as client:
            yield client, Scripted.script, Scripted.asked
        server.shutdown()


def json_answer(status: int, document: Any) -> tuple[int, Any, str]:
    return status, document, "application/json"


def test_full_server_is_asked_again(scripted: Any) -> None:
    client, script, asked = scripted
    script += [json_answer(503, PROBLEM), None, json_answer(202, {"id": "a"})]
    assert client.submit({"version": 1}).id == "a"
    assert [path for _, path, _ in asked] == ["/v1/renders"] * 3
    keys = {headers["idempotency-key"] for _, _, headers in asked}
    assert len(keys) == 1 and {headers["authorization"] for _, _, headers in asked} == {"Bearer k"}


@pytest.mark.parametrize("said", ["soon", "", "Wed, 21 Oct 2015 07:28:00 GMT"])
def test_odd_times_to_come_again(said: str) -> None:
    assert 0 <= _pause(0, said) <= FIRST_PAUSE_S


def test_servers_time_to_come_again_is_kept() -> None:
    assert _pause(0, "75") == 75 and _pause(3, "0") == 0


def test_server_that_says_when_is_heard(scripted: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    client, script, _ = scripted
    heard = []

    def pause(attempt: int, retry_after: str | None = None) -> float:
        heard.append((attempt, retry_after))
        return 0.0

    monkeypatch.setattr("sunbox.transport._pause", pause)
    script += [json_answer(503, PROBLEM), None, json_answer(200, {})]
    client.info()
    assert heard == [(0, "0"), (1, None)], "the second time nothing was said"


def test_full_server_gives_its_reason_at_last(scripted: Any) -> None:
    client, script, asked = scripted
    script += [json_answer(503, PROBLEM)]
    client._client._transport.patience = 0.3
    with pytest.raises(sunbox.Failed, match="Too much is waiting") as failed:
        client.info()
    assert failed.value.status == 503 and len(asked) > 1


def test_refusal_is_not_asked_again(scripted: Any) -> None:
    client, script, asked = scripted
    script += [json_answer(422, {**PROBLEM, "status": 422, "errors": [{"pointer": "/a", "detail": "b"}]})]
    with pytest.raises(sunbox.Refused) as refused:
        client.info()
    assert len(asked) == 1 and refused.value.errors == [("/a", "b")]


def test_page_of_a_proxy(scripted: Any) -> None:
    client, script, _ = scripted
    script += [(502, b"<html>bad gateway</html>", "text/html")]
    with pytest.raises(sunbox.Failed, match="502"):
        client.info()


def test_broken_events_are_taken_up_again(scripted: Any) -> None:
    client, script, _ = scripted
    running = f"event: progress\ndata: {json.dumps({**STATUS, 'state': 'running'})}\n\n".encode()
    done = f"event: done\ndata: {json.dumps(STATUS)}\n\n".encode()
    script += [json_answer(503, PROBLEM), None, (200, running + done, "text/event-stream")]
    assert [status["state"] for status in client.job("a").events()] == ["running", "done"]


def test_events_that_end_too_early_are_asked_for_again(scripted: Any) -> None:
    client, script, _ = scripted
    running = f"event: progress\ndata: {json.dumps({**STATUS, 'state': 'running'})}\n\n".encode()
    done = f"event: done\ndata: {json.dumps(STATUS)}\n\n".encode()
    script += [(200, running, "text/event-stream"), None, (200, done, "text/event-stream")]
    assert [status["state"] for status in client.job("a").events()] == ["running", "done"]
    script[:] = [(200, running, "text/event-stream"), None]
    client._client._transport.patience = 0.3
    with pytest.raises(sunbox.Unreachable):
        list(client.job("a").events())


def test_failed_render_says_why(scripted: Any) -> None:
    client, script, _ = scripted
    failed = {**STATUS, "state": "failed", "problem": {"detail": "Out of memory.", "status": 503}}
    script += [(200, f"event: done\ndata: {json.dumps(failed)}\n\n".encode(), "text/event-stream")]
    with pytest.raises(sunbox.Failed, match=r"Out of memory\."):
        client.job("a").result()


def test_patience_lasts_as_long_as_it_says() -> None:
    """By default longer than the 15 s in which a server ends and the seconds in which it starts again; the last
    attempt is made at the end, and a server that says "at once" is not asked without a pause."""

    async def attempts(patience_s: float, most_s: float | None = None, said: str | None = None) -> tuple[int, float]:
        again, clock = Again(patience_s), asyncio.get_running_loop().time
        began, count = clock(), 1
        while await again.after(most_s, said):
            count += 1
        return count, clock() - began

    async def test() -> None:
        count, took_s = await attempts(PATIENCE_S)
        assert took_s == pytest.approx(60) and 10 < count < 40
        count, took_s = await attempts(PATIENCE_S, FIRST_CONTACT_S)
        assert took_s == pytest.approx(5)
        assert await attempts(0) == (1, 0)
        assert await attempts(10, said="75") == (2, pytest.approx(10))
        count, took_s = await attempts(10, said="0")
        assert took_s == pytest.approx(10) and count <= 10 / SHORTEST_PAUSE_S + 2

    in_simulated_time(test())


def test_nobody_there() -> None:
    with sunbox.Client("http://127.0.0.1:1", patience=0) as client, pytest.raises(sunbox.Unreachable) as error:
        client.info()
    assert error.value.status is None and "127.0.0.1:1" in str(error.value)
