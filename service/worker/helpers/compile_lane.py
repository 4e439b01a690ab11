"""The queue of one priority's kernels, and the process that compiles them one by one."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from service.ipc import channel
from service.system.child_processes import signal_name
from service.system.cpu import RunnableTime
from service.system.turns import Turns
from service.worker.helpers.process import HelperProcess

if TYPE_CHECKING:
    from gpu import KernelKey

TRIES = 3  # processes that did not start, in a row; and processes that were killed at one kernel
# A process is replaced after this many kernels, or where it holds more than this when it has compiled one: LLVM keeps
# what it took.
MOST_KERNELS, MOST_RESIDENT = 32, 512 << 20

Done = Callable[[float], None]  # called with the milliseconds that a kernel took


@dataclass(frozen=True)
class Started:
    """A helper has its context, and begins with the kernels that it was sent: what ends it from now on is theirs."""


@dataclass(frozen=True)
class Compiled:
    """A helper's answer; `cached`: the kernel is in the driver's disk cache. `detail`: the driver refused it."""

    milliseconds: float
    cached: bool
    detail: str = ""
    resident: int = 0  # bytes that the helper holds now
    spent_s: float = 0.0  # of a processor since its last answer, or since its start


@dataclass(frozen=True)
class Refused:
    """No process compiles the kernel, and why."""

    detail: str


@dataclass
class Lane:
    helper: HelperProcess
    limit_s: float  # for one kernel, the process's start included
    memory: int = 0  # bytes that its process may take for kernels, for what is said of one that needs more
    begins: float = 0.0  # by the monotonic clock: nothing is compiled before
    paused: bool = False
    wanted: dict[KernelKey, dict[Done, str]] = field(default_factory=dict)  # callbacks, and the client of each
    key: KernelKey | None = None  # the one under way
    until: float = 0.0  # by the monotonic clock: when it takes too long
    runnable: RunnableTime | None = None  # of its process since it began
    started: bool = False  # the process has a context, and compiles
    compiled: int = 0  # kernels, by this process
    killed: dict[KernelKey, int] = field(default_factory=dict)  # how often the process was, at a kernel
    failures: int = 0  # in a row: processes that did not start, and kernels that the driver did not keep
    spent_s: float = 0.0  # of a processor, by all of its processes
    turns: Turns = field(default_factory=Turns)  # of the clients

    @property
    def left_s(self) -> float | None:
        """How many more seconds a wait makes sense for the kernel under way, or for the first one; None: for none."""
        if self.key is None and (not self.wanted or self.paused):
            return None
        return max(0.0, (self.begins if self.key is None else self.until) - time.monotonic())

    @property
    def is_due(self) -> bool:
        """True if the next kernel can be begun."""
        return self.key is None and bool(self.wanted) and not self.paused and time.monotonic() >= self.begins

    def pause(self, is_paused: bool) -> None:
        """Begin no kernel, and stop the process of the one under way."""
        self.paused = is_paused
        self.helper.pause(is_paused)

    def forget(self, done: Done) -> None:
        for key, callers in list(self.wanted.items()):
            callers.pop(done, None)
            if not callers and key != self.key:
                del self.wanted[key]

    def choose(self) -> KernelKey:
        """The next kernel: of the client whose turn is the longest ago, or that came first."""
        first = {key: min(map(self.turns.last, callers.values()), default=0) for key, callers in self.wanted.items()}
        self.key = min(self.wanted, key=lambda key: first[key])
        self.turns.had(*self.wanted[self.key].values())
        return self.key

    def begin(self) -> None:
        """Have the next kernel compiled. Raises channel.Closed and OSError where no process can be started."""
        before = self.helper.process_id
        self.helper.ask(self.choose())
        if self.helper.process_id != before:
            self.started, self.compiled = False, 0
        self.until = time.monotonic() + self.limit_s
        self.runnable = None if self.helper.process_id is None else RunnableTime(self.helper.process_id)

    def hear(self) -> Compiled | Refused | None:
        """The result of the kernel under way; None where there is none yet. A kernel whose process did not start, or
        was killed by somebody, is in line again."""
        try:
            answer: Started | Compiled = self.helper.hear()
        except BlockingIOError:
            if not self.is_late():
                return None
            self.helper.close()
            return Refused(f"it takes more than {self.limit_s:.0f} s")
        except channel.Closed:
            return self._lost(self.helper.close())
        if isinstance(answer, Started):
            self.started = True
            return None
        self.failures = 0 if answer.cached else self.failures + 1
        self.compiled += 1
        self.spent_s += answer.spent_s
        if self.compiled >= MOST_KERNELS or answer.resident > MOST_RESIDENT:
            self.helper.close()
        return answer

    def _lost(self, exit_code: int) -> Refused | None:
        if self.key is None:  # it ended because it was idle
            return None
        if not self.started:
            self.failures += 1
        elif exit_code == -signal.SIGKILL:  # perhaps by the kernel, as the machine's memory had run out
            self.killed[self.key] = self.killed.get(self.key, 0) + 1
            if self.killed[self.key] >= TRIES:
                return Refused(f"its compiler was killed {TRIES} times")
        else:
            most = f"as it does where it needs more than {self.memory >> 20} MiB of memory"
            return Refused(f"its compiler ended ({signal_name(exit_code)}), {most}")
        if not self.wanted[self.key]:
            del self.wanted[self.key]  # nobody waits for it any more
        self.key = None
        return None

    def end(self) -> dict[Done, str]:
        """Take the kernel under way out of the line. Returns its callbacks."""
        assert self.key is not None
        key, self.key = self.key, None
        self.killed.pop(key, None)
        return self.wanted.pop(key)

    def is_late(self) -> bool:
        """True if the kernel takes too long. The time that its process waited for a processor does not count."""
        if self.key is None or time.monotonic() < self.until:
            return False
        left_s = 0.0 if self.runnable is None else self.limit_s - self.runnable.elapsed_s
        self.until = time.monotonic() + left_s
        return left_s <= 0
