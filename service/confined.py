"""What a process gives up before it works on strangers' data, so that these can cost no more than its limits."""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import os
import resource
import signal

CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000


def confine(niceness: int) -> None:
    """Write no core file, drop the network where the kernel allows it, be the first to go when memory runs out."""
    _limit(resource.RLIMIT_CORE, 0)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWNET) != 0:
        libc.unshare(CLONE_NEWUSER | CLONE_NEWNET)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle; it closes the socket
    os.nice(niceness)
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as score:
        score.write("1000")


def bound(memory: int, seconds: float) -> None:
    """Allow this process `memory` more bytes than it has taken, and `seconds` more processor time."""
    with open("/proc/self/statm") as sizes:
        taken = int(sizes.read().split()[0]) * mmap.PAGESIZE
    _limit(resource.RLIMIT_AS, taken + memory)
    used = resource.getrusage(resource.RUSAGE_SELF)
    _limit(resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime + seconds) + 1)


def unbind() -> None:
    """Lift the bound on memory, so that an answer can be sent."""
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def _limit(which: int, value: int) -> None:
    """Set the soft limit, within the hard one; it can be lifted again for the next work."""
    hard = resource.getrlimit(which)[1]
    resource.setrlimit(which, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))
