"""Landlock: a process forbids itself to open files, save for reading below some folders [Salaün, landlock(7)]."""

from __future__ import annotations

import ctypes
import os
import struct
from collections.abc import Iterable
from pathlib import Path

from service.system.confined.system_calls import SystemCalls

VERSION_ASKED = 1  # LANDLOCK_CREATE_RULESET_VERSION
PATH_BENEATH = 1  # LANDLOCK_RULE_PATH_BENEATH
READ_FILE, READ_DIR = 1 << 2, 1 << 3
# All rights on files that a version of the kernel's interface knows, and that are therefore refused.
RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 5: (1 << 16) - 1}
TCP = 0b11  # to bind and to connect, since version 4
SCOPES = 0b11  # abstract sockets of, and signals to, processes outside: since version 6


def restrict(calls: SystemCalls, readable: Iterable[Path]) -> int:
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
