"""Answers whose JSON is made in a thread: a list of hundreds of things takes longer than the event loop has, which
serves everybody."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from starlette.responses import JSONResponse, Response

from service.system.executors import answering


async def made(make: Callable[[], Any], status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """The answer that holds the value of `make`, which a thread calls: it reads nothing that the loop changes."""
    return await answering(lambda: JSONResponse(make(), status, headers))
