"""Waits for a render, a question or an event that end when the client goes away."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from contextlib import AbstractContextManager
from typing import Any

from starlette.requests import Request

from service.server.http.downloads import disconnected
from service.server.state import app_state, caller_of


async def until(request: Request, ending: Awaitable[Any], seconds: float | None = None) -> bool:
    """Wait for `ending`, at most `seconds`; False if the client went away before. If `ending` has not ended then, it
    is cancelled; no task stays behind. Raises what `ending` raises."""
    ended = asyncio.ensure_future(ending)
    gone = asyncio.ensure_future(disconnected(request.receive))
    try:
        await asyncio.wait({ended, gone}, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        if ended.done():
            ended.result()
            return True
        return not gone.done()
    finally:
        ended.cancel()
        gone.cancel()
        await asyncio.gather(ended, gone, return_exceptions=True)


def place(request: Request) -> AbstractContextManager[None]:
    """A place among the caller's long-polls and event streams. Raises TooManyRequests, Unavailable."""
    return app_state(request).waits.taken(caller_of(request))
