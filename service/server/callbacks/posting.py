"""One attempt: the host's addresses are looked up and checked, and a checked one is connected to.

The connection goes to the address itself and not to the name, which could have another address by then (DNS
rebinding); the certificate is checked against the name. Proxies of the environment are not asked and redirects are
not followed, as nobody checked where they lead.
"""

from __future__ import annotations

import asyncio
import ipaddress
import socket
import ssl
from collections.abc import Iterable, Sequence
from functools import partial
from urllib.parse import urlsplit

import httpcore2

from service.callback_hosts import Address, CallbackHosts, Origin
from service.system.executors import resolving

TRY_S = 15.0  # for one attempt, from the name to the first line of the answer

AGENT = "Sunbox"


class NotSent(Exception):
    """No answer came; the text says why."""


def tls() -> ssl.SSLContext:
    """For all attempts: reading the certificates takes tens of milliseconds."""
    return httpcore2.default_ssl_context()


async def post(url: str, body: bytes, headers: dict[str, str], hosts: CallbackHosts, context: ssl.SSLContext) -> int:
    """The status of the answer, whose body is not read. Raises NotSent."""
    try:
        origin = hosts.origin(url)
    except ValueError as error:
        raise NotSent(str(error)) from None
    try:
        async with asyncio.timeout(TRY_S):
            addresses = await checked_addresses(origin, hosts)
            return await _posted(origin, url, body, headers, addresses, context)
    except TimeoutError:
        raise NotSent(f"no answer within {TRY_S:g} s") from None
    except (OSError, ssl.SSLError, httpcore2.NetworkError, httpcore2.ProtocolError) as error:
        raise NotSent(f"no connection: {error}" if str(error) else "the connection ended") from None


async def checked_addresses(origin: Origin, hosts: CallbackHosts) -> list[Address]:
    """Those of its addresses that callbacks may go to. Raises NotSent where there is none."""
    try:
        look_up = partial(socket.getaddrinfo, origin.host, origin.port, type=socket.SOCK_STREAM)
        found = [str(each[4][0]) for each in await resolving(look_up)]
    except OSError as error:
        raise NotSent(f"the host's address is not known: {error.strerror or error}") from None
    addresses = [ipaddress.ip_address(text) for text in dict.fromkeys(found)]
    allowed = [address for address in addresses if hosts.allows(address)]
    if not allowed:
        raise NotSent("the host's address is not public, and in none of the networks of SUNBOX_CALLBACK_HOSTS")
    return allowed


async def _posted(
    origin: Origin,
    url: str,
    body: bytes,
    headers: dict[str, str],
    addresses: Sequence[Address],
    context: ssl.SSLContext,
) -> int:
    parts = urlsplit(url)
    target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    where = httpcore2.URL(scheme=origin.scheme, host=origin.host, port=origin.port, target=target)
    fields = {
        "host": str(origin),
        "user-agent": AGENT,
        "content-type": "application/json",
        "content-length": str(len(body)),
        "connection": "close",
        **headers,
    }
    async with (
        httpcore2.AsyncConnectionPool(context, max_connections=1, network_backend=_Pinned(addresses)) as pool,
        pool.stream(
            "POST", where, headers=[(k.encode(), v.encode()) for k, v in fields.items()], content=body
        ) as got,
    ):
        return got.status


class _Pinned(httpcore2.AsyncNetworkBackend):
    """Connects to these addresses, in their order, whatever the host is called."""

    def __init__(self, addresses: Sequence[Address]) -> None:
        self._addresses = addresses
        self._network = httpcore2.AnyIOBackend()

    async def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[httpcore2.SOCKET_OPTION] | None = None,
    ) -> httpcore2.AsyncNetworkStream:
        for address in self._addresses[:-1]:
            try:
                return await self._network.connect_tcp(str(address), port, timeout, local_address, socket_options)
            except httpcore2.NetworkError:
                continue
        return await self._network.connect_tcp(str(self._addresses[-1]), port, timeout, local_address, socket_options)
