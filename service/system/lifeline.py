"""A child that ends when its parent does, or when the server does."""

from __future__ import annotations

import ctypes
import fcntl
import os
import select
import signal

PR_SET_PDEATHSIG = 1


def end_with(parent: int) -> bool:
    """Has the kernel kill this process when the parent dies, however it dies; False when it is dead already."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    return os.getppid() == parent


def end_with_pipe(descriptor: int) -> bool:
    """Has the kernel end this process with the one that has the pipe's other end; False when none has it."""
    # Opened anew: one description, which children share, has one owner to signal. SIGIO ends a process that
    # does not handle it, in the middle of a driver's compiler too.
    reopened = os.open(f"/proc/self/fd/{descriptor}", os.O_RDONLY | os.O_NONBLOCK)
    fcntl.fcntl(reopened, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(reopened, fcntl.F_SETFL, fcntl.fcntl(reopened, fcntl.F_GETFL) | os.O_ASYNC)
    return not hung_up(reopened)


def hung_up(end: int) -> bool:
    """True if no process has the other end any more."""
    poll = select.poll()
    poll.register(end, 0)
    return bool(poll.poll(0))
