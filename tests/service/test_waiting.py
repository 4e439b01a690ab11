"""Whoever is cancelled while he waits for something ends, also where that has just come."""

from __future__ import annotations

import ast
import asyncio
from pathlib import Path

import pytest

from service.system.background import within

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("turns", range(6))
def test_a_wait_that_is_cancelled_as_it_ends(turns: int) -> None:
    """Some turns of the event loop after what it waits for: until Python 3.12 asyncio.wait_for goes on then."""

    async def serve(event: asyncio.Event) -> None:
        while True:
            await within(event, 60)
            event.clear()

    async def run() -> None:
        event = asyncio.Event()
        task = asyncio.ensure_future(serve(event))
        await asyncio.sleep(0.001)
        event.set()
        for _ in range(turns):
            await asyncio.sleep(0)
        task.cancel()
        done, _ = await asyncio.wait({task}, timeout=5)
        assert done == {task} and task.cancelled()

    asyncio.run(run())


def test_a_wait_ends_with_its_time() -> None:
    asyncio.run(asyncio.wait_for(within(asyncio.Event(), 0.01), 5))


def test_nothing_waits_in_the_way_that_forgets_to_be_cancelled() -> None:
    calls = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for folder in ("service", "gpu", "client")
        for path in (ROOT / folder).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Attribute) and node.attr == "wait_for"
        if isinstance(node.value, ast.Name) and node.value.id == "asyncio"
    ]
    assert calls == [], "use asyncio.timeout, or service.system.background"
