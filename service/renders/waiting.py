"""Waiting for events of asyncio."""

from __future__ import annotations

import asyncio
from contextlib import suppress


async def first_of(*events: asyncio.Event) -> None:
    """Return when one of the events is set."""
    waits = [asyncio.create_task(event.wait()) for event in events]
    try:
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for wait in waits:
            wait.cancel()


async def within(event: asyncio.Event, seconds: float) -> None:
    """Return when the event is set, or after that time."""
    with suppress(TimeoutError):
        await asyncio.wait_for(event.wait(), seconds)
