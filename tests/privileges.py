"""Programs under test run without privileges, also where root starts the tests (as CI does)."""

from __future__ import annotations

import shlex
import sys
from functools import cache
from pathlib import Path


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
