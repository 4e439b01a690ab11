"""Logs: one line an event, its fields named; no secret; tracebacks that are plain, rare, and nobody waits for."""

from __future__ import annotations

import ast
import json
import logging
import socket
import threading
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from service.system import logs
from service.system.logs import Console, Json, bound
from tests.calls import metrics
from tests.serving import PATIENCE_S, Client, Server, wait_until

ROOT = Path(__file__).parents[2]

log = logging.getLogger("service.test")


def fail(secret: str) -> None:
    raise ValueError("what went wrong")


def failing(secret: str = "a-local-secret") -> None:
    try:
        fail(secret)
    except ValueError:
        log.exception("failed", {"task": 7})


@pytest.mark.parametrize("form", ["console", "json"])
def test_tracebacks_are_plain_and_rare(form: str, untouched_logging: None, capfd: pytest.CaptureFixture[str]) -> None:
    logs.configure(form, "info")
    for _ in range(5):
        failing()
    (output,) = logging.getLogger().handlers
    assert isinstance(output, logs.Output)
    told = capfd.readouterr().err
    assert told.count("ValueError: what went wrong") == 1 and "a-local-secret" not in told
    assert "│" not in told, "Rich draws boxes, which takes seconds"
    output.tell_repeated(time.monotonic() + logs.REPEAT_S)
    (line,) = capfd.readouterr().err.splitlines()
    assert "and 4 more like it" in line and "ValueError" in line and "test_logs.py:" in line
    failing()
    assert "Traceback" in capfd.readouterr().err


def test_who_logs_does_not_wait(untouched_logging: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rendered in another thread, in order, with what the request was; all of it before the end."""
    written: list[tuple[str, str]] = []
    let_go = threading.Event()

    def write(self: logs.Output, record: logging.LogRecord) -> None:
        let_go.wait(PATIENCE_S)
        written.append((threading.current_thread().name, self.format(record)))

    monkeypatch.setattr(logging.StreamHandler, "emit", write)
    monkeypatch.setattr(logs.atexit, "register", lambda stop: None)
    logs.configure("json", "info", queued=True)
    with bound(request="mine"):
        log.info("first", {"count": 1})
        failing()
    (queued,) = logging.getLogger().handlers
    assert isinstance(queued, logs.Queued) and not written
    let_go.set()
    queued.records.put(None)
    until = time.monotonic() + PATIENCE_S
    while len(written) < 2:
        assert time.monotonic() < until
        time.sleep(0.01)
    assert threading.current_thread().name not in {thread for thread, _ in written}
    first, second = (json.loads(line) for _, line in written)
    assert (first["event"], first["count"], first["request"]) == ("first", 1, "mine")
    assert second["request"] == "mine" and "what went wrong" in second["exception"]


def test_nobody_reads_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MOST_QUEUED", 2)
    queued = logs.Queued()
    for _ in range(5):
        queued.handle(logging.makeLogRecord({"msg": "x"}))
    assert queued.records.qsize() == 2 and queued.dropped == 3


@pytest.mark.parametrize(
    "text",
    [
        '127.0.0.1:1 - "WebSocket /v1/stream?session=a-SECRET_1&x=2" [accepted]',
        "GET /v1/stream?beside=a-SECRET_1 HTTP/1.1",
        "< Authorization: Bearer a-SECRET_1",
        "< Sec-WebSocket-Protocol: sunbox.v1, sunbox.key.a-SECRET_1, other",
        "KeyError: 'a-SECRET_1-of-the-configuration'",
    ],
)
@pytest.mark.parametrize("form", ["console", "json"])
def test_no_secret_is_logged(
    text: str, form: str, untouched_logging: None, capfd: pytest.CaptureFixture[str]
) -> None:
    logs.configure(form, "debug", secrets=["a-SECRET_1-of-the-configuration", "key"])
    log.info("heard", {"text": text})
    log.info(text)
    told = capfd.readouterr().err
    assert "SECRET" not in told and told.count("***") == 2


def test_libraries_speak_of_what_matters(untouched_logging: None, capfd: pytest.CaptureFixture[str]) -> None:
    """uvicorn tells each WebSocket's address at INFO, query included; numba's DEBUG is thousands of lines."""
    logs.configure("json", "debug")
    for name in ("uvicorn.error", "numba.core.ssa", "PIL.PngImagePlugin", "asyncio", "websockets"):
        logging.getLogger(name).info("something happened")
    assert not capfd.readouterr().err
    logging.getLogger("asyncio").error("Task exception was never retrieved\nfuture: <Task>\n")
    log.debug("detail")
    lines = [json.loads(line)["event"] for line in capfd.readouterr().err.splitlines()]
    assert lines == ["Task exception was never retrieved; future: <Task>", "detail"]


def test_a_sender_that_goes_away_is_no_error(server: Server) -> None:
    """Twenty of them once stopped the service for a minute, as each cost seconds for a traceback with all locals. Now
    there is none."""
    written = server.log.read_text()
    address = urlsplit(server.url)
    refused = 'sunbox_requests_total{method="POST",route="%s",status="%d"}'
    before = metrics(server)
    routes = ("/v1/renders", "/v1/render", "/v1/assets")
    for i in range(21):
        with socket.create_connection((address.hostname, address.port), 10) as connection:
            head = f"POST {routes[i % 3]} HTTP/1.1\r\nHost: {address.netloc}\r\nContent-Length: 100000\r\n\r\n"
            connection.sendall(head.encode() + b"{" * 1000)
    assert server.http.get("/healthz").status_code == 200
    for route in routes:
        wait_until(lambda name=refused % (route, 499): metrics(server).get(name, 0) == before.get(name, 0) + 7)
        assert metrics(server).get(refused % (route, 500)) == before.get(refused % (route, 500))
    told = server.log.read_text()[len(written) :]
    assert "Traceback" not in told and "[error" not in told and "ClientDisconnect" not in told


def test_session_ids_are_in_no_log(server: Server) -> None:
    already = server.log.read_text().count("path=/v1/stream")
    session = None
    for _ in range(2):
        opened = Client(server.url, session=session)
        with opened:
            session = opened.until("hello")[0]["session"]
    wait_until(lambda: server.log.read_text().count("path=/v1/stream") == already + 2)
    assert session not in server.log.read_text()


def test_every_message_has_its_values_beside_it() -> None:
    """`"what happened", {"name": value}`: values that stand in the text can't be looked for."""
    for path in sorted((*ROOT.glob("service/**/*.py"), *ROOT.glob("gpu/**/*.py"))):
        for call in ast.walk(ast.parse(path.read_text())):
            if not (isinstance(call, ast.Call) and ast.unparse(call.func).startswith("log.")):
                continue
            message, *values = call.args[1:] if ast.unparse(call.func) == "log.log" else call.args
            where = f"{path}:{call.lineno}: {ast.unparse(call)}"
            if isinstance(message, ast.Constant):
                assert "%" not in message.value and "=" not in message.value, where
            for each in values:
                assert isinstance(each, ast.Dict | ast.Name) and len(values) == 1, where
                names = [key.value for key in each.keys] if isinstance(each, ast.Dict) else []  # type: ignore[union-attr]
                assert not {"event", "level", "logger", "timestamp", "exception"} & set(names), where


@pytest.mark.parametrize(
    ("message", "values", "console", "written"),
    [
        ("asset stored", {"id": "a b", "bytes": 3}, "id='a b' bytes=3", {"id": "a b", "bytes": 3}),
        ("compiled", {"flags": "none", "ms": 1.23456789}, "flags=none ms=1.2346", {"flags": "none", "ms": 1.2346}),
        ("100 %", {"of": None, "whole": True}, "of=None whole=True", {"of": "None", "whole": True}),
        ("could not read", {"error": ValueError("x=1")}, "error='x=1'", {"error": "x=1"}),
    ],
)
def test_values_become_fields(message: str, values: dict[str, Any], console: str, written: dict[str, Any]) -> None:
    record = log.makeRecord(log.name, logging.WARNING, "", 0, message.replace("%", "%%"), (values,), None)
    record.created = 0.5
    line = Console().format(record)
    assert line == f"1970-01-01T00:00:00.500000Z [warning  ] {message:30} [service.test] {console}"
    same = {
        "event": message,
        "level": "warning",
        "logger": "service.test",
        "timestamp": "1970-01-01T00:00:00.500000Z",
    }
    assert list(json.loads(Json().format(record)).items()) == list((same | written).items())


def test_a_level_has_a_colour_on_a_terminal() -> None:
    line = Console(colors=True).format(log.makeRecord(log.name, logging.ERROR, "", 0, "failed", (), None))
    assert "\033[31merror    \033[0m" in line and "\033[1mfailed" in line
