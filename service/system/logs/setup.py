"""Logs: a line for eyes or a JSON object for machines, what belongs to a request under its id."""

from __future__ import annotations

import logging
import sys
import threading
import warnings
from collections.abc import Iterable
from types import TracebackType

from service.system.background import count_death
from service.system.logs.formatters import Console, Json, context_fields
from service.system.logs.output import Output, Queued, Written

log = logging.getLogger(__name__)

ROOMS = ("service", "gpu")  # whose loggers are our own


def configure(form: str, level: str, queued: bool = False, secrets: Iterable[str] = ()) -> None:
    """Have all records of the standard library's logging written to stderr, as `form`: "console" or "json".

    `level` is the least that is written of our own; libraries have theirs from warnings on. With `queued` a thread of
    its own writes it, so that whoever logs never waits. `secrets` are left out of every line.
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
    """Add these fields to every line that the calling thread logs from now on."""
    context_fields.set({**context_fields.get(), **fields})


def level() -> int:
    """The level from which our own loggers write."""
    return logging.getLogger(ROOMS[0]).getEffectiveLevel()


def _thread_died(told: threading.ExceptHookArgs) -> None:
    count_death("thread")
    _uncaught(told.exc_type, told.exc_value, told.exc_traceback)


def _finalizer_died(told: sys.UnraisableHookArgs) -> None:
    count_death("finalizer")
    trace = None if told.exc_value is None else (told.exc_type, told.exc_value, told.exc_traceback)
    log.error("a finalizer died", {"of": repr(told.object)}, exc_info=trace)


def _uncaught(kind: type[BaseException], error: BaseException | None, trace: TracebackType | None) -> None:
    if error is not None and not isinstance(error, KeyboardInterrupt | SystemExit):
        log.critical("ended by an error", exc_info=(kind, error, trace))
