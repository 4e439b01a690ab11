"""An engine with a renderer's process of its own, for as long as one test takes."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from service.rendering.engine import Engine
from service.rendering.process import Options


def with_engine(test: Callable[[Engine], Awaitable[None]], **options: Any) -> None:
    async def run() -> None:
        engine = Engine(Options(**options))
        engine.start()
        try:
            await engine.ready(30)
            await test(engine)
        finally:
            await engine.close()

    asyncio.run(run())
