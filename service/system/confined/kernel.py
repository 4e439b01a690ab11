"""The kernel's means of giving up rights, called by ctypes: the numbers of system calls, by processor, of
linux/unistd.h, which never change; seccomp [seccomp(2)]; and Landlock [Salaün, landlock(7)].
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import platform
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

# Those that reading a file needs, of Python and of the libraries, with their numbers on x86_64 and aarch64. None
# opens a file for writing, reaches another process, or begins a new one. A number that is None does not exist there.
READING: dict[str, tuple[int | None, int | None]] = {
    "read": (0, 63), "write": (1, 64), "pread64": (17, 67), "pwrite64": (18, 68), "readv": (19, 65),
    "writev": (20, 66), "preadv": (295, 69), "pwritev": (296, 70), "close": (3, 57), "close_range": (436, 436),
    "lseek": (8, 62), "ftruncate": (77, 46), "fallocate": (285, 47), "sendfile": (40, 71), "fadvise64": (221, 223),
    "stat": (4, None), "lstat": (6, None), "fstat": (5, 80), "newfstatat": (262, 79), "statx": (332, 291),
    "access": (21, None), "faccessat": (269, 48), "faccessat2": (439, 439), "readlink": (89, None),
    "readlinkat": (267, 78), "getdents": (78, None), "getdents64": (217, 61), "getcwd": (79, 17),
    "statfs": (137, 43), "fstatfs": (138, 44), "dup": (32, 23), "dup2": (33, None), "dup3": (292, 24),
    "pipe2": (293, 59), "eventfd2": (290, 19), "memfd_create": (319, 279),
    "mmap": (9, 222), "mprotect": (10, 226), "munmap": (11, 215), "mremap": (25, 216), "madvise": (28, 233),
    "brk": (12, 214), "msync": (26, 227), "mincore": (27, 232),
    # On the socket to the parent, which is the only one, and connected.
    "sendmsg": (46, 211), "recvmsg": (47, 212), "recvfrom": (45, 207), "getsockopt": (55, 209),
    "getsockname": (51, 204), "shutdown": (48, 210),
    "poll": (7, None), "ppoll": (271, 73), "select": (23, None), "pselect6": (270, 72),
    "futex": (202, 98), "futex_waitv": (449, 449), "set_robust_list": (273, 99), "get_robust_list": (274, 100),
    "rseq": (334, 293), "set_tid_address": (218, 96), "gettid": (186, 178), "getpid": (39, 172),
    "getppid": (110, 173), "exit": (60, 93), "exit_group": (231, 94), "membarrier": (324, 283),
    "sched_yield": (24, 124), "sched_getaffinity": (204, 123), "sched_getparam": (143, 121),
    "sched_getscheduler": (145, 120), "getcpu": (309, 168), "getpriority": (140, 141),
    "rt_sigaction": (13, 134), "rt_sigprocmask": (14, 135), "rt_sigreturn": (15, 139), "rt_sigpending": (127, 136),
    "rt_sigtimedwait": (128, 137), "sigaltstack": (131, 132), "restart_syscall": (219, 128),
    "getuid": (102, 174), "geteuid": (107, 175), "getgid": (104, 176), "getegid": (108, 177),
    "getresuid": (118, 148), "getresgid": (120, 150), "getgroups": (115, 158), "uname": (63, 160),
    "sysinfo": (99, 179), "getrusage": (98, 165), "getrlimit": (97, 163), "setrlimit": (160, 164),
    "times": (100, 153), "umask": (95, 166), "clock_gettime": (228, 113), "clock_getres": (229, 114),
    "clock_nanosleep": (230, 115), "nanosleep": (35, 101), "gettimeofday": (96, 169), "time": (201, None),
    "getrandom": (318, 278), "arch_prctl": (158, None),
}  # fmt: skip
# Those that are allowed with some arguments only, or refused in a way of their own.
SPECIAL: dict[str, tuple[int | None, int | None]] = {
    "open": (2, None), "openat": (257, 56), "openat2": (437, 437), "clone": (56, 220), "clone3": (435, 435),
    "fcntl": (72, 25), "tgkill": (234, 131), "sendto": (44, 206), "prlimit64": (302, 261), "ioctl": (16, 29),
}  # fmt: skip
# By which a process gives up its rights.
RESTRICTING: dict[str, tuple[int, int]] = {
    "seccomp": (317, 277),
    "landlock_create_ruleset": (444, 444),
    "landlock_add_rule": (445, 445),
    "landlock_restrict_self": (446, 446),
    "capset": (126, 91),
}
AUDIT_ARCH = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}  # of linux/audit.h


@dataclass(frozen=True)
class SystemCalls:
    """The numbers on one processor, by name, and its own number in the kernel's filters."""

    audit_arch: int
    reading: dict[str, int]
    special: dict[str, int]
    restricting: dict[str, int]


def system_calls(machine: str | None = None) -> SystemCalls | None:
    """Those of this machine; None where its processor is not in the tables."""
    name = machine or platform.machine()
    if name not in AUDIT_ARCH:
        return None
    column = list(AUDIT_ARCH).index(name)
    reading, special, restricting = (
        {call: number for call, numbers in table.items() if (number := numbers[column]) is not None}
        for table in (READING, SPECIAL, RESTRICTING)
    )
    return SystemCalls(AUDIT_ARCH[name], reading, special, restricting)


LOAD, EQUAL, AND, RETURN = 0x20, 0x15, 0x54, 0x06  # BPF_LD|W|ABS, BPF_JMP|JEQ|K, BPF_ALU|AND|K, BPF_RET|K
NUMBER, ARCHITECTURE, ARGUMENTS = 0, 4, 16  # offsets in struct seccomp_data
ALLOW, REFUSE, KILL = 0x7FFF0000, 0x00050000, 0x80000000  # SECCOMP_RET_*; to REFUSE the error's number is added
SET_FILTER, ALL_THREADS = 1, 1
CLONE_THREAD = 0x10000
# Flags of open that write: O_WRONLY and O_RDWR, O_CREAT, O_TRUNC, the bit of O_TMPFILE; the same on both processors.
WRITING = 0o3 | 0o100 | 0o1000 | 0o20000000
F_DUPFD_CLOEXEC, F_ADD_SEALS, F_GET_SEALS = 1030, 1033, 1034
# No F_SETOWN, F_SETOWN_EX and F_SETSIG: with them a process has the kernel signal others.
DESCRIPTORS = (
    fcntl.F_DUPFD, fcntl.F_GETFD, fcntl.F_SETFD, fcntl.F_GETFL, fcntl.F_SETFL, fcntl.F_GETOWN,
    F_DUPFD_CLOEXEC, F_ADD_SEALS, F_GET_SEALS,
)  # fmt: skip
REQUESTS = (0x5421, 0x541B, 0x5451, 0x5450)  # FIONBIO, FIONREAD, FIOCLEX, FIONCLEX

Instruction = tuple[int, int, int, int]  # code, jump if true, jump if false, constant


def filter_system_calls(calls: SystemCalls, writes_memory: bool = False) -> bool:
    """The kernel refuses this process every system call that reading a file does not need, by a program of the
    classic Berkeley Packet Filter [McCanne and Jacobson 1993] over the call's number and arguments. What it refuses
    fails with an error, so that a library that tries something goes on without it.

    `writes_memory`: files may be opened to be written, which Landlock allows of files in memory alone.

    Whether the filter is in force, for all threads of this process. Needs no-new-privileges."""
    libc = ctypes.CDLL(None, use_errno=True)
    filter = program(calls, os.getpid(), writes_memory)
    code = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *one) for one in filter))
    head = struct.pack("@HP", len(filter), ctypes.addressof(code))  # struct sock_fprog
    return bool(libc.syscall(calls.restricting["seccomp"], SET_FILTER, ALL_THREADS, head) == 0)


def program(calls: SystemCalls, process: int, writes_memory: bool = False) -> list[Instruction]:
    """The filter, for the process of that id."""
    number, refused = calls.special, REFUSE | errno.EPERM
    lines: list[Instruction] = [
        (LOAD, 0, 0, ARCHITECTURE),
        (EQUAL, 1, 0, calls.audit_arch),
        (RETURN, 0, 0, KILL),  # numbers of another architecture mean other calls
        (LOAD, 0, 0, NUMBER),
    ]
    for call in calls.reading.values():
        lines += [(EQUAL, 0, 1, call), (RETURN, 0, 0, ALLOW)]
    if "open" in number:
        lines += _case(number["open"], _bits(1, WRITING, 0), REFUSE | errno.EACCES)
    refused_flags = 0 if writes_memory else WRITING
    lines += _case(number["openat"], _bits(2, refused_flags, 0), REFUSE | errno.EACCES)
    lines += _case(number["clone"], _bits(0, CLONE_THREAD, CLONE_THREAD), refused)  # threads, but no processes
    plain = [test for command in DESCRIPTORS for test in _same(1, command)]
    lines += _case(number["fcntl"], plain, refused)
    lines += _case(number["sendto"], _null(4), refused)  # to no address but the connected one
    lines += _case(number["tgkill"], _same(0, process), refused)
    lines += _case(number["prlimit64"], _same(0, 0), refused)
    # Their arguments are in memory, where no filter sees them; libraries then use the older calls.
    lines += _case(number["openat2"], [], REFUSE | errno.ENOSYS)
    lines += _case(number["clone3"], [], REFUSE | errno.ENOSYS)
    plain = [test for request in REQUESTS for test in _same(1, request)]
    lines += _case(number["ioctl"], plain, REFUSE | errno.ENOTTY)  # as no file here is a terminal
    return [*lines, (RETURN, 0, 0, refused)]


def _case(call: int, tests: list[Instruction], otherwise: int) -> list[Instruction]:
    """For one system call: `tests`, which may return, and else this answer."""
    return [(EQUAL, 0, len(tests) + 1, call), *tests, (RETURN, 0, 0, otherwise)]


def _bits(argument: int, mask: int, value: int) -> list[Instruction]:
    """Allow where the argument's bits in `mask` are `value`."""
    return [
        (LOAD, 0, 0, ARGUMENTS + 8 * argument),  # its lower half, on a little-endian machine
        (AND, 0, 0, mask),
        (EQUAL, 0, 1, value),
        (RETURN, 0, 0, ALLOW),
    ]


def _null(argument: int) -> list[Instruction]:
    """Allow where the argument, of 64 bits, is 0."""
    low = ARGUMENTS + 8 * argument
    return [(LOAD, 0, 0, low), (EQUAL, 0, 3, 0), (LOAD, 0, 0, low + 4), (EQUAL, 0, 1, 0), (RETURN, 0, 0, ALLOW)]


def _same(argument: int, value: int) -> list[Instruction]:
    """Allow where the argument, of 32 bits, is `value`."""
    return [(LOAD, 0, 0, ARGUMENTS + 8 * argument), (EQUAL, 0, 1, value), (RETURN, 0, 0, ALLOW)]


VERSION_ASKED = 1  # LANDLOCK_CREATE_RULESET_VERSION
PATH_BENEATH = 1  # LANDLOCK_RULE_PATH_BENEATH
READ_FILE, READ_DIR = 1 << 2, 1 << 3
# All rights on files that a version of the kernel's interface knows, and that are therefore refused.
RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 5: (1 << 16) - 1}
TCP = 0b11  # to bind and to connect, since version 4
SCOPES = 0b11  # abstract sockets of, and signals to, processes outside: since version 6


def allow_reading_only(calls: SystemCalls, readable: Iterable[Path]) -> int:
    """Allow this thread, and those that it will start, to read below these paths and nothing else.

    The version of the kernel's interface that does it; 0 where the kernel has none. Needs no-new-privileges.
    """
    libc, numbers = ctypes.CDLL(None, use_errno=True), calls.restricting
    version = int(libc.syscall(numbers["landlock_create_ruleset"], None, ctypes.c_size_t(0), VERSION_ASKED))
    if version < 1:
        return 0
    rights = RIGHTS[max(known for known in RIGHTS if known <= version)]
    attributes = struct.pack("=QQQ", rights, TCP, SCOPES)[: 8 if version < 4 else 16 if version < 6 else 24]
    ruleset = libc.syscall(
        numbers["landlock_create_ruleset"], attributes, ctypes.c_size_t(len(attributes)), ctypes.c_uint(0)
    )
    if ruleset < 0:
        return 0
    try:
        for path in readable:
            _allow(libc, numbers["landlock_add_rule"], ruleset, path)
        done = libc.syscall(numbers["landlock_restrict_self"], ruleset, ctypes.c_uint(0)) == 0
        return version if done else 0
    finally:
        os.close(ruleset)


def _allow(libc: ctypes.CDLL, add_rule: int, ruleset: int, path: Path) -> None:
    """A path that is not there stays forbidden."""
    try:
        file = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        rights = READ_FILE | READ_DIR if path.is_dir() else READ_FILE
        libc.syscall(add_rule, ruleset, PATH_BENEATH, struct.pack("=Qi", rights, file), ctypes.c_uint(0))
    finally:
        os.close(file)
