"""Work that nobody awaits: its errors are logged and counted, and a callback learns of them. And waiting for an
event, for a time.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections import Counter
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager, suppress
from typing import Any

Died = Callable[[Exception], None]

_deaths: Counter[str] = Counter()
_lock = threading.Lock()
log = logging.getLogger(__name__)


def count_death(what: str) -> None:
    """For any thread."""
    with _lock:
        _deaths[what] += 1


def deaths() -> Counter[str]:
    """How much work has died in this process, by what it was."""
    with _lock:
        return _deaths.copy()


class Background:
    """Tasks on the event loop that nobody awaits, and that end with their owner."""

    def __init__(self) -> None:
        self._tasks = set[asyncio.Task[None]]()  # asyncio has weak references alone

    def start(self, what: str, work: Coroutine[Any, Any, None], died: Died | None = None) -> asyncio.Task[None]:
        """A task that runs `work`.

        An error that ends it is reported as the death of `what`, and `died` is called with it, to end what the task
        worked for in a way that its client sees. The task itself raises nothing; it may be awaited."""
        task = asyncio.get_running_loop().create_task(_reported(what, work, died))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        task.add_done_callback(lambda _: work.close())  # it may have been cancelled before it began
        return task

    async def ended(self) -> None:
        """Return when the tasks that there are now have ended."""
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def close(self) -> None:
        """Cancel all tasks, and return when they have ended."""
        for task in list(self._tasks):
            task.cancel()
        await self.ended()


@contextmanager
def reported(what: str, died: Died | None = None) -> Iterator[None]:
    """A context for a callback, or for one turn of an endless loop.

    An error in it is the death of `what`; it is reported, passed to `died`, and goes no further."""
    try:
        yield
    except Exception as error:
        count_death(what)
        log.exception("work in the background died", {"what": what})
        if died is not None:
            try:
                died(error)
            except Exception:
                log.exception("could not end what it worked for", {"what": what})


async def _reported(what: str, work: Coroutine[Any, Any, None], died: Died | None) -> None:
    with reported(what, died):
        await work


def report_callbacks(loop: asyncio.AbstractEventLoop) -> None:
    """Report errors in callbacks of this loop that nothing else encloses, and in tasks nobody asks for a result."""

    def died(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        count_death("callback")
        log.error(
            "a callback of the event loop died",
            {"reason": context.get("message")},
            exc_info=(type(error), error, error.__traceback__) if error is not None else None,
        )

    loop.set_exception_handler(died)


async def within(event: asyncio.Event, seconds: float | None) -> None:
    """Return when the event is set, or after that time.

    By asyncio.timeout: until Python 3.12 asyncio.wait_for forgets to be cancelled where that comes together with what
    it waits for, and the cancelling task waits for ever.
    """
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await event.wait()
