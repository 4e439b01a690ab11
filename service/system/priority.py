"""How processor time is shared: work that nobody waits for takes a higher niceness than work that somebody does."""

from __future__ import annotations

import functools
import logging
import os
from pathlib import Path

HIGHEST = 19  # the kernel's last step; it takes a larger one for this

log = logging.getLogger(__name__)


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
