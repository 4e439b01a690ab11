"""The progress of renders as server-sent events (the HTML standard, section 9.2).

Starlette's StreamingResponse sends them: sse-starlette would save two lines, and add a dependency that watches for
the server's end in its own way.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from service.server.renders.queue import RenderQueue
from service.server.renders.render import Render
from service.server.routes.waiting import place
from service.server.state import app_state, bodiless, caller_of

MIME = "text/event-stream"
BETWEEN_S = 0.1  # between two events of one render; docs/operation.md promises ten a second at most
AT_ONCE = 20  # events of several renders within that time: 200 KB/s, 1 % of a core
KEEP_ALIVE_S = 15.0  # after this time without an event a comment keeps proxies from closing the connection
KEEP_ALIVE = b": still there\n\n"
# A client that reads slowly gets fewer and the newest events: the next one is written when the network has taken the
# one before. connection_limits ends connections that take nothing.
HEADERS = {"cache-control": "no-store", "x-accel-buffering": "no"}


class _Counted(StreamingResponse):
    """Occupies one of the caller's places while it is being sent."""

    def __init__(self, request: Request, events: AsyncIterator[bytes]) -> None:
        self._place = place(request)
        super().__init__(events, media_type=MIME, headers=HEADERS)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        with self._place:
            await super().__call__(scope, receive, send)


def of_one(request: Request, job: Render) -> Response:
    """`progress` whenever the status has changed, and once `done`, with which the answer ends."""
    return _answer(request, _events(job))


def of_all(request: Request, renders: RenderQueue, owner: str, label: str | None) -> Response:
    """`progress` and `done` of an owner's renders with that label, or of all; the answer ends with the server."""
    return _answer(request, _all_events(renders, owner, label))


def _answer(request: Request, events: AsyncIterator[bytes]) -> Response:
    """The answer that streams these events; without them for a HEAD request. Raises TooManyRequests, Unavailable."""
    if bodiless(request):
        return Response(media_type=MIME, headers=HEADERS)
    app_state(request).waits.check(caller_of(request))
    return _Counted(request, events)


async def _events(job: Render) -> AsyncIterator[bytes]:
    said, clock = None, asyncio.get_running_loop().time
    while not job.finished.is_set():
        changed = asyncio.ensure_future(job.changed())
        try:
            began, status = clock(), job.status()
            if status != said:
                said = status
                yield _event("progress", status)
            while not changed.done():
                await asyncio.wait({changed}, timeout=KEEP_ALIVE_S)
                if not changed.done():
                    yield KEEP_ALIVE
        finally:
            changed.cancel()
        if not changed.result():
            return  # the server ends; the render goes on at its next start
        await asyncio.sleep(max(0.0, began + BETWEEN_S - clock()))
    yield _event("done", job.status())


async def _all_events(renders: RenderQueue, owner: str, label: str | None) -> AsyncIterator[bytes]:
    said: dict[str, int] = {}  # hashes of the last events of those under way, by id
    clock = asyncio.get_running_loop().time
    spoke_at = clock()
    with renders.follower(owner) as follower:
        while not follower.closed:
            events = []
            changed = await follower.next(AT_ONCE, KEEP_ALIVE_S)
            began = clock()
            for job in (job for job in changed if label in (None, job.order.label)):
                ended, before = job.finished.is_set(), said.pop(job.id, None)
                event = _event("done" if ended else "progress", job.status())
                if not ended:
                    said[job.id] = hash(event)
                if hash(event) != before:
                    events.append(event)
            if events or began - spoke_at >= KEEP_ALIVE_S:
                spoke_at = began
                yield b"".join(events) or KEEP_ALIVE
            await asyncio.sleep(max(0.0, began + BETWEEN_S - clock()))


def _event(name: str, status: dict[str, Any]) -> bytes:
    return f"event: {name}\ndata: {json.dumps(status, separators=(',', ':'))}\n\n".encode()
