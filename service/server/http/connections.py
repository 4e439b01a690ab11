"""Connections below HTTP: how they are accepted, how many are allowed, how bytes are written to them."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import time
from collections.abc import Collection
from contextlib import suppress
from typing import Any

from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.server.http.connection_limits import Room

JOINED = 16 * 1024  # bytes; longer pieces are written as they are, as joining them would copy them
# Unsent bytes allowed besides the largest piece. Answers and frames wait for the bytes before them, but pongs do not:
# uvicorn answers every ping at once, even for a client that reads nothing.
MOST_BESIDE = 1 << 20
RESET = struct.pack("ii", 1, 0)  # SO_LINGER: close at once, with a reset

log = logging.getLogger(__name__)


class JoinedWrites(asyncio.Transport):
    """A transport whose small writes of one turn of the event loop leave together: an answer's head and body."""

    def __init__(self, transport: asyncio.Transport) -> None:
        super().__init__()
        self._transport = transport
        self._pending: list[bytes] = []
        self._size = 0  # bytes of these
        self.written = 0  # bytes since the connection began
        self._largest = 0  # bytes of one piece, of those since the buffer was empty
        self._aborted = False
        self._loop = asyncio.get_running_loop()

    def write(self, data: Any) -> None:
        if not data or self._aborted:
            return
        waiting = self.get_write_buffer_size()
        self._largest = max(len(data), self._largest if waiting else 0)
        if waiting + len(data) > self._largest + MOST_BESIDE:
            log.info("connection ended", {"unread": waiting})
            return self.abort()
        self.written += len(data)
        if self._size + len(data) > JOINED:
            self._flush()
            return self._transport.write(data)
        if not self._pending:
            self._loop.call_soon(self._flush)
        self._pending.append(data)
        self._size += len(data)

    def _flush(self) -> None:
        if self._pending:
            together = b"".join(self._pending)
            self._pending.clear()
            self._size = 0
            self._transport.write(together)

    def close(self) -> None:
        self._flush()
        self._transport.close()

    def abort(self) -> None:
        """Drop unsent bytes, also in the kernel, which would go on offering them for minutes."""
        self._aborted = True
        self._pending.clear()
        self._size = 0
        with suppress(OSError):
            self.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
        self._transport.abort()

    def get_write_buffer_size(self) -> int:
        return self._size + self._transport.get_write_buffer_size()

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return self._transport.get_extra_info(name, default)

    def is_closing(self) -> bool:
        return self._transport.is_closing()

    def is_reading(self) -> bool:
        return self._transport.is_reading()

    def pause_reading(self) -> None:
        self._transport.pause_reading()

    def resume_reading(self) -> None:
        self._transport.resume_reading()

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        self._transport.set_protocol(protocol)

    def get_protocol(self) -> asyncio.BaseProtocol:
        return self._transport.get_protocol()


class Connection(H11Protocol):
    """uvicorn's connection, bounded in number by `room`; head and body of an answer leave in one packet."""

    room: Room  # of all
    refuse: ASGIApp  # answers the connections for which there is no room

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        self.began = time.monotonic()
        self.refused = False
        super().connection_made(JoinedWrites(transport))
        if not self.room.enter(self, self.connections):
            self.refused, self.app = True, type(self).refuse

    def _should_upgrade(self) -> bool:
        return not self.refused and super()._should_upgrade()


def connection_class(most: int, refuse: ASGIApp, proxies: Collection[str] = ()) -> type[Connection]:
    """A protocol for uvicorn that takes `most` connections; `refuse` answers requests on others.

    The networks `proxies` have no share of their own.
    """
    return type("Connection", (Connection,), {"room": Room(most, proxies), "refuse": staticmethod(refuse)})
