"""Logs: a line for eyes or a JSON object for machines, each request under an id of its own."""

from __future__ import annotations

import logging
import re
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, MutableMapping
from datetime import UTC, datetime
from secrets import token_hex
from types import TracebackType
from typing import Any

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.log_output import Output, Queued, Redacting, Written
from service.problems import Internal, ServiceError

log = logging.getLogger(__name__)

CONVERSION = re.compile(r"(?P<field>\s*\b(?P<name>\w+)=)?%(?P<how>%|[-+# 0-9]*(?:\.(?P<digits>\d+))?[a-z])")
GIVEN_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")  # of a proxy before us; another text is not taken into the logs
ID_BYTES = 9
ROOMS = ("service", "gpu")  # whose loggers are our own
ASKED_ALL_THE_TIME = ("/healthz", "/readyz", "/metrics")

Heard = Callable[[str, str, int, float], None]  # method, route, status, seconds


def configure(form: str, level: str, queued: bool = False, secrets: Iterable[str] = ()) -> None:
    """Have all records of the standard library's logging written to stderr, as `form`: "console" or "json".

    `level` is the least that is written of our own; libraries have theirs from warnings on. With `queued` a thread of
    its own writes it, so that whoever logs never waits. `secrets` are left out of every line.
    """
    before: list[Any] = [
        structlog.stdlib.add_log_level,
        structlog.stdlib.add_logger_name,
        _time,
        _fields,
        _context,
    ]
    last: list[Any]
    if form == "json":
        last = [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]
    else:
        # No locals in tracebacks: they may hold keys, and rendering them took seconds.
        plain = structlog.dev.plain_traceback
        colors = sys.stderr.isatty()
        last = [structlog.dev.ConsoleRenderer(colors=colors, exception_formatter=plain, sort_keys=False)]
    output = Output()
    output.setFormatter(
        Redacting(
            secrets,
            foreign_pre_chain=before,
            pass_foreign_args=True,
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *last],
        )
    )
    handler: logging.Handler = output
    if queued:
        handler = Queued()
        Written(handler, output)
    least = logging.getLevelNamesMapping()[level.upper()]
    logging.basicConfig(level=max(least, logging.WARNING), handlers=[handler], force=True)
    for room in ROOMS:
        logging.getLogger(room).setLevel(least)
    logging.captureWarnings(True)
    # FastAPI silences this one while it reads a route's parameters, by a means that another thread can undo.
    warnings.filterwarnings("ignore", "The 'alias' attribute with value")
    sys.excepthook = _uncaught
    threading.excepthook = lambda told: _uncaught(told.exc_type, told.exc_value, told.exc_traceback)


def always(**fields: str) -> None:
    """Add these fields to every line that the calling thread logs from now on."""
    structlog.contextvars.bind_contextvars(**fields)


def level() -> int:
    """The level from which our own loggers write."""
    return logging.getLogger(ROOMS[0]).getEffectiveLevel()


def _uncaught(kind: type[BaseException], error: BaseException | None, trace: TracebackType | None) -> None:
    if error is not None and not isinstance(error, KeyboardInterrupt | SystemExit):
        log.critical("ended by an error", exc_info=(kind, error, trace))


def _fields(logger: Any, method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Turn each `name=%s` of a message into a field; the rest of the text is one line."""
    arguments = event.pop("positional_args", None)
    message = event["_record"].msg
    found = list(CONVERSION.finditer(message)) if isinstance(message, str) else []
    taken = [each for each in found if each["how"] != "%"]
    if isinstance(arguments, tuple) and len(taken) == len(arguments) and any(each["field"] for each in taken):
        values = dict(zip((each.start() for each in taken), arguments, strict=True))
        text = CONVERSION.sub(lambda match: _text(match, values.get(match.start())), message)
        event["event"] = text.strip()
        event.update({each["name"]: _plain(values[each.start()], each["digits"]) for each in taken if each["field"]})
    event["event"] = "; ".join(line.strip() for line in str(event["event"]).splitlines() if line.strip())
    return event


def _text(match: re.Match[str], value: Any) -> str:
    """The text in place of a conversion."""
    if match["how"] == "%":
        return f"{match['field'] or ''}%"
    return "" if match["field"] else f"%{match['how']}" % (value,)


def _plain(value: Any, digits: str | None) -> Any:
    if isinstance(value, float):
        return round(value, 4 if digits is None else int(digits)) if digits != "0" else round(value)
    return value if isinstance(value, bool | int | str) else str(value)


def _time(logger: Any, method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Add the time when the record was logged, not when it is written."""
    when = datetime.fromtimestamp(event["_record"].created, UTC)
    event["timestamp"] = when.isoformat(timespec="microseconds").replace("+00:00", "Z")
    return event


def _context(logger: Any, method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Add the id of the request that the record belongs to."""
    record = event["_record"]
    event.update(getattr(record, "context", None) or structlog.contextvars.get_contextvars())
    return event


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
    """The path, percent-encoded, so that it cannot end a line; without the query, which may hold a session's id."""
    raw: bytes = scope.get("raw_path") or b""
    return raw.partition(b"?")[0].decode("ascii", "replace")[:500]
