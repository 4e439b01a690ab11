"""A process beside the renderer that does one kind of work for it: started on demand, ended when not needed."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from service.ipc import channel
from service.system.child_processes import inherited_environment

ROOT = Path(__file__).parents[3]


class HelperProcess:
    """Runs `python -m MODULE DESCRIPTOR --parent PID ARGUMENTS`, which may end by itself when idle."""

    def __init__(
        self,
        module: str,
        *arguments: str,
        lifeline: int | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """With `lifeline`, a pipe of the server's, it may end something that its parent does not see the end of.
        `environment` is added to what it inherits."""
        self._module, self._arguments = module, arguments
        self._environment = environment or {}
        self._passed: list[int] = []
        if lifeline is not None:
            self._passed = [lifeline]
            self._arguments = *arguments, "--lifeline", str(lifeline)
        self._process: subprocess.Popen[bytes] | None = None
        self._end: socket.socket | None = None
        self._is_paused = False

    @property
    def ends(self) -> list[socket.socket]:
        """The sockets to wait on."""
        return [] if self._end is None else [self._end]

    @property
    def process_id(self) -> int | None:
        return None if self._process is None else self._process.pid

    def ask(self, message: object) -> None:
        """Send a request. Raises channel.Closed where the process ends at once, OSError where it cannot start."""
        try:
            channel.send(self._begin(), message)
        except channel.Closed:  # it had just ended, being idle
            self.close()
            channel.send(self._begin(), message)

    def start(self) -> None:
        """Have the process there before the first request. Raises OSError where it cannot start."""
        self._begin()

    def hear(self) -> Any:
        """The next answer. Raises BlockingIOError where there is none, channel.Closed when the process has ended."""
        if self._end is None:
            raise BlockingIOError
        return channel.receive(self._end)

    def pause(self, is_paused: bool) -> None:
        """Stop the process where it stands, or let it go on."""
        if self._process is not None and is_paused != self._is_paused:
            self._process.send_signal(signal.SIGSTOP if is_paused else signal.SIGCONT)
            self._is_paused = is_paused

    def close(self) -> int:
        """End the process, if there is one; its exit code, which is its own where it had ended before."""
        code = 0
        if self._end is not None:
            self._end.close()
        if self._process is not None:
            self._process.kill()
            code = self._process.wait()
        self._end = self._process = None
        self._is_paused = False
        return code

    def _begin(self) -> socket.socket:
        if self._end is not None:
            return self._end
        self._end, theirs = channel.pair()
        with theirs:
            command = [sys.executable, "-m", self._module, str(theirs.fileno()), "--parent", str(os.getpid())]
            try:
                self._process = subprocess.Popen(
                    [*command, *self._arguments],
                    pass_fds=[theirs.fileno(), *self._passed],
                    env={**inherited_environment(), **self._environment},
                    cwd=ROOT,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    process_group=0,  # Ctrl-C in a terminal is for the parent
                )
            except OSError:
                self.close()
                raise
        return self._end
