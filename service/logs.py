"""Logs: a line for eyes or a JSON object for machines, each request under an id of its own."""

from __future__ import annotations

import logging
import re
import secrets
import time
from collections.abc import Callable, MutableMapping
from typing import Any

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import Internal, ServiceError

log = logging.getLogger(__name__)

FIELD = re.compile(r"\s*\b(\w+)=%[-+# 0-9.]*[a-z]")  # of a message as style.md has it: fields last, name=%s
GIVEN_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")  # of a proxy before us; another text is not taken into the logs
ID_BYTES = 9
ASKED_ALL_THE_TIME = ("/healthz", "/readyz", "/metrics")

Heard = Callable[[str, str, int, float], None]  # method, route, status, seconds


def configure(form: str, level: str) -> None:
    """Has everything that is logged through the standard library written to stderr."""
    import sys

    before: list[Any] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_log_level,
        structlog.stdlib.add_logger_name,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
        _fields,
    ]
    last: list[Any]
    if form == "json":
        last = [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]
    else:
        last = [structlog.dev.ConsoleRenderer(colors=sys.stderr.isatty())]
    handler = logging.StreamHandler()
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=before,
            pass_foreign_args=True,
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *last],
        )
    )
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)


def _fields(logger: Any, method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Takes `name=%s` out of a message's text: its values become fields."""
    arguments = event.pop("positional_args", None)
    message = event["_record"].msg
    if not isinstance(message, str) or not isinstance(arguments, tuple):
        return event
    found = list(FIELD.finditer(message))
    if not found or message.count("%") != len(arguments):
        return event
    # Fields stand last, so the arguments before theirs belong to the text.
    texts = len(arguments) - len(found)
    plain = FIELD.sub("", message)
    event["event"] = plain % arguments[:texts] if texts else plain
    event.update({match[1]: _plain(value) for match, value in zip(found, arguments[texts:], strict=True)})
    return event


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 4)
    return value if isinstance(value, bool | int | str) else str(value)


class Requests:
    """ASGI middleware: gives each request an id, logs and counts it, and answers what nobody had foreseen."""

    def __init__(self, app: ASGIApp, *, refuse: Callable[[ServiceError], ASGIApp], heard: Heard) -> None:
        self._app = app
        self._refuse = refuse
        self._heard = heard

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        given = Headers(scope=scope).get("x-request-id", "")
        id = given if GIVEN_ID.fullmatch(given) else secrets.token_urlsafe(ID_BYTES)
        began, status = time.perf_counter(), 0

        async def sending(message: Message) -> None:
            nonlocal status
            if message["type"] in ("http.response.start", "websocket.accept"):
                status = message.get("status", 101)
                message["headers"] = list(message.get("headers", ()))
                MutableHeaders(scope=message)["x-request-id"] = id
            await send(message)

        with structlog.contextvars.bound_contextvars(request=id):
            try:
                await self._app(scope, receive, sending)
            except Exception:
                log.exception("request failed path=%s", _path(scope))
                if scope["type"] == "http" and status == 0:
                    await self._refuse(Internal())(scope, receive, sending)
            finally:
                self._tell(scope, status, time.perf_counter() - began)

    def _tell(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope.get("method", "WEBSOCKET")
        self._heard(method, getattr(scope.get("route"), "path", ""), status, seconds)
        level = logging.DEBUG if scope["path"] in ASKED_ALL_THE_TIME else logging.INFO
        log.log(level, "answered method=%s path=%s status=%d ms=%.1f", method, _path(scope), status, 1e3 * seconds)


def _path(scope: Scope) -> str:
    """As it was sent, percent-encoded: nothing in it can end a line. The query may hold a session's id."""
    raw: bytes = scope.get("raw_path") or b""
    return raw.partition(b"?")[0].decode("ascii", "replace")[:500]
