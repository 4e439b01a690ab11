"""Large JSON bodies parsed in processes of their own, within bounds of memory and time."""

from __future__ import annotations

import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from service.config import MIB, Config
from service.cpu_time import answers
from service.garbage import collector_paused
from service.problems import ServiceError, TooLarge, Unavailable
from service.rendering.ipc import channel
from service.rendering.requests.parser_child import Failed, Work
from service.rendering.requests.request_parser import Kind
from service.scene.text import most_bytes

ROOT = Path(__file__).parents[3]
START_SECONDS = 30.0  # libraries read from a cold disk
SECONDS_PER_BYTE = 0.25 / MIB  # of the slowest body there is, twice
CLOSING_SECONDS = 5.0
# One thread each: a second one gains nothing, and takes address space from the limit.
THREADS = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}

log = logging.getLogger(__name__)


class ParserFailed(Exception):
    """A defect of ours."""


class ParserPool:
    """`parse` from as many threads as there shall be processes; they start on demand."""

    def __init__(self, config: Config) -> None:
        self._config = config.model_copy(update={"api_key": []})  # a process that reads strangers' texts needs no key
        self._lock = threading.Lock()
        self._idle: list[_Child] = []
        self._closed = False
        self._room = _Room(config.max_json_memory)

    def parse(self, kind: Kind, body: bytearray) -> Any:
        """What PARSERS[kind] makes of it, or raises; TooLarge where that takes too much memory or time."""
        needed, most = most_bytes(body), self._config.max_json_memory
        if needed > most:
            detail = f"What this body holds may take {needed // MIB} MiB of memory: no more than {most // MIB} MiB"
            raise TooLarge(f"{detail} are allowed (SUNBOX_MAX_JSON_MEMORY)")
        seconds = self._config.parse_seconds + SECONDS_PER_BYTE * len(body)
        work = Work(kind, pickle.PickleBuffer(body), self._config, needed, seconds)
        with self._room.taken(needed):
            child = self._take()
            try:
                answer = child.ask(work)
            except BaseException:
                child.kill()
                raise
            self._give_back(child)
        if isinstance(answer, ServiceError):
            raise answer
        if isinstance(answer, Failed):
            raise ParserFailed(answer.detail)
        return answer

    def close(self) -> None:
        """Ends the processes that wait; one that parses ends with its body."""
        with self._lock:
            self._closed = True
            idle, self._idle = self._idle, []
        for child in idle:
            child.kill()

    def _take(self) -> _Child:
        with self._lock:
            if self._closed:
                raise Unavailable("The server is shutting down.")
            while self._idle:
                child = self._idle.pop()
                if child.process.poll() is None:
                    return child
                child.kill()
        return _Child()

    def _give_back(self, child: _Child) -> None:
        with self._lock:
            if not self._closed:
                self._idle.append(child)
                return
        child.kill()


class _Room:
    """So many bytes for all; who finds too few left waits until others give theirs back."""

    def __init__(self, size: int) -> None:
        self._left = size
        self._changed = threading.Condition()

    @contextmanager
    def taken(self, size: int) -> Iterator[None]:
        with self._changed:
            self._changed.wait_for(lambda: self._left >= size)
            self._left -= size
        try:
            yield
        finally:
            with self._changed:
                self._left += size
                self._changed.notify_all()


class _Child:
    def __init__(self) -> None:
        self.link, theirs = channel.pair()
        with theirs:
            # Nothing of the service's settings: they may hold its key.
            env = {k: v for k, v in os.environ.items() if not k.startswith("SUNBOX_")} | THREADS
            self.process = subprocess.Popen(
                [sys.executable, "-m", "service.rendering.requests.parser_child", str(theirs.fileno())],
                cwd=ROOT,
                env=env,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
            )
        self._started = False

    def ask(self, work: Work) -> Any:
        """The answer. Raises TooLarge where it died or took too long; it must be killed then."""
        try:
            channel.send(self.link, work)
            if not answers(self.link, self.process.pid, work.seconds + (0 if self._started else START_SECONDS)):
                raise TooLarge(f"Reading this body takes longer than the {work.seconds:.0f} s allowed.")
            with collector_paused():
                answer = channel.receive(self.link, wait=True)
        except channel.Closed:
            raise self._death(work) from None
        self._started = True
        return answer

    def _death(self, work: Work) -> Exception:
        try:
            code = self.process.wait(CLOSING_SECONDS)
        except subprocess.TimeoutExpired:
            return ParserFailed("the parser hung up")
        log.warning("parser of a large body died code=%d", code)
        if code == -signal.SIGXCPU:
            return TooLarge(f"Reading this body takes more than the {work.seconds:.0f} s of processor time allowed.")
        if code == -signal.SIGKILL:
            return TooLarge("Reading this body was stopped: the machine ran out of memory.")
        return ParserFailed(f"the parser died: {code}")

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self.link.close()
