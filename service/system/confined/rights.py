"""What a process may do: everything that reading a file does not need is given up, as far as the kernel knows how."""

from __future__ import annotations

import ctypes
import struct
import sys
import sysconfig
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from service.system.confined.kernel import SystemCalls, allow_reading_only, filter_system_calls, system_calls

ROOT = Path(__file__).parents[3]
PR_SET_DUMPABLE, PR_CAPBSET_DROP, PR_SET_NO_NEW_PRIVS, PR_CAP_AMBIENT = 4, 24, 38, 47
CLEAR_ALL = 4  # PR_CAP_AMBIENT_CLEAR_ALL
LAST_CAPABILITY = 63
CAPABILITY_VERSION = 0x20080522  # _LINUX_CAPABILITY_VERSION_3


@dataclass(frozen=True)
class Rights:
    """Which rights a process has given up, of those that the kernel can take."""

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


def renounce(no_network: bool) -> Rights:
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
    filtered = filter_system_calls(calls)
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
    """Whether there are none any more, also not for a program that this process would start."""
    libc.prctl(PR_CAP_AMBIENT, CLEAR_ALL, 0, 0, 0)
    for capability in range(LAST_CAPABILITY + 1):
        libc.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)
    if calls is None:
        return False
    head, none = struct.pack("=Ii", CAPABILITY_VERSION, 0), bytes(24)
    return bool(libc.syscall(calls.restricting["capset"], head, none) == 0)
