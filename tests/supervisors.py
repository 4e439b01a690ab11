"""A supervisor with a renderer's process of its own, for as long as one test takes."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from service.renderers.local.process import Options
from service.renderers.local.supervisor import Supervisor
from tests.serving import PATIENCE_S


def with_supervisor(test: Callable[[Supervisor], Awaitable[None]], checkpoint_s: float = 2.0, **options: Any) -> None:
    async def run() -> None:
        supervisor = Supervisor(Options(checkpoint_s=checkpoint_s, **options))
        supervisor.start()
        try:
            await supervisor.ready(PATIENCE_S)
            await test(supervisor)
        finally:
            await supervisor.close()

    asyncio.run(run())
