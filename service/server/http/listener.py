"""The socket that the server listens on."""

from __future__ import annotations

import socket

BACKLOG = 2048
# TCP keep-alive: a peer that vanished without closing is noticed after two minutes.
PROBE_AFTER_S, PROBE_EVERY_S, PROBES = 60, 15, 4


def listen(host: str, port: int) -> socket.socket:
    """A listening socket whose options each accepted connection inherits. Raises OSError."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.create_server((host, port), family=family, backlog=BACKLOG)
    # asyncio sets TCP_NODELAY only for sockets of a stated protocol. Without it an answer in two writes waits 40 ms
    # for the client's delayed acknowledgement of the first.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, PROBE_AFTER_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, PROBE_EVERY_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, PROBES)
    return listener
