"""A log record as a line for people or as a JSON object.

The text of a message says what happened. Its values are a dictionary, the only argument: `log.info("asset stored",
{"id": id, "bytes": size})`.
"""

from __future__ import annotations

import json
import logging
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from types import MappingProxyType
from typing import Any

HIDDEN = "***"
LEAST_SECRET = 8  # characters; shorter keys are looked for only where keys stand: they may be words of a line
# A session's id in an address, and a key as RFC 6750 and the stream's subprotocol carry it.
SECRETS = r"(?<=session=)[^&\s\"'\\]+|(?<=beside=)[^&\s\"'\\]+|(?<=sunbox\.key\.)[^\s,\"'\\]+|(?<=[Bb]earer )[!-~]+"
QUOTED = re.compile(r"[\s=\"']")  # a value of a line in which one of these stands is written with quotes
DIM, BOLD, GREEN, YELLOW, RED, PLAIN = (f"\033[{code}m" for code in (2, 1, 32, 33, 31, 0))
COLORS = {"debug": GREEN, "info": GREEN, "warning": YELLOW}  # of levels on a terminal; the others are red

# Fields of every record that is logged in this context: the id of the request that it belongs to.
context_fields: ContextVar[Mapping[str, Any]] = ContextVar("context_fields", default=MappingProxyType({}))


@contextmanager
def bound(**fields: Any) -> Iterator[None]:
    """A context whose log records have these fields, too."""
    token = context_fields.set({**context_fields.get(), **fields})
    try:
        yield
    finally:
        context_fields.reset(token)


class Redacting(logging.Formatter, ABC):
    """Removes secrets from what `written` returns, wherever they stand, tracebacks included."""

    def __init__(self, secrets: Iterable[str] = ()) -> None:
        super().__init__()
        known = sorted((re.escape(each) for each in secrets if len(each) >= LEAST_SECRET), key=len, reverse=True)
        self._secrets = re.compile("|".join([*known, SECRETS]))

    def format(self, record: logging.LogRecord) -> str:
        fields = {"event": _event(record), "level": record.levelname.lower(), "logger": record.name}
        fields |= {"timestamp": _time(record)} | _values(record)
        trace = self.formatException(record.exc_info) if record.exc_info and record.exc_info[0] else ""
        return self._secrets.sub(HIDDEN, self.written(fields, trace))

    @abstractmethod
    def written(self, fields: dict[str, Any], trace: str) -> str:
        """The line of a record."""


class Json(Redacting):
    """One object a record."""

    def written(self, fields: dict[str, Any], trace: str) -> str:
        return json.dumps(fields | ({"exception": trace} if trace else {}))


class Console(Redacting):
    """One line a record, and its traceback below it."""

    def __init__(self, secrets: Iterable[str] = (), colors: bool = False) -> None:
        super().__init__(secrets)
        self._colors = colors

    def written(self, fields: dict[str, Any], trace: str) -> str:
        event, level, logger, when = (fields.pop(name) for name in ("event", "level", "logger", "timestamp"))
        parts = [
            self._styled(DIM, when),
            f"[{self._styled(COLORS.get(level, RED), f'{level:9}')}]",
            self._styled(BOLD, f"{event:30}"),
            f"[{logger}]",
            *(f"{name}={_quoted(value)}" for name, value in fields.items()),
        ]
        return " ".join(parts) + (f"\n{trace}" if trace else "")

    def _styled(self, style: str, text: str) -> str:
        return f"{style}{text}{PLAIN}" if self._colors else text


def _event(record: logging.LogRecord) -> str:
    """What happened, as one line."""
    return "; ".join(line.strip() for line in record.getMessage().splitlines() if line.strip())


def _values(record: logging.LogRecord) -> dict[str, Any]:
    """The record's values, and those of the context in which it was logged, as JSON has them."""
    given = record.args if isinstance(record.args, Mapping) else {}
    context = getattr(record, "context", None) or context_fields.get()
    return {str(name): _plain(value) for name, value in (*given.items(), *context.items())}


def _plain(value: Any) -> bool | int | float | str:
    if isinstance(value, float):
        return round(value, 4)
    return value if isinstance(value, bool | int | str) else str(value)


def _quoted(value: Any) -> str:
    return value if isinstance(value, str) and not QUOTED.search(value) else repr(value)


def _time(record: logging.LogRecord) -> str:
    """When the record was logged, which is before it is written."""
    when = datetime.fromtimestamp(record.created, UTC)
    return when.isoformat(timespec="microseconds").replace("+00:00", "Z")
