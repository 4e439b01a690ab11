"""Bounds on the number of connections, and on how long one may stand still.

Slow clients are welcome, stalled ones are not: a request's head, an answer's bytes and the rest of a body must each
arrive in time. `guard.py` does the same for bodies that are being received.
"""

from __future__ import annotations

import fcntl
import ipaddress
import logging
import struct
import termios
import time
from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import h11

HEAD_S = 10.0  # within which a request's head must arrive, from its first byte or from the connection on
REST_S = 30.0  # within which the rest of a body must arrive after its answer
UNREAD_S = 30.0  # within which a client must take UNREAD_S * LEAST_RATE bytes of an answer
LEAST_RATE = 1024  # bytes a second
# The part of a WebSocket's unsent bytes that must be delivered within UNREAD_S. A frame is written as a whole, up to
# 256 MiB, and a client that took it at LEAST_RATE would keep that in memory for days.
LEAST_PART = 0.25
SETTLED_S = 1.0  # a connection whose head takes longer is closed where room for another one is needed
REFUSALS = 64  # connections beyond the limit that get an answer: the reason of the refusal, or the health check
NETWORK_BITS = 64  # of an IPv6 address that one customer of a provider has

Owed = Literal["head", "rest", "reading"]

log = logging.getLogger(__name__)


@dataclass
class _Wait:
    owed: Owed
    since: float
    enough: float  # bytes delivered in all with which it counts as going on


class Watch:
    """Ends connections without progress. `check` is to be called about once a second."""

    def __init__(self) -> None:
        self._waits: dict[Any, _Wait] = {}

    def check(self, connections: Collection[Any]) -> None:
        now = time.monotonic()
        waits = {each: wait for each in connections if (wait := self._wait(each, now)) is not None}
        for connection, wait in waits.items():
            if now - wait.since >= _limit_s(wait.owed):
                log.info("connection ended", {"owed": wait.owed, "waited_s": round(now - wait.since)})
                connection.transport.abort()
        self._waits = waits

    def _wait(self, connection: Any, now: float) -> _Wait | None:
        """The thing that a connection waits for, and since when."""
        owed = _owed(connection)
        if owed is None:
            return None
        delivered = _delivered(connection.transport) if owed == "reading" else 0
        before = self._waits.get(connection)
        if before is None or before.owed != owed or delivered >= before.enough:
            return _Wait(owed, now, delivered + _least(connection))
        return before


class Room:
    """Room for `most` connections, of which one address has at most half of what others leave, as in `Shares`.

    The addresses in the networks `proxies` have no share of their own: behind a proxy there is everybody, and `Guard`
    divides what is open among them.
    """

    def __init__(self, most: int, proxies: Collection[str] = ()) -> None:
        self._most = most
        self._proxies = [ipaddress.ip_network(each) for each in proxies]
        self._is_proxy = lru_cache(4096)(self._within_proxies)

    def enter(self, connection: Any, connections: Collection[Any]) -> bool:
        """True if a new connection, already in `connections`, may stay. Where room is needed an idle one is closed.

        False: refuse it. Where too many refused ones are open, the first of them is closed.
        """
        if len(connections) <= self._most // 2:
            return True
        refused = [each for each in connections if getattr(each, "refused", False)]
        welcome = [each for each in connections if not getattr(each, "refused", False)]
        ours = [] if self._is_proxy(_address(connection)) else _beside(connection, welcome)
        share = max(1, (self._most - len(welcome) + len(ours)) // 2)
        if len(ours) <= share and len(welcome) <= self._most:
            return True
        crowd = ours if len(ours) > share else welcome
        open_ones = (each for each in crowd if each is not connection and not each.transport.is_closing())
        resting = min(open_ones, key=_rest_order, default=None)
        if resting is not None and _rest_order(resting) < BUSY:
            resting.shutdown()
            return True
        refused = [each for each in refused if not each.transport.is_closing()]
        if len(refused) >= REFUSALS:
            min(refused, key=lambda each: each.began).transport.abort()
        return False

    def _within_proxies(self, address: str) -> bool:
        try:
            parsed = ipaddress.ip_address(address.partition("%")[0])
        except ValueError:
            return False
        return any(parsed in network for network in self._proxies)


BUSY = (2, 0.0)


def _rest_order(connection: Any) -> tuple[int, float]:
    """A key that sorts connections that make room: those idle between requests first, the longest idle first."""
    idle = getattr(connection, "timeout_keep_alive_task", None)
    if idle is not None:
        return 0, idle.when()
    if getattr(connection, "cycle", True) is None and time.monotonic() - connection.began >= SETTLED_S:
        return 1, connection.began
    return BUSY


def _owed(connection: Any) -> Owed | None:
    """The thing that uvicorn's connection waits for from its client; None: for nothing, or for the next request."""
    if connection.transport.get_write_buffer_size():
        return "reading"
    if not _is_http(connection):  # a WebSocket has pings
        return None
    cycle, theirs = connection.cycle, connection.conn.their_state
    if cycle is None or (cycle.response_complete and theirs is h11.IDLE and connection.conn.trailing_data[0]):
        return "head"
    return "rest" if cycle.response_complete and theirs is h11.SEND_BODY else None


def _least(connection: Any) -> float:
    """Bytes that must be delivered within UNREAD_S from now on."""
    part = 0.0 if _is_http(connection) else LEAST_PART * connection.transport.get_write_buffer_size()
    return max(LEAST_RATE * UNREAD_S, part)


def _is_http(connection: Any) -> bool:
    """True if a connection of uvicorn's is HTTP and not a WebSocket."""
    return hasattr(connection, "cycle")


def _limit_s(owed: Owed) -> float:
    return {"head": HEAD_S, "rest": REST_S, "reading": UNREAD_S}[owed]


def _delivered(transport: Any) -> int:
    """Bytes that the other side has acknowledged; the kernel buffers megabytes before that."""
    sent = transport.written - transport.get_write_buffer_size()
    try:
        queued = fcntl.ioctl(transport.get_extra_info("socket").fileno(), termios.TIOCOUTQ, b"\0" * 4)
    except OSError:  # it was closed just now
        return int(sent)
    return int(sent) - int(struct.unpack("i", queued)[0])


def _beside(connection: Any, connections: Collection[Any]) -> list[Any]:
    """The connections that come from the same network as this one."""
    network = network_of(_address(connection))
    return [each for each in connections if network_of(_address(each)) == network]


def _address(connection: Any) -> str:
    return connection.client[0] if connection.client else ""


@lru_cache(4096)
def network_of(address: str) -> str:
    """The network of an address: all the addresses that one customer of a provider can use."""
    try:
        parsed = ipaddress.IPv6Address(address.partition("%")[0])
    except ValueError:  # of IPv4, or what a proxy says in place of an address
        return address
    if parsed.ipv4_mapped is not None:
        return str(parsed.ipv4_mapped)
    return str(ipaddress.IPv6Network((parsed, NETWORK_BITS), strict=False))
