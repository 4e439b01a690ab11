"""Stands between the network and the routes: checks keys, hosts and origins, and bounds bodies.

Plain ASGI. Refusals are the errors of `problems.py`, answered by `refuse`; a stream is accepted, then closed.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import time
from collections.abc import Awaitable, Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
from hashlib import sha256
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.config import Config
from service.problems import (
    Forbidden,
    ServiceError,
    TimedOut,
    TooLarge,
    TooManyRequests,
    Unauthorized,
    Unavailable,
    UnsupportedMedia,
)
from service.server.http.connection_limits import network_of
from service.system.logs import always
from service.system.shares import CALLER, Shares, key_label

SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}
LOOPBACK_NAMES = {"127.0.0.1", "localhost", "::1"}
CLOSE_CODES: dict[type[ServiceError], int] = {
    Unauthorized: 4401,
    Forbidden: 4403,
    TooManyRequests: 4429,
    Unavailable: 4429,
}  # of the stream
HEALTH = "/healthz"  # always answered: an orchestrator restarts a server whose health check fails
PROBES = (HEALTH, "/readyz")
OPEN_OF_A_KEY = 128  # open requests of one key, long-polls, event streams and streams included
REASON_CHARACTERS = 120  # a close frame has room for 123 bytes
DEFAULT_PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}
LEAST_RATE, WITHIN_S = 1024, 30.0  # bytes a second of a body, averaged over this many seconds of waiting for it
LINGER_S, SILENT_S = 30.0, 2.0  # how long the rest of a refused body is read: in all, and without a byte
# Scripts, styles and connections from this server only; pictures also from memory (blob:), where frames are decoded.
CONTENT_POLICY = (
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "x-frame-options": "SAMEORIGIN",
}
PREFLIGHT = {
    "access-control-allow-methods": "GET, HEAD, POST, PUT, DELETE",
    "access-control-allow-headers": "authorization, content-type, idempotency-key, if-match, if-none-match, "
    "x-request-id",
    "access-control-max-age": "600",
}
EXPOSED = "etag, link, location, retry-after, x-request-id"

Refuse = Callable[[ServiceError], ASGIApp]

PROTOCOL = "sunbox.key."  # a WebSocket subprotocol: browsers let a page send no header there


class Guard:
    def __init__(self, app: ASGIApp, *, config: Config, refuse: Refuse) -> None:
        self._app = app
        self._config = config
        self._keys = Keys(config.api_key)
        self._origins = {_origin(origin) for origin in config.allowed_origins}
        self._hosts = LOOPBACK_NAMES | set(config.allowed_hosts) | {host for _, host, _ in self._origins}
        self._refuse = refuse
        # A request counts until it ends, which may be after its client has gone. Those without a key, which everybody
        # can send, are counted apart from those with one.
        most, what = config.max_connections, "open requests"
        self._of_keys, self._of_addresses = Shares(most, what, OPEN_OF_A_KEY), Shares(most, what)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        headers = Headers(scope=scope)
        granted = self._grant(headers)
        with ExitStack() as stack:
            try:
                self._check_host(scope, headers)
                if scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS:
                    self._check_origin(headers)
                if scope["type"] == "http":
                    if granted and scope["method"] == "OPTIONS" and "access-control-request-method" in headers:
                        return await _answer_preflight(send, granted)
                    self._check_body(headers)
                scope["owner"] = self._owner(scope, headers)
                scope["caller"] = scope["owner"] or network_of((scope.get("client") or ("",))[0])
                CALLER.set(scope["caller"])
                if scope["owner"]:
                    always(key=key_label(scope["owner"]))
                if route_path(scope) != HEALTH:
                    shares = self._of_keys if scope["owner"] else self._of_addresses
                    stack.enter_context(shares.taken(scope["caller"]))
            except ServiceError as error:
                if scope["type"] == "websocket":
                    return await _close(scope, receive, send, CLOSE_CODES[type(error)], str(error))
                patient = _lingering(send, receive)
                return await self._refuse(error)(scope, receive, _secured(patient, granted, close=True))
            if scope["type"] == "websocket":
                return await self._app(scope, receive, send)
            body = _Body(self._config, receive)
            # HEAD is answered as GET is, and the server leaves the body out. Answers without an end see `bodiless`.
            asked = {**scope, "method": "GET", "bodiless": True} if scope["method"] == "HEAD" else scope
            await self._app(asked, body.receive, _secured(send, granted))

    def _owner(self, scope: Scope, headers: Headers) -> str:
        """The name of the key's owner; "" where no key is needed. Raises Unauthorized."""
        path = route_path(scope)
        if not self._keys.asked_for or not (path == "/v1" or path.startswith("/v1/")):
            return ""
        offered = scope.get("subprotocols", []) if scope["type"] == "websocket" else []
        return self._keys.owner(headers.get("authorization"), offered)

    def _check_host(self, scope: Scope, headers: Headers) -> None:
        """Refuse foreign host names that resolve to this server: an attack on browsers beside it (DNS rebinding).

        On an address that is not loopback every name is accepted unless SUNBOX_ALLOWED_HOSTS lists the right ones.
        """
        if "host" not in headers and scope.get("http_version") == "1.0" and route_path(scope) in PROBES:
            return  # a balancer's check, as HAProxy sends it; browsers always name the host
        host = _host(headers.get("host", ""))
        if (_is_loopback(scope) or self._config.allowed_hosts) and host not in self._hosts:
            raise Forbidden(f"Host {host!r} is not 127.0.0.1 or localhost, and SUNBOX_ALLOWED_HOSTS does not name it")

    def _check_origin(self, headers: Headers) -> None:
        """Refuse foreign origins. Programs send none. A proxy hides the scheme, so host and port decide."""
        origin = headers.get("origin")
        if origin is None or _origin(origin) in self._origins:
            return
        scheme, host, port = _origin(origin)
        if not host or _authority(headers.get("host", ""), scheme) != (host, port):
            raise Forbidden(f"Origin {origin!r} may not do this: SUNBOX_ALLOWED_ORIGINS does not name it")

    def _grant(self, headers: Headers) -> str | None:
        """The page's origin where it is one that may read answers, else None."""
        origin = headers.get("origin")
        return origin if origin is not None and _origin(origin) in self._origins else None

    def _check_body(self, headers: Headers) -> None:
        length = headers.get("content-length", "")
        if length.isdigit() and int(length) > self._config.max_body:
            raise _too_large(self._config)
        if headers.get("content-encoding", "identity").strip().lower() != "identity":
            raise UnsupportedMedia("Compressed bodies are not taken: send it without Content-Encoding")


class _Body:
    """Counts a body as it arrives: also one of unannounced length is bounded, and one that stalls is refused.

    The sum of all bodies is bounded where they are stored: JSON in memory, uploads on the disk.
    """

    def __init__(self, config: Config, receive: Receive) -> None:
        self._config = config
        self._receive = receive
        self._received = 0  # bytes
        self._recent, self._waited_s = 0, 0.0  # bytes, and the time that was waited for them
        self._ended = False

    async def receive(self) -> Message:
        """Raises TooLarge, TimedOut."""
        if self._ended:
            return await self._receive()  # waits for the connection's end, which may take long
        left_s = WITHIN_S - self._waited_s
        began = time.monotonic()
        try:
            # Not wait_for: Python 3.11's loses a cancellation that comes together with the message.
            async with asyncio.timeout(min(self._config.body_timeout, left_s)):
                message = await self._receive()
        except TimeoutError:
            self._ended = True
            if left_s < self._config.body_timeout:
                raise TimedOut(f"The body came too slowly: {LEAST_RATE} bytes a second are the least.") from None
            raise TimedOut("The body did not go on (SUNBOX_BODY_TIMEOUT).") from None
        more = len(message.get("body", b""))
        self._received += more
        if self._received > self._config.max_body:
            raise _too_large(self._config)
        self._ended = not message.get("more_body", False)
        self._waited_s += time.monotonic() - began
        self._recent += more
        if self._recent >= LEAST_RATE * WITHIN_S:
            self._recent, self._waited_s = 0, 0.0
        return message


def _too_large(config: Config) -> TooLarge:
    return TooLarge(f"The body is larger than {config.max_body} bytes (SUNBOX_MAX_BODY)")


def _secured(send: Send, granted: str | None, close: bool = False) -> Callable[[Message], Awaitable[None]]:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers[name] = value
            headers.setdefault("content-security-policy", CONTENT_POLICY)
            headers.setdefault("cache-control", "no-cache")
            if granted:
                headers["access-control-allow-origin"] = granted
                headers["access-control-expose-headers"] = EXPOSED
                headers.add_vary_header("Origin")
            if close:  # the body was not read, so the connection can't be used again
                headers["connection"] = "close"
        await send(message)

    return sending


def _lingering(send: Send, receive: Receive) -> Callable[[Message], Awaitable[None]]:
    """Answer at once, and read the rest of the body before the connection is closed: TCP resets a connection that is
    closed with unread bytes, and a client that still sends would lose the answer."""

    async def sending(message: Message) -> None:
        if message["type"] != "http.response.body" or message.get("more_body", False):
            return await send(message)
        await send({**message, "more_body": True})
        with suppress(TimeoutError):
            async with asyncio.timeout(LINGER_S):
                while True:
                    async with asyncio.timeout(SILENT_S):
                        heard = await receive()
                    if heard["type"] == "http.disconnect" or not heard.get("more_body", False):
                        break
        await send({"type": "http.response.body"})

    return sending


def turning_away(error: ServiceError, refuse: Refuse) -> ASGIApp:
    """An application that answers every request with this error, and closes its connection."""

    async def turn_away(scope: Scope, receive: Receive, send: Send) -> None:
        await refuse(error)(scope, receive, _secured(_lingering(send, receive), None, close=True))

    return turn_away


def open_for_health(app: ASGIApp, refusing: ASGIApp) -> ASGIApp:
    """An application that answers the health check by `app`, and everything else by `refusing`."""

    async def answering(scope: Scope, receive: Receive, send: Send) -> None:
        await (app if route_path(scope) == HEALTH else refusing)(scope, receive, send)

    return answering


async def _answer_preflight(send: Send, origin: str) -> None:
    headers = {"access-control-allow-origin": origin, "vary": "Origin", **PREFLIGHT}
    raw = [(name.encode(), value.encode()) for name, value in headers.items()]
    await send({"type": "http.response.start", "status": 204, "headers": raw})
    await send({"type": "http.response.body"})


async def _close(scope: Scope, receive: Receive, send: Send, code: int, reason: str) -> None:
    """Accept a stream, so that a browser tells its page the close code, and close it."""
    await receive()
    # A browser fails the handshake unless one of its protocols is chosen; a key must not be sent back.
    offered = [offer for offer in scope.get("subprotocols", []) if not offer.startswith(PROTOCOL)]
    await send({"type": "websocket.accept", "subprotocol": offered[0] if offered else None})
    await send({"type": "websocket.close", "code": code, "reason": reason[:REASON_CHARACTERS]})


def route_path(scope: Scope) -> str:
    """The path as the routes see it, relative to the one that the application is mounted at."""
    path: str = scope["path"]
    below = path.removeprefix(scope.get("root_path", ""))
    return below if below.startswith("/") or not below else path


def _is_loopback(scope: Scope) -> bool:
    try:
        return ipaddress.ip_address((scope.get("server") or ("",))[0]).is_loopback
    except ValueError:
        return False


def _authority(text: str, scheme: str) -> tuple[str, int | None]:
    try:
        parts = urlsplit(f"//{text}")
        return (parts.hostname or ""), parts.port or DEFAULT_PORTS.get(scheme)
    except ValueError:
        return "", None


def _host(text: str) -> str:
    return _authority(text, "http")[0]


def _origin(text: str) -> tuple[str, str, int | None]:
    """Scheme, host and port; `null` and nonsense have no host."""
    scheme, _, authority = text.strip().rstrip("/").partition("://")
    return (scheme.lower(), *_authority(authority, scheme.lower()))


class Keys:
    """The server's keys: finds a request's, and gives its owner a name that reveals nothing of the key."""

    def __init__(self, keys: Iterable[str]) -> None:
        self._keys = [key.encode() for key in keys]

    @property
    def asked_for(self) -> bool:
        return bool(self._keys)

    def owner(self, authorization: str | None, protocols: Sequence[str] = ()) -> str:
        """The owner of the key in the `Authorization` header or among the subprotocols. Raises Unauthorized."""
        scheme, _, bearer = (authorization or "").partition(" ")
        shown = [bearer.strip()] if scheme.lower() == "bearer" else []
        shown += [protocol.removeprefix(PROTOCOL) for protocol in protocols if protocol.startswith(PROTOCOL)]
        for key in shown:
            # Every comparison takes the same time, wherever the keys differ.
            matches = [hmac.compare_digest(key.encode(), known) for known in self._keys]
            if any(matches):
                return sha256(self._keys[matches.index(True)]).hexdigest()[:16]
        raise Unauthorized(
            "A key is needed: Authorization: Bearer KEY, or the WebSocket subprotocol sunbox.key.KEY."
            if not shown
            else "This key is not known here."
        )
