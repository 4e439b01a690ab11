"""Where log records go: to a stream, in the server from a thread of their own, each traceback once in a while."""

from __future__ import annotations

import atexit
import copy
import logging
import queue
import time
from contextlib import suppress
from dataclasses import dataclass
from logging.handlers import QueueHandler, QueueListener
from types import TracebackType

from service.system.logs.formatters import context_fields

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
    """What is equal for errors that are raised by the same line of code, called in the same way; its kind and line
    come first."""
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
