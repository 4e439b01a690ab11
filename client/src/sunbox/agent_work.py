"""Renders and batches for agents: whoever asks the same again goes on with the same work."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import uuid
from typing import Any

from sunbox import files
from sunbox.async_batch import AsyncBatch
from sunbox.async_job import AsyncJob, Status
from sunbox.errors import NotFound, SunboxError
from sunbox.transport import Transport

LONGEST_S = 50.0  # of one call: many hosts give up after a minute
KINDS = {"renders": AsyncJob, "batches": AsyncBatch}

_ending = set[asyncio.Task[None]]()  # what is cancelled; a loop alone does not keep a task alive


async def work(transport: Transport, kind: str, body: dict[str, Any]) -> Status:
    """The status of `renders` or `batches` at the end, or so far after LONGEST_S. An equal body is the same work, for
    a day, unless that was cancelled, failed or is gone. Cancelled, it cancels the work. Raises SunboxError."""
    begun = asyncio.ensure_future(_begun(transport, kind, body))
    try:
        id = (await asyncio.shield(begun)).id
        return dict(await transport.json("GET", f"/v1/{kind}/{id}?wait={LONGEST_S:g}"))
    except asyncio.CancelledError:
        # Not awaited here: the protocol's library cancels again whatever a cancelled call awaits.
        task = asyncio.ensure_future(_cancelled(begun))
        _ending.add(task)
        task.add_done_callback(_ending.discard)
        raise


async def _begun(transport: Transport, kind: str, body: dict[str, Any]) -> AsyncJob | AsyncBatch:
    digest = hashlib.sha256(files.text(body).encode()).hexdigest()
    found = await _started(transport, kind, body, f"mcp-{digest}")
    try:
        if (await found.status())["state"] not in ("cancelled", "failed"):
            return found
    except NotFound:  # it made room for others
        pass
    return await _started(transport, kind, body, f"mcp-{uuid.uuid4().hex}")


async def _started(transport: Transport, kind: str, body: dict[str, Any], key: str) -> AsyncJob | AsyncBatch:
    answer = await transport.json("POST", f"/v1/{kind}", body, {"idempotency-key": key})
    return KINDS[kind](transport, answer["id"])


async def _cancelled(begun: asyncio.Future[AsyncJob | AsyncBatch]) -> None:
    with contextlib.suppress(SunboxError):
        await (await begun).cancel()
