"""Fixtures of tests about renderers."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest

from gpu import Renderer
from service.config import cores
from service.renderers.local import keeper
from service.renderers.local.supervisor import Supervisor
from tests.serving import PATIENCE_S, Server, wait_until
from tests.supervisors import Rendering, renderer_options


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A renderer that ends is started again at once, and given up soon."""
    monkeypatch.setattr(keeper, "BETWEEN_TRIES_S", 0.0)
    monkeypatch.setattr(keeper, "HOPELESS_S", 0.05)


@pytest.fixture(scope="session")
def two(gpu: Renderer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with two renderers, which are ready. Both end with it."""
    if cores() < 2:
        pytest.skip("there is one core")
    server = Server(tmp_path_factory.mktemp("two"), SUNBOX_DEVICES="llvmpipe:2")
    wait_until(
        lambda: all(each["state"] == "ready" for each in server.http.get("/v1/info").json()["renderers"]), 0.05
    )
    renderers = server.renderers()
    assert len(renderers) == 2
    yield server
    assert server.stop() == 0 and not any(Path(f"/proc/{pid}").exists() for pid in renderers)


@pytest.fixture(scope="session")
def rendering(gpu: Renderer) -> Iterator[Rendering]:
    """Runs a test with a supervisor whose renderer's process all tests of the session share.

    Each may kill that, as another one is begun then. What a test has opened is dropped after it.
    """
    supervisors = dict[float, Supervisor]()

    async def run(test: Callable[[Supervisor], Awaitable[None]], checkpoint_s: float) -> None:
        if checkpoint_s not in supervisors:
            options = renderer_options(checkpoint_s=checkpoint_s, memory=1 << 30)
            supervisors[checkpoint_s] = Supervisor(options)
            supervisors[checkpoint_s].start()
        supervisor = supervisors[checkpoint_s]
        await supervisor.ready(PATIENCE_S)
        try:
            async with asyncio.timeout(PATIENCE_S):
                await test(supervisor)
        finally:
            for task in list(supervisor.tasks):
                supervisor.drop(task)

    with asyncio.Runner() as runner:
        yield lambda test, checkpoint_s=2.0: runner.run(run(test, checkpoint_s))  # type: ignore[misc]
        for supervisor in supervisors.values():
            runner.run(supervisor.close())
