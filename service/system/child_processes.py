"""Children that parse strangers' files and texts, as the service starts, reuses and ends them; and the environment of
every process that the service starts.

`service.system.confined` is their own side: what they give up before they read anything.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from service.system.confined import Rights
from service.system.cpu import answers, working_niceness

ROOT = Path(__file__).parents[2]
PAGE = os.sysconf("SC_PAGE_SIZE")
START_SECONDS = 30.0  # libraries read from a cold disk
RIGHTS_BYTES = 4096  # of the message that says what a child gave up
CLOSING_SECONDS = 5.0  # from a hung-up socket to the end of its process
SETTINGS = "SUNBOX_"  # what the names of the service's settings begin with
FOR_CHILDREN = {"SUNBOX_LOG_FORMAT"}  # the settings that a process beside the server reads
SECRETS = {"RAY_AUTH_TOKEN"}  # whoever has it may run programs on all nodes of a Ray cluster
# One thread each: a second one gains nothing on files of this size and takes address space from the limit.
THREADS = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def inherited_environment(*secrets: str) -> dict[str, str]:
    """This process's environment for a child, without what may be a secret but for those that are named.

    None of the service's settings that the child does not read goes along: the keys are among them, also under a name
    that somebody misspelt.
    """
    return {
        name: value
        for name, value in os.environ.items()
        if name in FOR_CHILDREN or name in secrets or not (name.startswith(SETTINGS) or name in SECRETS)
    }


class Closed(Exception):
    """The children were closed: the service is shutting down."""


class Child:
    """`python -m MODULE DESCRIPTOR LIFELINE NICENESS`, the descriptor being its end of a socket of whole messages,
    `link` ours, and the lifeline the end of a pipe that nobody writes to: it ends with the other end, which is ours.

    Its first message says which rights it has given up. `is_spent` is set where it should get no more work.
    """

    def __init__(self, module: str, environment: dict[str, str]) -> None:
        self.link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        line, self._lifeline = os.pipe()
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-m", module, str(theirs.fileno()), str(line), str(working_niceness())],
                cwd=ROOT,
                env=inherited_environment() | THREADS | environment,
                pass_fds=[theirs.fileno(), line],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,  # the server's is its log, of which nobody else writes lines
            )
        except BaseException:
            os.close(self._lifeline)
            raise
        finally:
            theirs.close()
            os.close(line)
        self.is_spent = False
        self.given = 0  # how often it got work
        self.rest = 0  # bytes of its own when it got the work at hand
        self._rights: Rights | None = None

    def rights(self) -> Rights | None:
        """The rights that it has given up. Waits for its start; None where it did not come to that."""
        if self._rights is None and answers(self.link, self.process.pid, START_SECONDS):
            with suppress(OSError, ValueError, TypeError):  # it has ended
                self._rights = Rights(**json.loads(self.link.recv(RIGHTS_BYTES)))
        return self._rights

    def answers(self, seconds: float) -> bool:
        """Wait until `link` can be read, for at most `seconds` of the child's own time, and longer for its start."""
        ended = self.rights() is None and self.process.poll() is not None
        return ended or answers(self.link, self.process.pid, seconds)

    def exit_code(self) -> int | None:
        """How a child ended that hung up; minus the signal's number for a signal, None where it runs on."""
        try:
            return self.process.wait(CLOSING_SECONDS)
        except subprocess.TimeoutExpired:
            return None

    def private_bytes(self) -> int:
        """Bytes of its memory that are no file and shared with nobody; 0 where it has ended."""
        try:
            with open(f"/proc/{self.process.pid}/statm") as sizes:
                _, resident, shared, *_ = map(int, sizes.read().split())
        except (OSError, ValueError):
            return 0
        return (resident - shared) * PAGE

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self.link.close()
        if self._lifeline >= 0:
            os.close(self._lifeline)
            self._lifeline = -1


class Children:
    """Children of one module, for any thread. They start on demand, and each serves many requests in turn."""

    def __init__(self, module: str, most: int, environment: dict[str, str] | None = None) -> None:
        """`environment` is added to each child's.

        A child gets work `most` times: what one piece of it may have done to its memory does not stay for ever.
        """
        self._module, self._most, self._environment = module, most, environment or {}
        self._lock = threading.Lock()
        self._idle: list[Child] = []
        self._working = set[Child]()
        self._is_closed = False

    @property
    def idle(self) -> list[Child]:
        """The children that wait for work."""
        with self._lock:
            return list(self._idle)

    def working_bytes(self) -> int:
        """The bytes that the work at hand has taken so far in the children, as the system counts them."""
        with self._lock:
            working = list(self._working)
        return sum(max(0, child.private_bytes() - child.rest) for child in working)

    @contextmanager
    def one(self) -> Iterator[Child]:
        """A child of the caller's own, which is killed where the block raises. Raises Closed."""
        child = self._take()
        child.given += 1
        child.rest = child.private_bytes()
        with self._lock:
            self._working.add(child)
        try:
            yield child
        except BaseException:
            child.kill()
            raise
        finally:
            with self._lock:
                self._working.remove(child)
        if child.is_spent or child.given >= self._most:
            child.kill()
            child = self._start()  # it is ready when the next work comes
        self._give_back(child)

    def rights(self) -> Rights | None:
        """The rights that a child of these gives up; None where none could be started. Waits for a first one to
        start."""
        with self.one() as child:
            child.given -= 1
            return child.rights()

    def close(self) -> None:
        """Ends the children that wait; one that works ends with its work."""
        with self._lock:
            self._is_closed = True
            idle, self._idle = self._idle, []
        for child in idle:
            child.kill()

    def _take(self) -> Child:
        with self._lock:
            if self._is_closed:
                raise Closed
            while self._idle:
                child = self._idle.pop()
                if child.process.poll() is None:
                    return child
                child.kill()
        return self._start()

    def _start(self) -> Child:
        return Child(self._module, self._environment)

    def _give_back(self, child: Child) -> None:
        with self._lock:
            if not self._is_closed:
                self._idle.append(child)
                return
        child.kill()


def signal_name(exit_code: int) -> str:
    """The signal or exit code that ended a process, in words for a message."""
    return signal.Signals(-exit_code).name if exit_code < 0 else f"exit code {exit_code}"
