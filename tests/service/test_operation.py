"""What an operator sees: metrics, logs, readiness, and a refusal to start where that is better than to serve."""

from __future__ import annotations

import asyncio
import hashlib
import json
import logging
import os
import re
import subprocess
import sys
import threading
from collections import Counter
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn

from service.config import GIB, MAX_PIXELS, MIB, Config
from service.problems import Unavailable
from service.renderers.pool.pool import RendererPool
from service.server import app, launch
from service.server.routes.metrics import scrape
from service.server.state import STARTING_S, AppState
from service.system import logs
from tests.calls import metrics
from tests.serving import ENDLESS, KEYS, SCENE, SMALL, Server, client, wait_until

ROOT = Path(__file__).parents[2]


def test_metrics_tell_what_happens(server: Server) -> None:
    before = metrics(server)
    server.http.post("/v1/render", json={"scene": SCENE, "settings": SMALL})
    with client(server) as stream:
        stream.start()
        stream.finished()
        assert metrics(server)['sunbox_streams{state="connected"}'] >= 1
    for name in (
        'sunbox_requests_total{method="POST",route="/v1/render",status="200"}',
        "sunbox_frames_total",
        "sunbox_frame_bytes_total",
        'sunbox_samples_total{renderer="0"}',
        "sunbox_first_frame_seconds_count",
        'sunbox_gpu_seconds_total{client="stream",renderer="0"}',
        'sunbox_gpu_seconds_total{client="render",renderer="0"}',
        'sunbox_setup_seconds_count{renderer="0"}',
        "sunbox_request_seconds_count",
    ):
        wait_until(lambda name=name: metrics(server)[name] > before.get(name, 0))
    now = metrics(server)
    assert now["sunbox_renderer_up"] == 1 and now['sunbox_renderer_resident_bytes{renderer="0"}'] > 1e7
    assert now["process_resident_memory_bytes"] > 1e7 and now["sunbox_data_quota_bytes"] > 1e9
    assert now['sunbox_samples_total{renderer="0"}'] - before['sunbox_samples_total{renderer="0"}'] >= 2 * 8 * 32 * 24
    names = {re.split(r"[{ ]", name)[0] for name in now}
    assert {"sunbox_kernel_cache_hits_total", "sunbox_renders", "sunbox_gpu_bytes", "sunbox_info"} <= names


def test_it_can_be_seen_which_key_uses_the_machine(tmp_path: Path) -> None:
    """By the first letters of its hash, never by the key. It needs a server with keys, whose log is read."""
    anna, bert = (hashlib.sha256(key).hexdigest()[:8] for key in (b"anna-key", b"bert-key"))
    server = Server(tmp_path, SUNBOX_API_KEY="anna-key,bert-key", SUNBOX_LOG_FORMAT="json")
    try:
        server.wait()
        body = {"scene": SCENE, "settings": SMALL}
        with httpx.Client(base_url=server.url, timeout=300) as http:
            answer = http.post("/v1/render", json=body, headers={"authorization": "Bearer anna-key"})
            assert answer.status_code == 200
            assert http.get("/v1/renders", headers={"authorization": "Bearer bert-key"}).status_code == 200
            assert http.get("/v1/renders", headers={"authorization": "Bearer nobody"}).status_code == 401
            name = f'sunbox_key_gpu_seconds_total{{key="{anna}",renderer="0"}}'
            wait_until(lambda: name in http.get("/metrics").text)
            text = http.get("/metrics").text
        assert f'sunbox_key_requests_total{{key="{anna}"}} 1.0' in text
        assert f'sunbox_key_requests_total{{key="{bert}"}} 1.0' in text
        assert (
            text.count("sunbox_key_requests_total{") == 2
            and f'sunbox_key_gpu_seconds_total{{key="{bert}"' not in text
        )
    finally:
        server.stop()
    log = server.log.read_text()
    lines = [json.loads(line) for line in log.splitlines() if '"answered"' in line]
    assert {line.get("key") for line in lines if line["path"].startswith("/v1/")} == {anna, bert, None}
    assert not any(key in log + text for key in ("anna-key", "bert-key"))


@pytest.mark.parametrize("place", ["", "no node has joined"])
def test_info_does_not_wait_for_a_node_that_may_never_join(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    waited = list[float]()

    class Renderers(RendererPool):
        waiting = place

        async def ready(self, timeout_s: float) -> dict[str, Any]:
            waited.append(timeout_s)
            raise Unavailable(place)

    monkeypatch.setattr("service.server.app.RendererPool", lambda *_: Renderers([]))
    state: AppState = app.create_app(Config(data_dir=tmp_path)).state.sunbox
    assert asyncio.run(state.info())["renderer"] is None
    assert waited == [0.0 if place else STARTING_S]


def test_closing_the_connection_cancels(server: Server) -> None:
    endless = {"scene": SCENE, "settings": ENDLESS}
    running = 'sunbox_renders{state="running"}'
    wait_until(lambda: metrics(server)[running] == 0)  # what other tests have begun
    with pytest.raises(httpx.ReadTimeout):
        httpx.post(f"{server.url}/v1/render", json=endless, timeout=1)
    wait_until(lambda: metrics(server)[running] == 0)


def test_addresses_do_not_become_labels(server: Server) -> None:
    for i in range(3):
        server.http.get(f"/v1/renders/nobody{i}")
        server.http.get(f"/nothing{i}")
    assert not [name for name in metrics(server) if "nobody" in name or "nothing" in name]


def test_requests_have_ids(server: Server) -> None:
    given = server.http.get("/v1/info", headers={"x-request-id": "from-a-proxy.1"})
    assert given.headers["x-request-id"] == "from-a-proxy.1"
    ours = [server.http.get("/nothing", headers={"x-request-id": "no\tgood"}).headers["x-request-id"] for _ in "ab"]
    assert ours[0] != ours[1] and "good" not in ours[0]


def test_logs_for_machines(strict: Server) -> None:
    """Every line is an object, the renderer's process included; a refusal bears its request's id and no secret."""
    key = {"authorization": f"Bearer {KEYS[0]}", "x-request-id": "mine"}
    assert strict.http.post("/v1/render", json={"scene": SCENE, "settings": SMALL}, headers=key).status_code == 200
    strict.http.get(f"/v1/info?key={KEYS[0]}%0a")
    wait_until(lambda: '"request": "mine"' in strict.log.read_text())
    text = strict.log.read_text()
    lines = [json.loads(line) for line in text[: text.rindex("\n")].splitlines()]
    (answered,) = (line for line in lines if line.get("request") == "mine" and line["event"] == "answered")
    assert (answered["method"], answered["path"], answered["status"]) == ("POST", "/v1/render", 200)
    assert answered["ms"] > 0 and answered["level"] == "info" and answered["timestamp"].endswith("Z")
    created = [line for line in lines if line["logger"] == "gpu.context"]  # by the renderer's process
    assert [line["renderer"] for line in created] == ["0"] and created[0]["driver"]
    assert KEYS[0] not in text


def test_a_software_renderer_is_refused(server: Server, tmp_path: Path) -> None:
    if metrics(server)["sunbox_renderer_software"] != 1:
        pytest.skip("there is a GPU")
    environment = {**os.environ, "SUNBOX_REQUIRE_GPU": "1", "SUNBOX_DATA_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "service.cli", "serve", "--port", "0"]
    answer = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert answer.returncode == 1 and answer.stdout == ""
    assert "SUNBOX_REQUIRE_GPU" in answer.stderr and "llvmpipe" in answer.stderr and "Traceback" not in answer.stderr


def test_a_device_that_is_not_there(server: Server, tmp_path: Path) -> None:
    """The server lives, and is not ready."""
    lost = Server(tmp_path, SUNBOX_DEVICE="99")
    try:
        assert lost.http.get("/healthz").status_code == 200
        wait_until(lambda: "99" in lost.http.get("/readyz").json()["detail"])
        assert lost.http.get("/readyz").status_code == 503 and "retry-after" in lost.http.get("/readyz").headers
        assert lost.http.get("/v1/info").json()["renderer"] is None
    finally:
        assert lost.stop() == 0


def test_serving_everybody_without_a_key_is_warned_of(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(uvicorn.Server, "run", lambda self, sockets: sockets[0].close())
    for host, key, warned in (("0.0.0.0", [], True), ("127.0.0.1", [], False), ("0.0.0.0", ["secret"], False)):
        caplog.clear()
        launch.run(Config(host=host, port=0, api_key=key, data_dir=tmp_path))
        assert ("SUNBOX_API_KEY" in caplog.text) is warned


def table() -> str:
    """The table of variables in docs/operation.md, in Markdown."""
    lines = ["| variable | default | |", "|---|---|---|"]
    for name, field in Config.model_fields.items():
        lines.append(f"| `SUNBOX_{name.upper()}` | {_told(field.get_default())} | {field.description} |")
    return "\n".join(lines) + "\n"


def _told(default: Any) -> str:
    if default is None or not isinstance(default, int | float | str):
        return ""
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, int):
        for unit, size in (("GiB", GIB), ("MiB", MIB)):
            if default >= size and default % size == 0 and default != MAX_PIXELS and default != 2**26:
                return f"{default // size} {unit}"
    return f"{default:g}" if isinstance(default, float) else str(default)


def test_the_readme_has_the_configuration() -> None:
    """docs/operation.md has the whole table, README.md those of its rows that come first. It is written by:
    python -c 'from tests.service.test_operation import table; print(table())'."""
    assert table() in (ROOT / "docs" / "operation.md").read_text()
    shown = [line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("| `SUNBOX_")]
    assert len(shown) >= 5 and set(shown) <= set(table().splitlines())


def test_logging_is_set_up_once(untouched_logging: None, capfd: pytest.CaptureFixture[str]) -> None:
    logs.configure("json", "warning")
    logging.getLogger("a.b").warning("what happened", {"count": 3})
    logging.getLogger("a.b").info("not told")
    told = json.loads(capfd.readouterr().err)
    assert (told["event"], told["count"], told["logger"]) == ("what happened", 3, "a.b")


def test_what_changes_on_the_event_loop_is_read_there(tmp_path: Path) -> None:
    """A thread that reads it meets dictionaries that change their size meanwhile."""
    readers = set[int]()

    class Watched(Counter[tuple[str, str, str]]):
        def items(self) -> Any:
            readers.add(threading.get_ident())
            return super().items()

    async def scenario() -> bytes:
        state: AppState = app.create_app(Config(data_dir=tmp_path)).state.sunbox
        state.traffic.count = Watched({("GET", "/", "200"): 3})
        return await scrape(state, state.traffic)

    assert b'sunbox_requests_total{method="GET",route="/",status="200"} 3.0' in asyncio.run(scenario())
    assert readers == {threading.get_ident()}
