"""What a server answers while it loads what is stored."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.config import Config
from service.server import app as application
from service.server.app import create_app
from service.server.state import AppState
from tests.calls import is_problem

ANSWERED = {
    "/healthz",
    "/readyz",
    "/metrics",
    "/v1/info",
    "/v1/schema",
    "/v1/presets/{kind}",
    "/v1/presets/{kind}/{name}",
}


def test_health_is_answered_before_anything_is_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every other route waits for that, whichever there are."""
    monkeypatch.setattr(application, "STARTING_S", 0.001)
    app = create_app(Config(data_dir=tmp_path))
    state: AppState = app.state.sunbox

    async def test() -> None:
        transport = httpx.ASGITransport(app, client=("127.0.0.1", 1))
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            assert (await client.get("/healthz")).status_code == 200
            assert is_problem(ready := await client.get("/readyz"), 503) and "loading" in ready.json()["detail"]
            assert (await client.get("/v1/schema")).status_code == 200
            paths: dict[str, Any] = app.openapi()["paths"]
            assert paths.keys() >= ANSWERED
            for path in paths.keys() - ANSWERED:
                for method in paths[path]:
                    answer = await client.request(method, path.replace("{", "").replace("}", ""))
                    assert answer.status_code in (503, 422), (method, path)
                    if answer.status_code == 503:
                        assert is_problem(answer, 503) and "loading" in answer.json()["detail"]
            state.loading.start(state.resume_renders())
            await state.loading.tasks.ended()
            assert (await client.get("/v1/renders")).json() == []

    asyncio.run(test())
