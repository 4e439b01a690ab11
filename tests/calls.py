"""Calls of the REST interface, and what their answers are checked for."""

from __future__ import annotations

import asyncio
import io
from typing import Any

import httpx
import numpy as np

from service.server.state import AppState
from tests.serving import SCENE, SMALL, Server


async def loaded(state: AppState) -> None:
    """Let an application answer that has not been started, and has no stored renders."""
    state.loading.start(asyncio.sleep(0))
    await state.loading.tasks.ended()


def start(http: httpx.Client, settings: Any = SMALL, scene: Any = SCENE) -> Any:
    answer = http.post("/v1/renders", json={"scene": scene, "settings": settings})
    assert answer.status_code == 202, answer.text
    return answer.json()


def status(http: httpx.Client, id: str, wait: float = 0) -> Any:
    return http.get(f"/v1/renders/{id}", params={"wait": wait}).json()


def pixels(http: httpx.Client, id: str, aov: str = "color") -> np.ndarray:
    answer = http.get(f"/v1/renders/{id}/image", params={"format": "npy", "aov": aov})
    return np.load(io.BytesIO(answer.content))


def is_problem(answer: httpx.Response, status: int, *pointers: str) -> bool:
    body = answer.json()
    assert answer.headers["content-type"] == "application/problem+json", answer.text
    assert answer.status_code == body["status"] == status and {"type", "title", "detail"} <= body.keys(), body
    assert [error["pointer"] for error in body.get("errors", [])] == list(pointers), body
    return True


def metrics(server: Server) -> dict[str, float]:
    """Values by name and labels, as they are written."""
    lines = [line for line in server.http.get("/metrics").text.splitlines() if not line.startswith("#")]
    return {name: float(value) for name, value in (line.rsplit(" ", 1) for line in lines)}
