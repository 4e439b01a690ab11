"""What an earlier server left is taken up while the server answers already: health at once, what needs it later."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

from service.problems import Unavailable
from service.system.background import Background

RETRY_S = 2


class Loading:
    """For the event loop."""

    def __init__(self) -> None:
        self.failed = False  # the server is to end: it would answer that there is nothing
        self.tasks = Background()  # of the start, which end with the server
        self._done = asyncio.Event()

    def start(self, work: Coroutine[Any, Any, None]) -> None:
        async def load() -> None:
            await work
            self._done.set()

        self.tasks.start("loading of what is stored", load(), self._fail)

    def check(self) -> None:
        """Raise Unavailable before it is done."""
        if not self._done.is_set():
            raise Unavailable("The server is still loading its stored renders.", RETRY_S)

    async def wait(self, seconds: float) -> None:
        """Return when it is done. Raises Unavailable after that time."""
        if not self._done.is_set():
            try:
                async with asyncio.timeout(seconds):
                    await self._done.wait()
            except TimeoutError:
                self.check()

    def _fail(self, error: Exception) -> None:
        self.failed = True
