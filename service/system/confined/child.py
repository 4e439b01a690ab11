"""The frame of every child that parses strangers' files or texts: how it begins, what it may take (its place behind
others, memory, processor time, files), what it may do (whatever reading a file does not need is given up, as far as
the kernel knows how), and how it works on one of them.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import json
import mmap
import os
import resource
import signal
import socket
import struct
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from service.system.confined.kernel import SystemCalls, allow_reading_only, filter_system_calls, system_calls
from service.system.cpu import raise_thread_niceness
from service.system.lifeline import end_with_pipe


def begin(modules: Iterable[str] = (), writes_memory: bool = False) -> socket.socket:
    """The socket to the parent, whose descriptor is the child's first argument. The second is a pipe's, whose other
    end the parent holds: the child ends with it, even inside a library's loop. The third is its niceness.

    The child has given up all rights that it does not need, and has sent the parent their list. Before, while it
    could open files, it imported `modules`. `writes_memory`: a library of the child writes files in memory by their
    names, which it may where Landlock keeps it from all others.
    """
    link = socket.socket(fileno=int(sys.argv[1]))
    # Not by a signal from `link`: the one that a message sends may come when the message has been read, and work on
    # it has begun.
    if not end_with_pipe(int(sys.argv[2])):
        sys.exit()
    for name in modules:
        importlib.import_module(name)
    link.sendmsg([json.dumps(asdict(renounce(confine(int(sys.argv[3])), writes_memory))).encode()])
    return link


@contextmanager
def bounded(memory: int, seconds: float) -> Iterator[None]:
    """A context in which the child may take no more than this many bytes beyond what it has and seconds of processor
    time."""
    try:
        bound(memory, seconds)
        yield
    finally:
        unbind()


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


ROOT = Path(__file__).parents[3]
PR_SET_DUMPABLE, PR_CAPBSET_DROP, PR_SET_NO_NEW_PRIVS, PR_CAP_AMBIENT = 4, 24, 38, 47
CLEAR_ALL = 4  # PR_CAP_AMBIENT_CLEAR_ALL
LAST_CAPABILITY = 63
CAPABILITY_VERSION = 0x20080522  # _LINUX_CAPABILITY_VERSION_3


@dataclass(frozen=True)
class Rights:
    """The rights that a process has given up, of those that the kernel can take."""

    no_new_privileges: bool = False  # no program that it could start would have more rights
    no_capabilities: bool = False  # root's
    no_network: bool = False  # it is in a network without interfaces
    hidden: bool = False  # other processes of this user can't read its memory
    landlock: int = 0  # it reads files of Python and the libraries only; the version of the interface, 0: not so
    seccomp: bool = False  # it makes no system calls but those that reading needs

    @property
    def missing(self) -> list[str]:
        """Names of what the kernel did not take. A network is no loss where no socket can be made."""
        covered = {"no_network"} if self.seccomp else set()
        return [name for name, value in asdict(self).items() if not value and name not in covered]


def renounce(no_network: bool, writes_memory: bool = False) -> Rights:
    """Give up for good what is not needed to parse files that are open, with libraries that may still be loaded.

    To be called while the process has one thread. `no_network` is what `confine` said.
    """
    libc, calls = ctypes.CDLL(None, use_errno=True), system_calls()
    no_new_privileges = libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0
    no_capabilities = _drop_capabilities(libc, calls)
    hidden = hide()
    if calls is None:
        return Rights(no_new_privileges, no_capabilities, no_network, hidden)
    restricted = allow_reading_only(calls, readable())
    filtered = filter_system_calls(calls, writes_memory and restricted > 0)
    return Rights(no_new_privileges, no_capabilities, no_network, hidden, restricted, filtered)


def hide() -> bool:
    """Keep other processes of this user from reading this one's memory and environment, and from tracing it."""
    libc = ctypes.CDLL(None, use_errno=True)
    return bool(libc.prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) == 0)


def readable() -> Iterator[Path]:
    """Python, its packages, this one's modules, and shared libraries."""
    paths = sysconfig.get_paths()
    yield from (Path(paths[name]) for name in ("stdlib", "platstdlib", "purelib", "platlib"))
    yield from (Path(folder) for folder in sys.path if any(Path(folder).glob("*.dist-info")))  # --user, --target
    yield Path(sys.base_prefix) / "lib"
    yield ROOT / "service"
    yield from map(Path, ("/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib", "/etc/ld.so.cache"))


def _drop_capabilities(libc: ctypes.CDLL, calls: SystemCalls | None) -> bool:
    """True if there are none any more, also not for a program that this process would start."""
    libc.prctl(PR_CAP_AMBIENT, CLEAR_ALL, 0, 0, 0)
    for capability in range(LAST_CAPABILITY + 1):
        libc.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)
    if calls is None:
        return False
    head, none = struct.pack("=Ii", CAPABILITY_VERSION, 0), bytes(24)
    return bool(libc.syscall(calls.restricting["capset"], head, none) == 0)
