"""One renderer's process, seen from the server: how it is started, watched and ended, and why it died."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, Literal, Protocol

from service.config import Ahead
from service.ipc import channel, heartbeat
from service.ipc.server_end import Channel
from service.system import logs
from service.system.child_processes import inherited_environment
from service.system.cpu import RunnableTime

ROOT = Path(__file__).parents[3]
TURNS = 10  # how many times as long as the last one a piece of work may take, beyond the patience
STARTING_S = 60.0  # it imports, finds a driver and asks for a context before it can beat
# How many threads a process may have: of llvmpipe, of Open Image Denoise, and of what numpy and numba may load.
THREADS = ("LP_NUM_THREADS", "OIDN_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
POLL_S = 0.01  # between two looks whether a process has ended
KILLS = {-signal.SIGKILL, -signal.SIGTERM}

Cause = Literal["killed", "crashed", "hung", "stopped", "out of memory", "node lost", "drained", "released"]

log = logging.getLogger(__name__)


class Link(Protocol):
    """The server's end of the way to a renderer. Nothing waits: what cannot be sent yet stays in line."""

    def send(self, message: object) -> None: ...

    def send_encoded(self, message: channel.Encoded) -> None:
        """Send what `channel.encode` gave; its descriptors are the link's from now on."""

    def close(self) -> None: ...


@dataclass(frozen=True)
class NoPlace:
    """Says, in place of a renderer that has no place to begin at, what it waits for."""

    detail: str
    needed: bool = True  # now; False: there is no work for it


class RendererProcess(Protocol):
    """The process that renders, as its supervisor uses it, on whichever machine it runs."""

    began: float  # by time.monotonic
    ready: bool  # set by the supervisor, as `unable`
    unable: bool  # to render, as it says itself

    @property
    def link(self) -> Link: ...

    @property
    def task(self) -> int:
        """The task that was worked on when last heard of; 0: none."""

    @property
    def lived_s(self) -> float: ...

    @property
    def id(self) -> int: ...

    def watch(self, excused: bool = False) -> None:
        """Look after it, now and then; `excused`: the server was late, which is not the renderer's fault."""

    async def end(self, patience_s: float) -> Cause:
        """Let it end within that time or kill it; why it died."""


# Starts a renderer: calls the first with each of its messages, and the second once when it is lost. The number is the
# end of a pipe, whose other end the server holds as long as it lives; None: there is none.
Start = Callable[[Callable[[Any], None], Callable[[], None], int | None], RendererProcess]


@dataclass(frozen=True)
class Options:
    device: int | None = None
    software: bool = False  # on the processor, which then need not be the first device
    cores: int | None = None  # for its threads, and for those of its helpers; None: all
    name: str = "0"  # in its log
    patience_s: float = 10.0  # without progress
    memory: int | None = None  # bytes that may be held on the device; None: the worker decides
    host_memory: int | None = None  # the same where that is the machine's memory
    checkpoint_s: float = inf  # between two of a render; inf: none before its end
    ahead: Ahead = "some"
    nice: int = 0  # steps of niceness above the server's


class Begun:
    """A process that was started, and to which nobody listens yet. Raises OSError where none can be started."""

    def __init__(self, options: Options, lifeline: int | None = None) -> None:
        """`lifeline`: the end of a pipe, whose other end the server holds as long as it lives."""
        self.at, self.heartbeat, self.oom_kills = time.monotonic(), _Watched(), _oom_kills()
        self.end, theirs = channel.pair()
        try:
            self.process = _spawn(theirs, self.heartbeat.descriptor, options, lifeline)
        finally:
            theirs.close()
            os.close(self.heartbeat.descriptor)
        self.heartbeat.begin(self.process.pid)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self.end.close()
        self.heartbeat.close()


class EarlyStart:
    """A `Start` whose first process is started now, so that it loads while the server does, which takes as long."""

    def __init__(self, options: Options) -> None:
        self._options, self._lifeline = options, os.pipe()
        self._begun: Begun | None = None
        with suppress(OSError):  # the keeper tries again, and says what was wrong
            self._begun = Begun(options, self._lifeline[0])

    def __call__(
        self, received: Callable[[Any], None], lost: Callable[[], None], lifeline: int | None = None
    ) -> RendererProcess:
        begun, self._begun = self._begun, None
        return Process(self._options, received, lost, lifeline, begun)

    def close(self) -> None:
        """End the process, where nobody has asked for it."""
        if self._begun is not None:
            self._begun.kill()
        for end in self._lifeline:
            os.close(end)


class Process:
    """Calls `received` with each message of the process, and `lost` once when its end of the channel is closed."""

    def __init__(
        self,
        options: Options,
        received: Callable[[Any], None],
        lost: Callable[[], None],
        lifeline: int | None = None,
        begun: Begun | None = None,
    ) -> None:
        """`begun`: the process, where it was started with these options before; `lifeline` is as for `Begun`."""
        begun = begun or Begun(options, lifeline)
        self.began, self.heartbeat, self._options = begun.at, begun.heartbeat, options
        self.ready = False
        self.unable = False  # to render, as it says itself
        self._condemned: Cause | None = None
        self._oom_kills, self._process = begun.oom_kills, begun.process
        self.link = Channel(begun.end, received, lost)

    @property
    def lived_s(self) -> float:
        return time.monotonic() - self.began

    @property
    def task(self) -> int:
        return self.heartbeat.task

    @property
    def id(self) -> int:
        return self._process.pid

    def watch(self, excused: bool = False) -> None:
        """End a renderer that has work and makes no progress; to be called now and then."""
        if excused:
            self.heartbeat.excuse()
        silent_s = self.heartbeat.silent_s(self.link.sent)
        limit_s = self._options.patience_s + TURNS * self.heartbeat.turn_s + self.heartbeat.allowance_s
        limit_s += 0.0 if self.ready else STARTING_S
        if silent_s > limit_s and self._condemned is None:
            self._condemned = "stopped" if _is_stopped(self.id) else "hung"
            fields = {"renderer": self._options.name, "silent_s": round(silent_s, 1), "task": self.heartbeat.task}
            log.error(f"renderer {self._condemned}", fields)
            self._process.kill()

    async def end(self, patience_s: float) -> Cause:
        """Let it end within that time or kill it; why it died. The heartbeat still names its last task."""
        self.link.close()
        code = await _reap(self._process, patience_s)
        self.heartbeat.read()
        self.heartbeat.close()
        if self._condemned is not None:
            return self._condemned
        if code is None:  # its end of the link was closed, and it stayed
            return "hung"
        if code not in KILLS:
            return "crashed"
        # The kernel kills too, where memory has run out; its counter is the machine's, and the best there is.
        return "killed" if _oom_kills() == self._oom_kills else "out of memory"


class _Watched(heartbeat.Heartbeat):
    """A heartbeat with the time since its last beat, in which the process was able to run."""

    def __init__(self) -> None:
        self.descriptor = heartbeat.memory()
        super().__init__(self.descriptor)
        self._beats, self._pid = 0, 0
        self._silence: RunnableTime | None = None

    def begin(self, pid: int) -> None:
        self._pid = pid
        self._silence = RunnableTime(pid)

    def excuse(self) -> None:
        self._silence = None

    def silent_s(self, sent: int) -> float:
        """Seconds without a beat while it owes something: work in hand, or messages not taken."""
        self.read()
        if self.beats != self._beats or (self.task == 0 and self.taken >= sent):
            self._beats, self._silence = self.beats, None
            return 0.0
        if self._silence is None:
            self._silence = RunnableTime(self._pid)
        return self._silence.elapsed_s


def _spawn(
    end: socket.socket, heartbeat_descriptor: int, options: Options, lifeline: int | None
) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "service.worker", str(end.fileno()), str(heartbeat_descriptor)]
    command += ["--server", str(os.getpid()), "--log-level", str(logs.level())]
    command += ["--checkpoint", str(options.checkpoint_s), "--ahead", options.ahead, "--nice", str(options.nice)]
    command += ["--name", options.name, *(["--software"] if options.software else [])]
    command += [] if options.device is None else ["--device", str(options.device)]
    command += [] if options.memory is None else ["--memory", str(options.memory)]
    command += [] if options.host_memory is None else ["--host-memory", str(options.host_memory)]
    command += [] if lifeline is None else ["--lifeline", str(lifeline)]
    # A driver, which nothing confines, works there on strangers' scenes: no key may be in its reach.
    # Its own process group: Ctrl-C in a terminal is for the server, which ends the renderer in good order.
    # The CLI's stdout may be read by a script that waits for its end.
    return subprocess.Popen(
        command,
        env=_environment(options),
        pass_fds=[end.fileno(), heartbeat_descriptor, *([] if lifeline is None else [lifeline])],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        process_group=0,
    )


def _environment(options: Options) -> dict[str, str]:
    inherited = inherited_environment()
    return inherited if options.cores is None else inherited | dict.fromkeys(THREADS, str(options.cores))


async def _reap(process: subprocess.Popen[bytes], patience_s: float) -> int | None:
    """Its exit code; None where it had to be killed. No thread waits: many processes may end at once."""
    until, killed = time.monotonic() + patience_s, False
    while process.poll() is None:
        if not killed and time.monotonic() >= until:
            process.kill()
            killed = True
        await asyncio.sleep(POLL_S)
    return None if killed else process.returncode


def _is_stopped(pid: int) -> bool:
    """True if the process is stopped (SIGSTOP, a debugger): then its silence is not the work's fault."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] in "Tt"
    except OSError:
        return False


def _oom_kills() -> int:
    """How many processes the kernel has killed for want of memory since the machine began; 0 where it doesn't say."""
    try:
        lines = Path("/proc/vmstat").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) for line in lines if line.startswith("oom_kill ")), 0)
