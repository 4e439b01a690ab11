"""Logs: a line for eyes or a JSON object for machines, what belongs to a request under its id."""

from __future__ import annotations

import logging
import re
import sys
import threading
import warnings
from collections.abc import Iterable, MutableMapping
from datetime import UTC, datetime
from types import TracebackType
from typing import Any

import structlog

from service.logs.output import Output, Queued, Redacting, Written

log = logging.getLogger(__name__)

CONVERSION = re.compile(r"(?P<field>\s*\b(?P<name>\w+)=)?%(?P<how>%|[-+# 0-9]*(?:\.(?P<digits>\d+))?[a-z])")
ROOMS = ("service", "gpu")  # whose loggers are our own


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
