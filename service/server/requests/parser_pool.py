"""Large JSON bodies parsed in processes of their own, within bounds of memory and time."""

from __future__ import annotations

import importlib
import logging
import pickle
import signal
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from service.config import MIB, Config
from service.document import MeshShape, Scene
from service.document.text import most_bytes
from service.ipc import channel
from service.problems import FieldError, ServiceError, TooLarge, Unavailable
from service.server.requests.parser_child import Failed, Work
from service.server.requests.parsers import Kind, answer_classes
from service.system.child_processes import Child, Children, Closed
from service.system.garbage import collector_paused
from service.system.turns import FairRoom

BODIES = 1000  # for one child
SECONDS_PER_BYTE = 0.25 / MIB  # twice what the slowest body there is was seen to take

# What an answer is made of besides the models of documents: classes, and numpy's own functions for arrays.
ANSWERS = answer_classes() | {Failed, FieldError}
ARRAYS = {("numpy", "dtype"), ("numpy._core.numeric", "_frombuffer"), ("numpy.core.numeric", "_frombuffer")}

log = logging.getLogger(__name__)


class ParserFailed(Exception):
    """The parser failed, which is a defect of the service and not of the body."""


class ParserPool:
    """Processes that parse, started on demand: one for each thread that calls `parse` at the same time."""

    def __init__(self, config: Config) -> None:
        self._config = config.model_copy(update={"api_key": [], "callback_secret": []})  # not for strangers' texts
        self._children = Children("service.server.requests.parser_child", BODIES)
        # No `Limit` of the `MemoryBudget`, which refuses at once and knows no order.
        self._room = FairRoom(config.max_json_memory, each=config.max_json_memory)

    def parse(self, kind: Kind, body: bytearray, hold: Callable[[int], None] | None = None) -> Any:
        """Returns the result of PARSERS[kind], or raises; TooLarge where it takes too much memory or time.

        `hold` is called with the bytes that this takes at most, before they are taken, to count them for as long as
        there is the result; without it they count already."""
        needed, most = most_bytes(body), self._config.max_json_memory
        if needed > most:
            detail = f"What this body holds may take {needed // MIB} MiB of memory: no more than {most // MIB} MiB"
            raise TooLarge(f"{detail} are allowed (SUNBOX_MAX_JSON_MEMORY)")
        seconds = self._config.parse_seconds + SECONDS_PER_BYTE * len(body)
        work = Work(kind, pickle.PickleBuffer(body), self._config, needed, seconds)
        try:
            with self._room.taken(needed):
                if hold is not None:
                    hold(needed)
                with self._children.one() as child:
                    answer = _ask(child, work)
        except Closed:
            raise Unavailable("The server is shutting down.") from None
        if isinstance(answer, ServiceError):
            raise answer
        if isinstance(answer, Failed):
            raise ParserFailed(answer.detail)
        return answer

    def close(self) -> None:
        """Ends the processes that wait; one that parses ends with its body."""
        self._children.close()


def _ask(child: Child, work: Work) -> Any:
    """The answer. Raises TooLarge where the child died or took too long; it must be killed then."""
    try:
        channel.send(child.link, work)
        if not child.answers(work.seconds):
            raise TooLarge(f"Reading this body takes longer than the {work.seconds:.0f} s allowed.")
        with collector_paused():
            return _believed(channel.receive(child.link, wait=True, find=allowed))
    except channel.Closed:
        raise _death(child, work) from None
    except (pickle.UnpicklingError, AttributeError, ImportError) as error:
        raise ParserFailed(f"the parser's answer was refused: {error}") from None


def allowed(module: str, name: str) -> Any:
    """The class of that name, where an answer may have it: models of documents, errors, what PARSERS return, and
    arrays of numbers. A parser that was taken over cannot name a function. Raises UnpicklingError."""
    if (module, name) in ARRAYS:
        return getattr(importlib.import_module(module), name)
    if module.startswith("service."):
        found = getattr(importlib.import_module(module), name, None)
        if isinstance(found, type) and found.__module__ == module and _is_of_answers(found):
            return found
    raise pickle.UnpicklingError(f"{module}.{name} is no part of an answer")


def _is_of_answers(found: type) -> bool:
    return found in ANSWERS or found.__module__.startswith("service.document.") or issubclass(found, ServiceError)


def _believed(answer: Any) -> Any:
    """The answer. Its meshes are looked at again: compiled code reads the vertices that faces name."""
    for scene in _scenes(answer):
        for shape in scene.shapes:
            if isinstance(shape, MeshShape) and shape.vertices is not None and not shape.has_its_vertices():
                raise ParserFailed("the parser's answer has a mesh whose faces name vertices that are not there")
    return answer


def _scenes(answer: Any) -> Iterator[Scene]:
    """All scenes in an answer."""
    if isinstance(answer, Scene):
        yield answer
    elif is_dataclass(answer):
        for field in fields(answer):
            yield from _scenes(getattr(answer, field.name))


def _death(child: Child, work: Work) -> Exception:
    code = child.exit_code()
    if code is None:
        return ParserFailed("the parser hung up")
    log.warning("parser of a large body died", {"code": code})
    if code == -signal.SIGXCPU:
        return TooLarge(f"Reading this body takes more than the {work.seconds:.0f} s of processor time allowed.")
    if code == -signal.SIGKILL:
        return TooLarge("Reading this body was stopped: the machine ran out of memory.")
    return ParserFailed(f"the parser died: {code}")
