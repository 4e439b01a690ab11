"""Each request gets an id, under which it is logged and counted."""

from __future__ import annotations

import logging
import re
import time
from collections import Counter
from collections.abc import Callable
from secrets import token_hex

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import Internal, ServiceError
from service.renderers.statistics import Distribution
from service.system.logs import bound
from service.system.shares import key_label

GIVEN_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")  # an id that a proxy or client sent; any other text is not logged
ID_BYTES = 9
ASKED_ALL_THE_TIME = ("/healthz", "/readyz", "/metrics")

Heard = Callable[[str, str, int, float, str], None]  # method, route, status, seconds, the key's label

log = logging.getLogger(__name__)


class Requests:
    """ASGI middleware: gives each request an id, logs and counts it, and answers unexpected exceptions."""

    def __init__(self, app: ASGIApp, *, refuse: Callable[[ServiceError], ASGIApp], heard: Heard) -> None:
        self._app = app
        self._refuse = refuse
        self._heard = heard

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        given = Headers(scope=scope).get("x-request-id", "")
        id = given if GIVEN_ID.fullmatch(given) else token_hex(ID_BYTES)
        began, status = time.perf_counter(), 0

        async def sending(message: Message) -> None:
            nonlocal status
            if message["type"] in ("http.response.start", "websocket.accept"):
                status = message.get("status", 101)
                message["headers"] = list(message.get("headers", ()))
                MutableHeaders(scope=message)["x-request-id"] = id
            await send(message)

        with bound(request=id):
            try:
                await self._app(scope, receive, sending)
            except Exception:
                log.exception("request failed", {"path": _path(scope)})
                if scope["type"] == "http" and status == 0:
                    await self._refuse(Internal())(scope, receive, sending)
            finally:
                self._tell(scope, status, time.perf_counter() - began)

    def _tell(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope.get("method", "WEBSOCKET")
        route = getattr(scope.get("route"), "path", "")
        self._heard(method, route, status, seconds, key_label(scope.get("owner", "")))
        level = logging.DEBUG if scope["path"] in ASKED_ALL_THE_TIME else logging.INFO
        log.log(
            level,
            "answered",
            {"method": method, "path": _path(scope), "status": status, "ms": round(1e3 * seconds, 1)},
        )


def _path(scope: Scope) -> str:
    """The path, percent-encoded, so that it cannot end a line; without the query, which may hold a session's id."""
    raw: bytes = scope.get("raw_path") or b""
    return raw.partition(b"?")[0].decode("ascii", "replace")[:500]


METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "WEBSOCKET")


class Traffic:
    """Requests since the server began."""

    def __init__(self) -> None:
        self.count: Counter[tuple[str, str, str]] = Counter()
        self.by_key: Counter[str] = Counter()  # by the key's label; those of unknown keys are not counted
        self.seconds = Distribution()

    def heard(self, method: str, route: str, status: int, seconds: float, key: str = "") -> None:
        """Count a request. `route` is the address's pattern, "" for none: the number of addresses is unbounded. `key`
        is the label of its key, "" for none."""
        if key:
            self.by_key[key] += 1
        known = method if method in METHODS else "OTHER"
        self.count[known, route or "other", str(status)] += 1
        if known != "WEBSOCKET":
            self.seconds.add(seconds)
