"""Programs under test run without privileges, also where root starts the tests (as CI does)."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
_own = sys.executable


@cache
def unprivileged() -> list[str]:
    """What a command line begins with so that its program has no capability and can gain none."""
    if capabilities("self") == 0:
        return []
    return ["setpriv", "--bounding-set=-all", "--inh-caps=-all", "--ambient-caps=-all", "--no-new-privs"]


def capabilities(process: int | str) -> int:
    """The effective ones, a bit each."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(line.split()[1], 16) for line in lines if line.startswith("CapEff:"))


def as_user(user: int) -> list[str]:
    """What a command line begins with so that its program is another user's. Only root can do that."""
    return [*unprivileged(), f"--reuid={user}", f"--regid={user}", "--clear-groups"]


def python_of(user: int) -> list[str]:
    """A Python with our packages, run as that user. Skips where there is none, as in a home that only root enters."""
    if os.geteuid() != 0 or not unprivileged():
        pytest.skip("only root can start a program as another user")
    packages = os.pathsep.join([str(ROOT), *(path for path in sys.path if path.endswith("site-packages"))])
    for python in (_own, f"/usr/bin/python{sys.version_info.major}.{sys.version_info.minor}"):
        command = [*as_user(user), "env", f"PYTHONPATH={packages}", python]
        with suppress(OSError):
            tried = subprocess.run([*command, "-c", "import numba, service.cli"], capture_output=True, cwd="/")
            if tried.returncode == 0:
                return command
    pytest.skip(f"user {user} may not read this Python and its packages")


def shed(folder: Path) -> None:
    """Have every Python process that tests start from now on run unprivileged: servers, renderers, helpers, clients.

    They are all started as `sys.executable`, which becomes a script in `folder`. The tests' own process keeps its
    privileges, for tests that start a program as another user.
    """
    if not unprivileged():
        return
    script = folder / "python"
    script.write_text(f'#!/bin/sh\nexec {shlex.join([*unprivileged(), sys.executable])} "$@"\n')
    script.chmod(0o755)
    sys.executable = str(script)
