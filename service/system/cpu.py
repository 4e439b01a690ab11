"""The processor's time: elapsed time minus the time a process was runnable but not scheduled (Linux schedstat); and
how it is shared. What works for requests gives way to the event loop and to other programs by as many steps of
niceness as SUNBOX_NICE says; what is done ahead, and for nobody yet, gives way further.
"""

from __future__ import annotations

import functools
import logging
import os
import select
import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

# The share of wall time that counts in any case, or a renderer that hangs on a busy machine would never be noticed.
# Ten steps of niceness below a dozen busy programs, a process gets a fiftieth of a processor.
LEAST = 0.05

Ran = Mapping[int, tuple[int, int]]  # by thread: ns on a processor, ns ready for one and waiting


class RunnableTime:
    """The time since this object was made in which a process was able to run."""

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._began, self._ran = time.monotonic(), ran(pid)

    @property
    def elapsed_s(self) -> float:
        return elapsed_s(time.monotonic() - self._began, self._ran, ran(self._pid))


def answers(link: socket.socket, pid: int, seconds: float) -> bool:
    """True if a message comes on `link` within `seconds` in which the process was able to run."""
    poll = select.poll()
    poll.register(link, select.POLLIN)
    runnable, left = RunnableTime(pid), seconds
    while left > 0:
        if poll.poll(max(1, left * 1000)):
            return True
        left = seconds - runnable.elapsed_s
    return False


def elapsed_s(passed_s: float, before: Ran, after: Ran) -> float:
    """The part of `passed_s` in which a process could run: all of it where it slept, was stopped or ran alone."""
    both = before.keys() & after.keys()
    ran_s = sum(after[thread][0] - before[thread][0] for thread in both) / 1e9
    waited_s = sum(after[thread][1] - before[thread][1] for thread in both) / 1e9
    # Threads mostly wait for each other, so that the sum of their waiting is what the process lost; where they only
    # are more than there are processors, the part of them that runs is the better figure.
    share = ran_s / (ran_s + waited_s) if waited_s > 0 else 1.0
    return max(passed_s - waited_s, passed_s * share, passed_s * LEAST)


def ran(pid: int) -> Ran:
    """A process's times by thread; empty where the system does not give them, so that all time counts."""
    found: dict[int, tuple[int, int]] = {}
    with suppress(OSError, ValueError):
        for thread in Path(f"/proc/{pid}/task").iterdir():
            with suppress(OSError):  # it has just ended
                on, waited, _ = (thread / "schedstat").read_text().split()
                found[int(thread.name)] = int(on), int(waited)
    return found


HIGHEST = 19  # the kernel's last step; it takes a larger one for this

log = logging.getLogger(__name__)

_steps = 0


def set_steps(steps: int) -> None:
    """Have threads and processes that begin from now on give way by so many steps; once, at the server's start."""
    global _steps
    _steps = steps


def working_niceness(most: int = HIGHEST) -> int:
    """The niceness of what works for requests, of threads of this process and of its children: at most `most` steps
    above this process's own."""
    return min(os.getpriority(os.PRIO_PROCESS, os.getpid()) + min(_steps, most), HIGHEST)


def raise_thread_niceness(niceness: int, thread: int = 0) -> None:
    """Give a thread (by its kernel id; 0: the calling one) at least this niceness.

    A thread whose niceness is higher keeps it: lowering it takes CAP_SYS_NICE, and the service needs no privilege.
    A thread that has ended is skipped. A refusal is logged once; the thread then goes on as it was.
    """
    try:
        if os.getpriority(os.PRIO_PROCESS, thread) < min(niceness, HIGHEST):
            os.setpriority(os.PRIO_PROCESS, thread, niceness)
    except ProcessLookupError:
        pass
    except OSError as error:
        _log_refusal(str(error))


def raise_process_niceness(niceness: int) -> None:
    """`raise_thread_niceness` for every thread of this process, those that libraries have started included."""
    for thread in Path("/proc/self/task").iterdir():
        raise_thread_niceness(niceness, int(thread.name))


@functools.cache
def _log_refusal(reason: str) -> None:
    log.warning("the system refused to change a thread's priority", {"error": reason})
