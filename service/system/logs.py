"""Logs: a line for eyes or a JSON object for machines, what belongs to a request under its id. They go to a stream,
in the server from a thread of their own, each traceback once in a while.

The text of a message says what happened. Its values are a dictionary, the only argument: `log.info("asset stored",
{"id": id, "bytes": size})`.
"""

from __future__ import annotations

import atexit
import copy
import json
import logging
import queue
import re
import sys
import threading
import time
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from logging.handlers import QueueHandler, QueueListener
from types import MappingProxyType, TracebackType
from typing import Any

from service.system.background import count_death

log = logging.getLogger(__name__)

ROOMS = ("service", "gpu")  # whose loggers are our own


def configure(form: str, level: str, queued: bool = False, secrets: Iterable[str] = ()) -> None:
    """Have all records of the standard library's logging written to stderr, as `form`: "console" or "json".

    `level` is the least that is written of our own; libraries have theirs from warnings on. With `queued` a thread of
    its own writes it, so that logging never waits. `secrets` are left out of every line.
    """
    output = Output()
    output.setFormatter(Json(secrets) if form == "json" else Console(secrets, sys.stderr.isatty()))
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
    threading.excepthook = _thread_died
    sys.unraisablehook = _finalizer_died


def always(**fields: str) -> None:
    """Add these fields to every line that the calling thread or task logs from now on."""
    context_fields.set({**context_fields.get(), **fields})


def level() -> int:
    """The level from which our own loggers write."""
    return logging.getLogger(ROOMS[0]).getEffectiveLevel()


def _thread_died(args: threading.ExceptHookArgs) -> None:
    count_death("thread")
    _uncaught(args.exc_type, args.exc_value, args.exc_traceback)


def _finalizer_died(args: sys.UnraisableHookArgs) -> None:
    count_death("finalizer")
    trace = None if args.exc_value is None else (args.exc_type, args.exc_value, args.exc_traceback)
    log.error("a finalizer died", {"of": repr(args.object)}, exc_info=trace)


def _uncaught(kind: type[BaseException], error: BaseException | None, trace: TracebackType | None) -> None:
    if error is not None and not isinstance(error, KeyboardInterrupt | SystemExit):
        log.critical("ended by an error", exc_info=(kind, error, trace))


REPEAT_S = 10.0  # the same traceback is written at most once in this time
MOST_REPEATED = 256  # tracebacks that are remembered; a caller can't make up more kinds than the code has places
MOST_QUEUED = 10_000  # records that wait while nobody reads stderr; more are dropped, and counted
LAST_LINES_S = 2.0  # for what is still to be written when the program ends

Place = tuple[str, ...]


@dataclass
class _Repeated:
    first: logging.LogRecord
    until: float  # the monotonic time up to which equal tracebacks are only counted
    more: int = 0


class Output(logging.StreamHandler):  # type: ignore[type-arg]
    """Writes to stderr. The same traceback is written once in REPEAT_S seconds, and then how often it came."""

    def __init__(self) -> None:
        super().__init__()
        self._repeated: dict[Place, _Repeated] = {}

    def emit(self, record: logging.LogRecord) -> None:
        self.tell_repeated()
        if record.exc_info and record.exc_info[0] is not None:
            place = _place(*record.exc_info)
            if (known := self._repeated.get(place)) is not None:
                known.more += 1
                return
            if len(self._repeated) < MOST_REPEATED:
                self._repeated[place] = _Repeated(_without_traceback(record), time.monotonic() + REPEAT_S)
        super().emit(record)

    def tell_repeated(self, now: float | None = None) -> None:
        """Writes how often tracebacks were left out, once their time is over at `now` (the present, unless given)."""
        if not self._repeated:
            return
        now = time.monotonic() if now is None else now
        for place, repeated in list(self._repeated.items()):
            if now >= repeated.until:
                del self._repeated[place]
                if repeated.more:
                    first = repeated.first
                    error, at, *_ = place
                    first.msg, first.args = f"and {repeated.more} more like it", {"error": error, "at": at}
                    super().emit(first)

    def close(self) -> None:
        self.tell_repeated(float("inf"))
        super().close()


class Queued(QueueHandler):
    """Takes records from any thread without waiting; `Written` writes them."""

    def __init__(self) -> None:
        self.records: queue.Queue[logging.LogRecord | None] = queue.Queue(MOST_QUEUED)
        super().__init__(self.records)
        self.dropped = 0

    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        """The record with its exception, to be rendered in the other thread, and the request that it belongs to."""
        record = copy.copy(record)
        record.context = context_fields.get()
        return record

    def enqueue(self, record: logging.LogRecord) -> None:
        try:
            self.records.put_nowait(record)
        except queue.Full:
            self.dropped += 1


class Written(QueueListener):
    """Writes what `queued` took, in a thread; what is left when the program ends, too."""

    def __init__(self, queued: Queued, output: Output) -> None:
        super().__init__(queued.queue, output)
        self._records = queued.records
        self._queued = queued
        self._output = output
        self.start()
        atexit.register(self.stop)

    def dequeue(self, block: bool) -> logging.LogRecord | None:  # type: ignore[override]
        """The next record, or None, which ends the thread."""
        while True:
            try:
                record: logging.LogRecord | None = self._records.get(timeout=1.0)
            except queue.Empty:
                self._output.tell_repeated()
                continue
            if record is None:  # the last
                self._output.tell_repeated(float("inf"))
            elif self._queued.dropped:
                dropped, self._queued.dropped = self._queued.dropped, 0
                self._output.handle(_lines_dropped(dropped))
            return record

    def stop(self) -> None:
        """Returns once everything is written, or at once where nobody reads stderr any more."""
        thread, self._thread = self._thread, None
        if thread is not None:  # else it was stopped before
            with suppress(queue.Full):
                self.enqueue_sentinel()
                thread.join(LAST_LINES_S)


def _place(kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> Place:
    """A key that is equal for errors that are raised by the same line of code, called in the same way; its kind and
    line come first."""
    lines: list[str] = []
    while trace is not None:
        lines.append(f"{trace.tb_frame.f_code.co_filename}:{trace.tb_lineno}")
        trace = trace.tb_next
    return (kind.__name__ if kind else "", lines[-1] if lines else "", *lines[:-1])


def _without_traceback(record: logging.LogRecord) -> logging.LogRecord:
    """A copy of an exception that keeps nothing alive to which its frames refer."""
    record = copy.copy(record)
    record.exc_info = record.exc_text = record.stack_info = None
    return record


def _lines_dropped(count: int) -> logging.LogRecord:
    return logging.makeLogRecord(
        {
            "name": __name__,
            "levelno": logging.WARNING,
            "levelname": "WARNING",
            "msg": "log lines were dropped",
            "args": {"count": count},
        }
    )


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
    """The event as one line."""
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
