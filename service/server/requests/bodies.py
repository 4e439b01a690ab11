"""JSON bodies: received, counted, and parsed where no other request waits for that."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

from starlette.requests import Request

from service.config import Config
from service.document.text import most_bytes
from service.problems import TooLarge, UnsupportedMedia
from service.server.requests.parser_pool import ParserPool
from service.server.requests.parsers import PARSERS, Kind
from service.system.executors import parsing, waiting_for_parsers
from service.system.memory import Limit, MemoryBudget, Reservation

# The last three are the defaults of programs that set no content type (curl, urllib, fetch).
TAKEN = {"application/json", "text/json", "application/x-www-form-urlencoded", "application/octet-stream", ""}
# Bytes that are parsed in some ms: sending them to another process would take as long. The text of such a body is not
# counted: one for each connection takes less than two of the largest. Its values are, but never refused.
SMALL = 64 * 1024
AT_ONCE = 4  # as many of the largest bodies may wait, two of one caller


class Bodies:
    """The JSON bodies of all requests."""

    def __init__(self, config: Config, memory: MemoryBudget | None = None) -> None:
        self._config = config
        self._memory = memory or MemoryBudget(config.memory)
        self._pool = ParserPool(config)
        self._limit = Limit("bodies", AT_ONCE * config.max_json, "JSON bodies (SUNBOX_MAX_JSON)")

    @asynccontextmanager
    async def read(
        self,
        request: Request,
        kind: Kind,
        caller: str = "",
        ready: Callable[[bytearray], Awaitable[None]] | None = None,
    ) -> AsyncIterator[Any]:
        """A context with the result of PARSERS[kind] for a request's body, in which the bytes that its values take at
        most count: it lasts until they are packed, written or stored. The text counts until it is parsed.

        `ready` is awaited with the whole text, before it is parsed. Raises what that and the parser raise, and
        UnsupportedMedia, TooLarge, TooManyRequests, Unavailable.
        """
        values = Reservation()
        try:
            async with self._taken(request) as body:
                if ready is not None:
                    await ready(body)
                if len(body) <= SMALL:
                    self._memory.count("bodies", values, most_bytes(body))
                parsed = await self.parsed(kind, body, caller, partial(self._memory.hold, "bodies", values))
                del body
            yield parsed
        finally:
            self._memory.release(values)

    async def parsed(
        self, kind: Kind, body: bytearray, caller: str = "", hold: Callable[[int], None] | None = None
    ) -> Any:
        """The result of PARSERS[kind] for a body. Raises what that raises, and TooLarge.

        Turns go round the callers. Before a large one is parsed, `hold` is called with the bytes of `memory_for`;
        without it they count already.
        """
        if len(body) <= SMALL:
            return await parsing(partial(PARSERS[kind], self._config, body), caller)
        return await waiting_for_parsers(partial(self._pool.parse, kind, body, hold), caller)

    @staticmethod
    def memory_for(body: bytearray) -> int:
        """The bytes of memory that parsing a body takes at most; 0 for small ones, which never wait for memory."""
        return most_bytes(body) if len(body) > SMALL else 0

    def close(self) -> None:
        self._pool.close()

    @asynccontextmanager
    async def _taken(self, request: Request) -> AsyncIterator[bytearray]:
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
