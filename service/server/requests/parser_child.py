"""The process that parses large JSON bodies: `python -m service.server.requests.parser_child FD ...`; FD is a link.

The C scanner and pydantic keep all other threads of their process waiting, seconds for some bodies. Here nobody
waits, and what takes too much memory or time is ended. It ends with its parent, and when nothing came for a while.
"""

from __future__ import annotations

import gc
from dataclasses import dataclass
from typing import Any

from service.config import Config
from service.ipc import channel
from service.problems import ServiceError, TooLarge
from service.server.requests.parsers import PARSERS, Kind
from service.system.confined import begin, bounded
from service.system.shared_memory import trim

IDLE_S = 300.0
BASE_BYTES, TIMES = 256 << 20, 3  # of address space: for what comes beside the values; models and arrays made of them


@dataclass(frozen=True)
class Work:
    kind: Kind
    body: Any  # a buffer, by protocol 5 of pickle
    config: Config
    memory: int  # bytes that the values may take
    seconds: float


@dataclass(frozen=True)
class Failed:
    """Parsing failed through no fault of the body; `detail` is for the log."""

    detail: str


def main() -> None:
    end = begin()
    gc.disable()  # it would go through all values again and again, and find nothing to free
    gc.freeze()
    end.settimeout(IDLE_S)
    while True:
        try:
            answer = _answer(channel.receive(end, wait=True))
            channel.send(end, answer, sealed=True)
        except (channel.Closed, TimeoutError):
            return
        del answer
        gc.collect()
        trim()


def _answer(work: Work) -> Any:
    try:
        with bounded(BASE_BYTES + TIMES * work.memory, work.seconds):
            return PARSERS[work.kind](work.config, work.body)
    except ServiceError as error:
        return error
    except MemoryError:
        return TooLarge("Reading this body takes more memory than allowed (SUNBOX_MAX_JSON_MEMORY).")
    except Exception as error:
        return Failed(f"{type(error).__name__}: {error}"[:2000])


if __name__ == "__main__":
    main()
