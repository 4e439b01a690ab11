"""An event loop in a thread of its own, on which calls that wait run what is written to be awaited.

So there is one implementation, and it works where a loop runs already (a notebook's). Ctrl-C while a call waits
cancels what it runs; what that does about it (a render is cancelled on the server) is waited for.
"""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import threading
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


class Background:
    """One loop; started with the first call."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._lock = threading.Lock()

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        """Returns or raises as `work` does."""
        future = asyncio.run_coroutine_threadsafe(work, self._started())
        try:
            return future.result()
        except KeyboardInterrupt:
            future.cancel()
            with contextlib.suppress(BaseException):
                asyncio.run_coroutine_threadsafe(_others_ended(), self._started()).result()
            raise

    def post(self, work: Coroutine[Any, Any, Any]) -> None:
        """Begins `work`, and does not wait for it."""
        asyncio.run_coroutine_threadsafe(work, self._started())

    def close(self) -> None:
        """Ends the loop; it may be started again."""
        with self._lock:
            loop, self._loop = self._loop, None
        if loop is not None:
            loop.call_soon_threadsafe(loop.stop)

    def _started(self) -> asyncio.AbstractEventLoop:
        with self._lock:
            if self._loop is None:
                self._loop = asyncio.new_event_loop()
                threading.Thread(target=self._loop.run_forever, name="sunbox", daemon=True).start()
                atexit.register(self.close)
            return self._loop


async def _others_ended() -> None:
    """When all that was cancelled has ended."""
    others = asyncio.all_tasks() - {asyncio.current_task()}
    cancelled = [task for task in others if task.cancelling()]
    if cancelled:
        await asyncio.wait(cancelled, timeout=10.0)
