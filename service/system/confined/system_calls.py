"""The numbers of system calls, by processor: of linux/unistd.h, which never change."""

from __future__ import annotations

import platform
from dataclasses import dataclass

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
