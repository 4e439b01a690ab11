"""The renderer's side of the process that compiles: one kernel at a time, while other tasks are traced."""

from __future__ import annotations

import logging
import os
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from service.ipc import channel
from service.ipc.messages import driver_of
from service.system.cpu_time import RunnableTime
from service.worker.helpers.process import HelperProcess

if TYPE_CHECKING:
    from gpu import KernelKey

TRIES = 3  # failures in a row; then everything is compiled in the loop
LIMIT_S = 60.0  # for one kernel, the helper's start included
SPARE_LIMIT_S = 3600.0  # ... which gets no more of the processor than others leave
REMEMBERED = 256  # kernels in memory; records on the disk tell of the others
RECORDS = 4096  # ... and no more than these: the driver's cache has its own bound
DISABLED = {"1", "true", "yes", "y", "t"}

# now: somebody waits; soon: somebody may in some seconds, and tracing goes on a little slower meanwhile; spare: in
# time that nobody else wants, however long that takes
Priority = Literal["now", "soon", "spare"]

Told = Callable[[float], None]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Compiled:
    """What the helper answers; `cached`: it is in the driver's disk cache."""

    milliseconds: float
    cached: bool
    detail: str = ""


@dataclass
class _CompileRequest:
    key: KernelKey
    told: dict[Told, str] = field(default_factory=dict)  # callers, and the client of each


class CompileClient:
    """Compiles kernels in a process that starts at the first request and ends when idle for a while."""

    def __init__(
        self,
        info: dict[str, Any],
        device: int | None,
        crowded: Callable[[], bool],
        priority: Priority = "now",
        lifeline: int | None = None,
    ) -> None:
        """`info` is the renderer's; `crowded`: somebody would be stalled by compiling in the loop; `lifeline`: its
        process ends with the server, and when the renderer is killed goes on with what it compiles, for the next
        one."""
        self._driver = driver_of(info)
        self._crowded = crowded
        given = ["--driver", self._driver, *([] if device is None else ["--device", str(device)])]
        given += ["--priority", priority]
        self._helper = HelperProcess("service.worker.helpers.compile_main", *given, lifeline=lifeline)
        self._limit_s = LIMIT_S if priority == "now" else SPARE_LIMIT_S
        self._able = _has_cache()
        self._records = records()
        self._known: set[KernelKey] = set()  # kernels that need no helper any more, or that it could not compile
        self._met: set[KernelKey] = set()
        self._orders: list[_CompileRequest] = []  # the first is under way
        self._served: dict[str, int] = {}  # by client: the number of its last kernel
        self._begun = 0
        self._until = 0.0
        self._runnable: RunnableTime | None = None  # of the order under way
        self._failures = 0

    @property
    def ends(self) -> list[socket.socket]:
        """The sockets to wait on."""
        return self._helper.ends

    @property
    def left_s(self) -> float | None:
        """How many more seconds a wait for the kernel under way makes sense."""
        return max(0.0, self._until - time.monotonic()) if self._orders else None

    def knows(self, key: KernelKey) -> bool:
        """Whether nobody needs to wait for this kernel any more."""
        return key in self._known

    def waits(self, key: KernelKey, told: Told, alone: bool = False, client: str = "") -> bool:
        """Whether `told` will be called (from `hear`, with the ms it took) when the kernel should be asked for again:
        it is being compiled. False: it loads at once, or there is no better way than to compile it in the loop, as
        where nobody else is there, unless there is something to do meanwhile (`alone`). Turns go round the clients.
        """
        self.forget(told)
        return self._enlist(key, told, alone, client)

    def _enlist(self, key: KernelKey, told: Told, alone: bool, client: str) -> bool:
        if self.knows(key):
            return False
        order = next((order for order in self._orders if order.key == key), None)
        if order is None:
            if not self._able or not (alone or self._crowded()):
                return False
            if self._is_recorded(key):
                self._known.add(key)
                return False
            order = _CompileRequest(key, {told: client})
            self._orders.append(order)
            if len(self._orders) == 1:
                self._begin()
        if order not in self._orders:  # the helper cannot be started
            return False
        order.told[told] = client
        return True

    def prepare(self, keys: list[KernelKey], client: str = "", told: Told | None = None) -> None:
        """Compile those of the kernels that no renderer here has had yet, although nobody waits for them. With `told`
        they take the place of those that were prepared with it before."""
        if told is not None:
            self.forget(told)
        for key in keys:
            self._enlist(key, told or _nobody, False, client)

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

    def has(self, key: KernelKey) -> bool:
        """Whether the kernel loads at once, from the driver's disk cache."""
        return key in self._met or self._is_recorded(key)

    def _is_recorded(self, key: KernelKey) -> bool:
        return self._able and os.path.exists(self._records / key.digest(self._driver))

    def _record(self, key: KernelKey) -> None:
        """Record that a kernel is in the driver's disk cache."""
        if self._able:
            try:
                self._records.mkdir(parents=True, exist_ok=True)
                (self._records / key.digest(self._driver)).touch()
            except OSError as error:
                log.info("could not record a compiled kernel", {"error": error})

    def forget(self, told: Told) -> None:
        """Drop one caller's wait; a kernel that nobody waits for is not begun."""
        for order in self._orders:
            order.told.pop(told, None)
        self._orders[1:] = [order for order in self._orders[1:] if order.told]

    def hear(self) -> None:
        """Pass answers on to the callers that wait, and begin the next kernel."""
        try:
            answer: Compiled = self._helper.hear()
        except BlockingIOError:
            if not self._orders or time.monotonic() < self._until or self._is_starved():
                return
            self._ended(f"it took more than {self._limit_s:.0f} s")
        except channel.Closed:
            self._ended("the compiler's process ended unexpectedly")
        else:
            self._failures = 0 if answer.cached else self._failures + 1
            if not answer.cached:
                log.warning("compiled ahead in vain: the driver has no disk cache to write to")
            if answer.detail:
                log.debug("could not compile ahead", {"error": answer.detail, "ms": round(answer.milliseconds)})
            else:
                log.debug("compiled ahead", {"ms": round(answer.milliseconds)})
            if answer.cached and not answer.detail:
                self._record(self._orders[0].key)
            self._tell(answer.milliseconds)
        if self._orders:
            self._begin()

    def _is_starved(self) -> bool:
        """Whether the process lacked a processor for some of its time; its limit grows by that much."""
        left_s = 0.0 if self._runnable is None else self._limit_s - self._runnable.elapsed_s
        self._until = time.monotonic() + left_s
        return left_s > 0

    def close(self) -> None:
        self._helper.close()

    def _ended(self, detail: str) -> None:
        self.close()
        if self._orders:
            self._failures += 1
            log.warning("left a kernel to be compiled in the loop", {"reason": detail})
            self._tell(0.0)

    def _tell(self, milliseconds: float) -> None:
        order = self._orders.pop(0)
        self._known.add(order.key)
        for told in order.told:
            told(milliseconds)

    def _begin(self) -> None:
        """Send the next request; where the process cannot be started, all callers are told to compile themselves."""
        self._choose()
        try:
            if self._failures < TRIES:
                self._helper.ask(self._orders[0].key)
                self._until = time.monotonic() + self._limit_s
                self._runnable = None if self._helper.process_id is None else RunnableTime(self._helper.process_id)
                return
        except (channel.Closed, OSError) as error:  # it can't be started
            log.info("could not start the compiler", {"error": error or "it had ended"})
            self.close()
        self._able = False
        log.warning("gave up compiling ahead: kernels are compiled in the loop")
        while self._orders:
            self._tell(0.0)

    def _choose(self) -> None:
        """Put the order first whose client was served longest ago; equal ones keep their order."""
        first = min(
            self._orders, key=lambda order: min((self._served.get(c, 0) for c in order.told.values()), default=0)
        )
        self._orders.remove(first)
        self._orders.insert(0, first)
        self._begun += 1
        if len(self._served) > REMEMBERED:
            self._served.clear()
        self._served |= dict.fromkeys(first.told.values(), self._begun)


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
    base = os.environ.get("MESA_SHADER_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "sunbox" / "kernels"
