"""JSON bodies: received, counted, and parsed where no other request waits for that."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

from starlette.requests import Request

from service.config import Config
from service.problems import TooLarge, UnsupportedMedia
from service.requests.parser_pool import ParserPool
from service.requests.parsers import PARSERS, Kind
from service.scene.text import most_bytes
from service.system.executors import parsing, waiting_for_parsers
from service.system.memory import Limit, MemoryBudget

# The last three are the defaults of programs that set no content type (curl, urllib, fetch).
TAKEN = {"application/json", "text/json", "application/x-www-form-urlencoded", "application/octet-stream", ""}
# Bytes that are parsed in some ms: sending them to another process would take as long. Nor are so few counted: one
# such body for each connection takes less than two of the largest bodies.
SMALL = 64 * 1024
AT_ONCE = 4  # as many of the largest bodies may wait, two of one caller


class Bodies:
    """The JSON bodies of all requests."""

    def __init__(self, config: Config, memory: MemoryBudget | None = None) -> None:
        self._config = config
        self._memory = memory or MemoryBudget(config.memory)
        self._pool = ParserPool(config, self._memory)
        self._limit = Limit("bodies", AT_ONCE * config.max_json, "JSON bodies (SUNBOX_MAX_JSON)")

    async def parsed(self, kind: Kind, body: bytearray, caller: str = "", counted: bool = False) -> Any:
        """The result of PARSERS[kind] for a body. Raises what that raises, and TooLarge.

        Turns go round the callers. `counted`: the bytes of `memory_for` count already.
        """
        if len(body) <= SMALL:
            return await parsing(partial(PARSERS[kind], self._config, body), caller)
        return await waiting_for_parsers(partial(self._pool.parse, kind, body, counted), caller)

    @staticmethod
    def memory_for(body: bytearray) -> int:
        """The bytes of memory that parsing a body takes at most; 0 for small ones, which are not counted."""
        return most_bytes(body) if len(body) > SMALL else 0

    def close(self) -> None:
        self._pool.close()

    @asynccontextmanager
    async def taken(self, request: Request) -> AsyncIterator[bytearray]:
        """The body, whose bytes count within the context, as those of the caller of the work at hand.

        Raises UnsupportedMedia, TooLarge, TooManyRequests, Unavailable.
        """
        type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if type not in TAKEN and not type.endswith("+json"):
            raise UnsupportedMedia(f"{type[:100]!r} is not taken here: send application/json")
        body, received = bytearray(), 0
        with self._memory.growing(self._limit) as hold:
            async for chunk in request.stream():
                received += len(chunk)
                if received > self._config.max_json:  # received to its end, so that its sender reads the answer
                    body = bytearray()
                else:
                    body += chunk
                if received > SMALL:
                    hold(len(body))
            if received > self._config.max_json:
                raise TooLarge(f"A JSON body holds at most {self._config.max_json} bytes (SUNBOX_MAX_JSON)")
            yield body
