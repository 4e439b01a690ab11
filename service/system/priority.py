"""How processor time is shared: what works for requests gives way to the event loop and to other programs by as many
steps of niceness as SUNBOX_NICE says; what is done ahead, and for nobody yet, gives way further."""

from __future__ import annotations

import functools
import logging
import os
from pathlib import Path

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
