"""The renderer's side of the processes that compile kernels ahead, while other tasks are traced."""

from __future__ import annotations

import logging
import os
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from gpu import cache_folder
from service.ipc import channel
from service.ipc.messages import driver_of
from service.system.cpu_time import RunnableTime
from service.worker.helpers.process import HelperProcess

if TYPE_CHECKING:
    from gpu import KernelKey

TRIES = 3  # failures in a row; then everything is compiled in the loop
LIMIT_S = 60.0  # for one kernel, the helper's start included
GPU_LIMIT_S = 300.0  # ... on a GPU: NVIDIA's compiler takes 20 s for most kernels, and a minute for some
SPARE_LIMIT_S = 3600.0  # ... which gets no more of the processor than others leave
# What may be needed some time begins no earlier than this after the renderer: its user has seen a picture by then, or
# it was there for one picture alone.
# A kernel can take a minute, and is compiled from its beginning again where the renderer ends first.
SPARE_AFTER_S = 20.0
REMEMBERED = 256  # kernels in memory; records on the disk tell of the others
RECORDS = 4096  # ... and no more than these: the driver's cache has its own bound
DISABLED = {"1", "true", "yes", "y", "t"}

# now: somebody waits; soon: somebody may in some seconds, and tracing goes on a little slower meanwhile; spare: in
# time that nobody else wants, some time after the start, however long that takes
Priority = Literal["now", "soon", "spare"]

Done = Callable[[float], None]  # called with the milliseconds that a kernel took

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Compiled:
    """What a helper answers; `cached`: the kernel is in the driver's disk cache."""

    milliseconds: float
    cached: bool
    detail: str = ""


@dataclass
class _Lane:
    """The kernels of one priority, and the process that compiles them one by one."""

    helper: HelperProcess
    limit_s: float
    begins: float = 0.0  # by the monotonic clock: nothing is compiled before
    wanted: dict[KernelKey, dict[Done, str]] = field(default_factory=dict)  # whom to call, and the client of each
    key: KernelKey | None = None  # the one under way
    until: float = 0.0  # by the monotonic clock: when it takes too long
    runnable: RunnableTime | None = None  # of its process since it began
    failures: int = 0  # in a row
    begun: int = 0
    served: dict[str, int] = field(default_factory=dict)  # by client: the number of its last kernel

    @property
    def left_s(self) -> float | None:
        """How many more seconds a wait makes sense for the kernel under way, or for the first one; None: for none."""
        if self.key is None and not self.wanted:
            return None
        return max(0.0, (self.begins if self.key is None else self.until) - time.monotonic())

    @property
    def is_due(self) -> bool:
        """Whether the next kernel can be begun."""
        return self.key is None and bool(self.wanted) and time.monotonic() >= self.begins

    def forget(self, done: Done) -> None:
        for key, callers in list(self.wanted.items()):
            callers.pop(done, None)
            if not callers and key != self.key:
                del self.wanted[key]

    def choose(self) -> KernelKey:
        """The next kernel: of the client that was served longest ago, or that came first."""
        served = {k: min((self.served.get(c, 0) for c in who.values()), default=0) for k, who in self.wanted.items()}
        self.key = min(self.wanted, key=lambda key: served[key])
        self.begun += 1
        if len(self.served) > REMEMBERED:
            self.served.clear()
        self.served |= dict.fromkeys(self.wanted[self.key].values(), self.begun)
        return self.key

    def is_late(self) -> bool:
        """Whether the kernel takes too long. The time that its process waited for a processor does not count."""
        if self.key is None or time.monotonic() < self.until:
            return False
        left_s = 0.0 if self.runnable is None else self.limit_s - self.runnable.elapsed_s
        self.until = time.monotonic() + left_s
        return left_s <= 0


class CompileClient:
    """A queue of kernels with three priorities, and which kernels need not be compiled any more.

    Each priority has a process of its own, which starts at the first request and ends when idle for a while. So the
    system preempts what is foreseen where somebody waits, and nothing is lost: one process could only be killed, and
    would begin again with up to a minute of compiling, after 0.4 s of a core for its start. Nor can a process that
    has lowered its priority raise it again."""

    def __init__(
        self,
        info: dict[str, Any],
        device: int | None,
        crowded: Callable[[], bool],
        lifeline: int | None = None,
        foresees: bool = True,
    ) -> None:
        """`info` is the renderer's; `crowded`: compiling in the loop would stall somebody. `lifeline`: the process
        for "now" ends with the server; where only the renderer is killed it finishes its kernel, for the next one.
        Without `foresees` only kernels that somebody waits for are compiled."""
        self.foresees = foresees
        self._driver = driver_of(info)
        self._crowded = crowded
        self._keeps = None if info["software"] else info  # where kernels are kept by us, and no record is needed
        self._able = self._keeps is not None or _has_cache()
        self._records = records()
        self._known: set[KernelKey] = set()  # kernels that are compiled, or that no helper could compile
        self._met: set[KernelKey] = set()  # those of them that the renderer has loaded
        self._lanes = dict[Priority, _Lane]()
        given = ["--driver", self._driver, *([] if device is None else ["--device", str(device)])]
        limit_s = LIMIT_S if info["software"] else GPU_LIMIT_S
        for each in get_args(Priority):
            line = lifeline if each == "now" else None
            helper = HelperProcess("service.worker.helpers.compile_main", *given, "--priority", each, lifeline=line)
            self._lanes[each] = _Lane(helper, limit_s if each == "now" else SPARE_LIMIT_S)
        self._lanes["spare"].begins = time.monotonic() + SPARE_AFTER_S

    @property
    def ends(self) -> list[socket.socket]:
        """The sockets to wait on."""
        return [end for lane in self._lanes.values() for end in lane.helper.ends]

    @property
    def left_s(self) -> float | None:
        """In how many seconds `hear` has to look whether a kernel takes too long; None: there is none under way."""
        return min((left for lane in self._lanes.values() if (left := lane.left_s) is not None), default=None)

    def is_idle(self, priority: Priority) -> bool:
        return not self._lanes[priority].wanted

    def knows(self, key: KernelKey) -> bool:
        """Whether nobody needs to wait for this kernel any more."""
        return key in self._known

    def has(self, key: KernelKey) -> bool:
        """Whether the kernel loads at once, from the driver's disk cache."""
        return key in self._met or self._is_recorded(key)

    def queue(self, key: KernelKey, done: Done, alone: bool = False, client: str = "") -> bool:
        """Queue a kernel that a task waits for, in the place of what `done` waited for; whether `hear` will call
        `done`. Turns go round the clients.

        False: use it now. It is compiled already, or compiling it in the loop stalls nobody; `alone`: not even then,
        as there is something to show meanwhile."""
        lane = self._lanes["now"]
        lane.forget(done)
        if key in self._known:
            return False
        if key not in lane.wanted and (not (alone or self._crowded()) or self._is_compiled(key)):
            return False
        return self._add(lane, key, done, client)

    def prepare(self, keys: list[KernelKey], priority: Priority, client: str = "", done: Done | None = None) -> None:
        """Queue the kernels that are not compiled, although nobody waits for them. With `done` they take the place of
        those that were prepared with it before."""
        if not self.foresees:
            return
        lane = self._lanes[priority]
        if done is not None:
            lane.forget(done)
        for key in keys:
            if not self._is_compiled(key):
                self._add(lane, key, done or _nobody, client)

    def forget(self, done: Done) -> None:
        """Drop one caller's wait; a kernel that nobody waits for is not begun."""
        self._lanes["now"].forget(done)

    def met(self, key: KernelKey) -> None:
        """Note that the renderer has this kernel, and so has the driver's disk cache."""
        if key in self._met:
            return
        if len(self._known) >= REMEMBERED:  # the records know them, too
            self._known.clear()
            self._met.clear()
            _prune(self._records)
        self._known.add(key)
        self._met.add(key)
        self._record(key)

    def hear(self) -> None:
        """Call those whose kernels are compiled, and begin the next ones."""
        for lane in self._lanes.values():
            self._hear(lane)

    def close(self) -> None:
        for lane in self._lanes.values():
            lane.helper.close()

    def _add(self, lane: _Lane, key: KernelKey, done: Done, client: str) -> bool:
        """Queue a kernel or join who waits for it. False: no helper can be started."""
        if key in lane.wanted:
            lane.wanted[key][done] = client
        elif self._able:
            lane.wanted[key] = {done: client}
            if lane.is_due:
                self._begin(lane)
        return key in lane.wanted

    def _is_compiled(self, key: KernelKey) -> bool:
        if key not in self._known and self._is_recorded(key):
            self._known.add(key)
        return key in self._known

    def _is_recorded(self, key: KernelKey) -> bool:
        if self._keeps is not None and key.is_ours:
            return key.is_kept(self._keeps)
        return self._able and os.path.exists(self._records / key.digest(self._driver))

    def _record(self, key: KernelKey) -> None:
        """Record that a kernel is in the driver's disk cache."""
        if self._able:
            try:
                self._records.mkdir(parents=True, exist_ok=True)
                (self._records / key.digest(self._driver)).touch()
            except OSError as error:
                log.info("could not record a compiled kernel", {"error": error})

    def _begin(self, lane: _Lane) -> None:
        """Send the next request; where the process cannot be started, all callers compile for themselves."""
        try:
            if self._able and lane.failures < TRIES:
                lane.helper.ask(lane.choose())
                lane.until = time.monotonic() + lane.limit_s
                lane.runnable = None if lane.helper.process_id is None else RunnableTime(lane.helper.process_id)
                return
        except (channel.Closed, OSError) as error:  # it can't be started
            log.info("could not start the compiler", {"error": error or "it had ended"})
            lane.helper.close()
        self._able = False
        log.warning("gave up compiling ahead: kernels are compiled in the loop")
        for key in list(lane.wanted):
            self._end(lane, key, 0.0)

    def _hear(self, lane: _Lane) -> None:
        try:
            answer: Compiled = lane.helper.hear()
        except BlockingIOError:
            if lane.is_late():
                self._give_up(lane, f"it took more than {lane.limit_s:.0f} s")
        except channel.Closed:
            self._give_up(lane, "the compiler's process ended unexpectedly")
        else:
            assert lane.key is not None
            lane.failures = 0 if answer.cached else lane.failures + 1
            if not answer.cached:
                log.warning("compiled ahead in vain: the driver has no disk cache to write to")
            if answer.detail:
                log.debug("could not compile ahead", {"error": answer.detail, "ms": round(answer.milliseconds)})
            else:
                log.debug("compiled ahead", {"ms": round(answer.milliseconds)})
            if answer.cached and not answer.detail:
                self._record(lane.key)
            self._end(lane, lane.key, answer.milliseconds)
        if lane.is_due:
            self._begin(lane)

    def _give_up(self, lane: _Lane, detail: str) -> None:
        """End the process, and have the kernel under way compiled in the loop."""
        lane.helper.close()
        if lane.key is not None:
            lane.failures += 1
            log.warning("left a kernel to be compiled in the loop", {"reason": detail})
            self._end(lane, lane.key, 0.0)

    def _end(self, lane: _Lane, key: KernelKey, milliseconds: float) -> None:
        lane.key = None
        self._known.add(key)
        for done in lane.wanted.pop(key):
            done(milliseconds)


def _nobody(milliseconds: float) -> None:
    """A caller that does not wait."""


def _has_cache() -> bool:
    """Whether the environment leaves the driver's disk cache on; the helper finds out the rest."""
    disabled = ("MESA_SHADER_CACHE_DISABLE", "MESA_GLSL_CACHE_DISABLE")
    if any(os.environ.get(name, "").lower() in DISABLED for name in disabled):
        return False
    return os.environ.get("__GL_SHADER_DISK_CACHE") != "0"


def _prune(records: Path) -> None:
    """Delete the older half of the records where there are too many."""
    with suppress(OSError):  # another server's renderer prunes them as well
        found = sorted(records.iterdir(), key=lambda path: path.stat().st_mtime)
        for path in found[: len(found) - RECORDS // 2] if len(found) > RECORDS else []:
            path.unlink(missing_ok=True)


def records() -> Path:
    """The folder beside the driver's cache in which an empty file says that a kernel is in there."""
    return cache_folder() / "kernels"
