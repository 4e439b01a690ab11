"""Connections below HTTP: how they are listened for and how bytes are written to them."""

from __future__ import annotations

import asyncio
import socket
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

BACKLOG = 2048
JOINED = 16 * 1024  # bytes; longer pieces are written as they are, as joining them would copy them
# TCP's probes of a silent peer: one that vanished without a word is noticed after two minutes.
PROBE_AFTER_S, PROBE_EVERY_S, PROBES = 60, 15, 4


def listen(host: str, port: int) -> socket.socket:
    """A listening socket whose options each accepted connection inherits. Raises OSError."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.create_server((host, port), family=family, backlog=BACKLOG)
    # asyncio does this only for sockets of a stated protocol. Without it an answer in two writes waits 40 ms for the
    # client's delayed acknowledgement of the first.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, PROBE_AFTER_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, PROBE_EVERY_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, PROBES)
    return listener


class JoinedWrites(asyncio.Transport):
    """A transport whose small writes of one turn of the event loop leave together: an answer's head and body."""

    def __init__(self, transport: asyncio.Transport) -> None:
        super().__init__()
        self._transport = transport
        self._pending: list[bytes] = []
        self._size = 0  # of these
        self._loop = asyncio.get_running_loop()

    def write(self, data: Any) -> None:
        if not data:
            return
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
        self._pending.clear()
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
    """uvicorn's connection, which writes an answer's head and body apart; here they leave in one packet."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(JoinedWrites(transport))
