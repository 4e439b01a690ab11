"""seccomp: the kernel refuses a process every system call that reading a file does not need [seccomp(2)].

The filter is a program of the classic Berkeley Packet Filter [McCanne and Jacobson 1993] over the call's number and
arguments. What it refuses fails with an error, so that a library that tries something goes on without it.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import struct

from service.system.confined.system_calls import SystemCalls

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


def restrict(calls: SystemCalls) -> bool:
    """Whether the filter is in force, for all threads of this process. Needs no-new-privileges."""
    libc = ctypes.CDLL(None, use_errno=True)
    filter = program(calls, os.getpid())
    code = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *one) for one in filter))
    head = struct.pack("@HP", len(filter), ctypes.addressof(code))  # struct sock_fprog
    return bool(libc.syscall(calls.restricting["seccomp"], SET_FILTER, ALL_THREADS, head) == 0)


def program(calls: SystemCalls, process: int) -> list[Instruction]:
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
    lines += _case(number["openat"], _bits(2, WRITING, 0), REFUSE | errno.EACCES)
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
