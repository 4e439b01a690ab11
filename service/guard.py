"""What stands between the network and the routes: how much a body may hold, which hosts and origins may ask.

Plain ASGI. Refusals are the errors of `problems.py`, answered by `refuse`; a stream is accepted, then closed.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Awaitable, Callable, Iterable
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import Forbidden, ServiceError, TooLarge, UnsupportedMedia

SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}
LOOPBACK_NAMES = {"127.0.0.1", "localhost", "::1"}
CROSS_ORIGIN = 4403  # close code of the stream
REASON_CHARACTERS = 120  # a close frame holds 123 bytes of it
DEFAULT_PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}
# Scripts, styles and connections from this server only; pictures also from memory (blob:), where frames are made.
CONTENT_POLICY = (
    "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)

Refuse = Callable[[ServiceError], ASGIApp]


class Guard:
    def __init__(self, app: ASGIApp, *, max_body: int, allowed_origins: Iterable[str], refuse: Refuse) -> None:
        self._app = app
        self._max_body = max_body
        self._origins = {_origin(origin) for origin in allowed_origins}
        self._hosts = LOOPBACK_NAMES | {host for _, host, _ in self._origins}
        self._refuse = refuse

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        headers = Headers(scope=scope)
        try:
            self._check_host(scope, headers)
            if scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS:
                self._check_origin(headers)
            if scope["type"] == "http":
                self._check_body(headers)
                receive = self._counted(receive)
        except ServiceError as error:
            if scope["type"] == "websocket":
                return await _close(scope, receive, send, CROSS_ORIGIN, str(error))
            return await self._refuse(error)(scope, receive, _secured(send, close=True))
        await self._app(scope, receive, _secured(send) if scope["type"] == "http" else send)

    def _check_host(self, scope: Scope, headers: Headers) -> None:
        """On a loopback address only its own names: a foreign one that resolves here is an attack (DNS rebinding)."""
        host = _host(headers.get("host", ""))
        if _is_loopback(scope) and host not in self._hosts:
            raise Forbidden(
                f"Host {host!r} is not 127.0.0.1 or localhost, and SUNBOX_ALLOWED_ORIGINS does not name it"
            )

    def _check_origin(self, headers: Headers) -> None:
        """No Origin: not a browser. Behind a proxy the scheme is unknown, so the host and port decide."""
        origin = headers.get("origin")
        if origin is None or _origin(origin) in self._origins:
            return
        scheme, host, port = _origin(origin)
        if not host or _authority(headers.get("host", ""), scheme) != (host, port):
            raise Forbidden(f"Origin {origin!r} may not do this: SUNBOX_ALLOWED_ORIGINS does not name it")

    def _check_body(self, headers: Headers) -> None:
        length = headers.get("content-length", "")
        if length.isdigit() and int(length) > self._max_body:
            raise self._too_large()
        if headers.get("content-encoding", "identity").strip().lower() != "identity":
            raise UnsupportedMedia("Compressed bodies are not taken: send it without Content-Encoding")

    def _counted(self, receive: Receive) -> Receive:
        """Raises TooLarge where a body of unannounced length passes the limit."""
        received = 0

        async def counting() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > self._max_body:
                raise self._too_large()
            return message

        return counting

    def _too_large(self) -> TooLarge:
        return TooLarge(f"The body is larger than {self._max_body} bytes (SUNBOX_MAX_BODY)")


def _secured(send: Send, close: bool = False) -> Callable[[Message], Awaitable[None]]:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers["x-content-type-options"] = "nosniff"
            headers["referrer-policy"] = "no-referrer"
            headers.setdefault("content-security-policy", CONTENT_POLICY)
            headers.setdefault("cache-control", "no-cache")
            if close:  # the body was not read, so the connection can't be used again
                headers["connection"] = "close"
        await send(message)

    return sending


async def _close(scope: Scope, receive: Receive, send: Send, code: int, reason: str) -> None:
    """Accepts, so that a browser tells its page the code, and closes."""
    await receive()
    offered = scope.get("subprotocols", [])  # a browser fails the handshake when none of its offers is taken
    await send({"type": "websocket.accept", "subprotocol": offered[0] if offered else None})
    await send({"type": "websocket.close", "code": code, "reason": reason[:REASON_CHARACTERS]})


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
