"""Waiting for an event of asyncio, for a time."""

from __future__ import annotations

import asyncio
from contextlib import suppress


async def within(event: asyncio.Event, seconds: float | None) -> None:
    """Return when the event is set, or after that time.

    By asyncio.timeout: until Python 3.12 asyncio.wait_for forgets to be cancelled where that comes together with what
    it waits for, and whoever cancelled it waits for ever.
    """
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await event.wait()
