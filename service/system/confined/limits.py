"""What a process may take: its place behind others, memory, processor time, files."""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import os
import resource
import signal
from functools import cache

from service.system.cpu import raise_thread_niceness

CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000
DESCRIPTORS = 64  # a file, a few for its libraries, and those of the answer


def confine(niceness: int) -> bool:
    """Have at least this niceness, write no core file, drop the network where the kernel allows it, be the first to
    go when memory runs out.

    Whether the network was dropped.
    """
    _statm()  # opened now: later no file can be
    _limit(resource.RLIMIT_CORE, 0, hard=0)
    libc = ctypes.CDLL(None, use_errno=True)
    dropped = any(libc.unshare(flags) == 0 for flags in (CLONE_NEWNET, CLONE_NEWUSER | CLONE_NEWNET))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle; it closes the socket
    raise_thread_niceness(niceness)
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as score:
        score.write("1000")
    return dropped


def cap(memory: int, seconds: float, written: int) -> None:
    """Bound for good what `bound` may allow: bytes of memory, processor time, bytes of a file in memory. Once."""
    limits = {
        resource.RLIMIT_AS: _taken() + memory,
        resource.RLIMIT_CPU: int(_used_s() + seconds) + 1,
        resource.RLIMIT_FSIZE: written,
        resource.RLIMIT_NOFILE: DESCRIPTORS,
        resource.RLIMIT_MEMLOCK: 0,
    }
    for which, most in limits.items():
        _limit(which, most, most)


def bound(memory: int, seconds: float) -> None:
    """Allow this process `memory` more bytes than it has taken, and `seconds` more processor time."""
    _limit(resource.RLIMIT_AS, _taken() + memory)
    _limit(resource.RLIMIT_CPU, int(_used_s() + seconds) + 1)


def unbind() -> None:
    """Lift the bound on memory, so that an answer can be sent."""
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def _taken() -> int:
    """Bytes of address space."""
    return int(os.pread(_statm(), 200, 0).split()[0]) * mmap.PAGESIZE


@cache
def _statm() -> int:
    return os.open("/proc/self/statm", os.O_RDONLY | os.O_CLOEXEC)


def _used_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _limit(which: int, soft: int, hard: int | None = None) -> None:
    """Set the soft limit, within the hard one, which allows to lift it again for the next work; or both, for good."""
    most = resource.getrlimit(which)[1]
    within = soft if most == resource.RLIM_INFINITY else min(soft, most)
    resource.setrlimit(which, (within, most if hard is None else within))
