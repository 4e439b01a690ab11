"""A render's progress as server-sent events (the HTML standard, section 9.2).

Starlette's StreamingResponse carries them: sse-starlette would add a dependency and a way of its own to watch for the
server's end, and what is left to do here is to write two lines.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator
from typing import Any

from starlette.responses import Response, StreamingResponse

from service.rendering.jobs.job import Job

MIME = "text/event-stream"
BETWEEN_S = 0.1  # two events: of the contract, ten a second at most
KEEP_ALIVE_S = 15.0  # without an event, after which a comment keeps proxies from closing the connection
# A client that reads slowly gets fewer events, and the newest: the next one is written when the network has taken the
# one before. One that takes nothing is ended by the watch on all connections.
HEADERS = {"cache-control": "no-store", "x-accel-buffering": "no"}


def answer(job: Job, bodiless: bool = False) -> Response:
    """`progress` whenever the status has changed, and once `done`, with which the answer ends; or at once, where it
    is `bodiless`."""
    if bodiless:
        return Response(media_type=MIME, headers=HEADERS)
    return StreamingResponse(_events(job), media_type=MIME, headers=HEADERS)


async def _events(job: Job) -> AsyncIterator[bytes]:
    said = None
    while not job.finished.is_set():
        changed = asyncio.ensure_future(job.changed())
        try:
            began, status = time.monotonic(), job.status()
            if status != said:
                said = status
                yield _event("progress", status)
            while not changed.done():
                await asyncio.wait({changed}, timeout=KEEP_ALIVE_S)
                if not changed.done():
                    yield b": still there\n\n"
        finally:
            changed.cancel()
        if not changed.result():
            return  # the server ends; the render goes on at its next start
        await asyncio.sleep(max(0.0, began + BETWEEN_S - time.monotonic()))
    yield _event("done", job.status())


def _event(name: str, status: dict[str, Any]) -> bytes:
    return f"event: {name}\ndata: {json.dumps(status, separators=(',', ':'))}\n\n".encode()
