"""Waiting for an event of asyncio, for a time."""

from __future__ import annotations

import asyncio
from contextlib import suppress


async def within(event: asyncio.Event, seconds: float) -> None:
    """Return when the event is set, or after that time."""
    with suppress(TimeoutError):
        await asyncio.wait_for(event.wait(), seconds)
