"""The renderer's side of the processes that compile kernels, while other tasks are traced.

The renderer only loads kernels from the driver's disk cache. It compiles them itself where there is no such cache, or
where no process can be started.
"""

from __future__ import annotations

import json
import logging
import os
import socket
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, get_args

from gpu import CompileError, KernelKey, cache_folder
from service.ipc import channel
from service.ipc.messages import driver_of
from service.system.memory import machine_memory
from service.worker.helpers.compile_lane import TRIES, Compiled, Done, Lane, Refused
from service.worker.helpers.process import HelperProcess

MOST = 32  # kernels: a minute of LLVM's time

LIMIT_S = 300.0  # for one kernel that somebody waits for: LLVM takes up to a minute, NVIDIA's compiler as well
SPARE_LIMIT_S = 3600.0  # ... and for one that gets no more of the processor than others leave
# Bytes that a process may take for kernels, beside its context, by whether the processor is the device: LLVM was seen
# to take 0.7 GB for one. Never more than half of the machine's memory.
MEMORY = {True: 2 << 30, False: 8 << 30}
# Processes of a priority beside a GPU, whose context takes up to 0.4 GB of it, and the machine's cores for each.
MOST_COMPILERS, CORES_A_COMPILER = 4, 4
REFUSED_S = 600.0  # before a kernel that failed is tried again
ALONE_S = 60.0  # for which kernels are compiled by the renderer where no process could be started
# Idle-time compiles start this many seconds after the renderer, so that short-lived renderers never begin one: a
# kernel can take a minute, and is compiled from its beginning again where the renderer ends first.
SPARE_AFTER_S = 20.0
REMEMBERED = 256  # kernels in memory; records on the disk tell of the others
RECORDS = 4096  # ... and no more than these: the driver's cache has its own bound
DISABLED = {"1", "true", "yes", "y", "t"}

# now: somebody waits; soon: somebody may in some seconds, and tracing goes on a little slower meanwhile; spare: in
# time that nobody else wants, some time after the start, however long that takes
Priority = Literal["now", "soon", "spare"]

log = logging.getLogger(__name__)


class CompileClient:
    """A queue of kernels with three priorities, and which kernels need not be compiled any more.

    Each priority has processes of its own, which start at the first request and end when idle for a while: one, or
    several where a GPU renders and leaves the cores idle. So the system preempts what is foreseen where somebody
    waits, and nothing is lost: one process for all could only be killed, and would begin again with up to a minute of
    compiling, after 0.4 s of a core for its start. Nor can a process that has lowered its priority raise it again."""

    def __init__(
        self,
        info: dict[str, Any],
        device: int | None,
        lifeline: int | None = None,
        foresees: bool = True,
    ) -> None:
        """`info` is the renderer's. `lifeline`: the process for "now" ends with the server; where only the renderer
        is killed it finishes its kernel, for the next one. Without `foresees` only kernels that somebody waits for
        are compiled."""
        self.foresees = foresees
        self._driver = driver_of(info)
        self._keeps = None if info["software"] else info  # where kernels are kept by us, and no record is needed
        self._able = self._keeps is not None or _has_cache()
        self._alone_until = 0.0  # by the monotonic clock: no process can be started
        self._records = records()
        self._used = UsedKernels(cache_folder() / "used.json")
        self._needs_no_wait: set[KernelKey] = set()  # kernels that are compiled, or that the driver does not keep
        self._refused: dict[KernelKey, tuple[str, float]] = {}  # why, and until when it holds
        self._loaded: set[KernelKey] = set()  # those of them that the renderer has loaded
        self._lanes: dict[Priority, list[Lane]] = {}
        given = ["--driver", self._driver, *([] if device is None else ["--device", str(device)])]
        memory = compiler_memory(info)
        given += ["--memory", str(memory)]
        for each in get_args(Priority):
            line, limit_s = (lifeline, LIMIT_S) if each == "now" else (None, SPARE_LIMIT_S)
            begins = time.monotonic() + SPARE_AFTER_S if each == "spare" else 0.0
            self._lanes[each] = [
                Lane(
                    HelperProcess("service.worker.helpers.compile_main", *given, "--priority", each, lifeline=line),
                    limit_s, memory, begins,
                )
                for _ in range(compilers(info["software"], len(os.sched_getaffinity(0))))
            ]  # fmt: skip

    @property
    def _all_lanes(self) -> Iterator[Lane]:
        return (lane for lanes in self._lanes.values() for lane in lanes)

    @property
    def ends(self) -> list[socket.socket]:
        """The sockets to wait on."""
        return [end for lane in self._all_lanes for end in lane.helper.ends]

    @property
    def left_s(self) -> float | None:
        """In how many seconds `hear` has to look whether a kernel takes too long; None: there is none under way."""
        return min((left for lane in self._all_lanes if (left := lane.left_s) is not None), default=None)

    @property
    def spare_s(self) -> float:
        """Seconds of a processor that went into kernels that nobody waited for."""
        return sum(lane.spent_s for lane in (*self._lanes["soon"], *self._lanes["spare"]))

    def used(self) -> Iterator[KernelKey]:
        """The kernels that pictures were made with on this machine, the latest first."""
        return self._used.latest_first()

    def is_idle(self, priority: Priority) -> bool:
        """True if one of its processes has nothing to do."""
        return not all(lane.wanted for lane in self._lanes[priority])

    def needs_no_wait(self, key: KernelKey) -> bool:
        """True once this kernel is compiled, or the driver cannot keep it: waiting for it would gain nothing."""
        return key in self._needs_no_wait

    def on_disk(self, key: KernelKey) -> bool:
        """True where the kernel loads at once, from the driver's disk cache."""
        return key in self._loaded or self._is_recorded(key)

    @property
    def able(self) -> bool:
        """True if kernels are compiled by processes: there is a cache to compile into, and they can be started."""
        return self._able and time.monotonic() >= self._alone_until

    def queue(self, key: KernelKey, done: Done, client: str = "") -> bool:
        """Queue a kernel that a task waits for, in the place of what `done` waited for; whether `hear` will call
        `done`. Turns go round the clients.

        False: use it now. It is compiled already, or no process can compile it. Raises CompileError where it was
        found that none can be made."""
        for lane in self._lanes["now"]:
            lane.forget(done)
        if self._is_compiled(key):
            return False
        if (detail := self._refusal(key)) is not None:
            raise CompileError(f"the scene's kernel could not be compiled: {detail}")
        return self._add("now", key, done, client)

    def prepare(self, keys: list[KernelKey], priority: Priority, client: str = "", done: Done | None = None) -> None:
        """Queue the kernels that are not compiled, although nobody waits for them. With `done` they take the place of
        those that were prepared with it before."""
        if not self.foresees:
            return
        if done is not None:
            for lane in self._lanes[priority]:
                lane.forget(done)
        for key in keys:
            if not self._is_compiled(key) and self._refusal(key) is None:
                self._add(priority, key, done or _nobody, client)

    def forget(self, done: Done) -> None:
        """Drop what one caller waits for, or had foreseen; a kernel that nobody else wants is not begun."""
        for lane in self._all_lanes:
            lane.forget(done)

    def loaded(self, key: KernelKey) -> None:
        """Note that the renderer has this kernel, and so has the driver's disk cache."""
        if key in self._loaded:
            return
        if len(self._needs_no_wait) >= REMEMBERED:  # the records know them, too
            self._needs_no_wait.clear()
            self._loaded.clear()
            _prune(self._records)
        self._needs_no_wait.add(key)
        self._loaded.add(key)
        self._record(key)
        if self.foresees:
            self._used.note(key)

    def hear(self) -> None:
        """Call those whose kernels are compiled, and begin the next ones."""
        for lane in self._all_lanes:
            self._hear(lane)
        self._give_way()

    def close(self) -> None:
        for lane in self._all_lanes:
            lane.helper.close()

    def _give_way(self) -> None:
        """Compile nothing for nobody where somebody waits for a kernel: on two cores that took 1.5 times as long."""
        waited_for, *others = self._lanes["now"]
        for lane in (*self._lanes["soon"], *self._lanes["spare"]):
            lane.pause(waited_for.key is not None and not others)
            if lane.is_due:
                self._begin(lane)

    def _add(self, priority: Priority, key: KernelKey, done: Done, client: str) -> bool:
        """Queue a kernel, where the line is shortest, or join its callers. False: no helper can be started."""
        lane = min(self._lanes[priority], key=lambda lane: (key not in lane.wanted, len(lane.wanted)))
        if key in lane.wanted:
            lane.wanted[key][done] = client
        elif self.able:
            lane.wanted[key] = {done: client}
            if lane.is_due:
                self._begin(lane)
            self._give_way()
        return key in lane.wanted

    def _is_compiled(self, key: KernelKey) -> bool:
        if key not in self._needs_no_wait and self._is_recorded(key):
            self._needs_no_wait.add(key)
        return key in self._needs_no_wait

    def _is_recorded(self, key: KernelKey) -> bool:
        if self._keeps is not None and key.is_ours:
            return key.is_cached(self._keeps)
        return self._able and os.path.exists(self._records / key.digest(self._driver))

    def _refusal(self, key: KernelKey) -> str | None:
        """Why the kernel cannot be compiled, as was found lately."""
        detail, until = self._refused.get(key, ("", 0.0))
        return detail if time.monotonic() < until else None

    def _record(self, key: KernelKey) -> None:
        """Record that a kernel is in the driver's disk cache."""
        if self._able:
            try:
                self._records.mkdir(parents=True, exist_ok=True)
                (self._records / key.digest(self._driver)).touch()
            except OSError as error:
                log.info("could not record a compiled kernel", {"error": error})

    def _begin(self, lane: Lane) -> None:
        """Send the next request; where no process can be started, all callers compile for themselves for a while."""
        try:
            if self.able and lane.failures < TRIES:
                lane.begin()
                return
        except (channel.Closed, OSError) as error:
            log.info("could not start the compiler", {"error": error or "it had ended"})
            lane.helper.close()
        self._alone_until = time.monotonic() + ALONE_S
        lane.failures, lane.key = TRIES - 1, None
        log.warning("no process can compile kernels: the renderer does, and others wait", {"s": round(ALONE_S)})
        for callers in [lane.wanted.pop(key) for key in list(lane.wanted)]:
            for done in callers:
                done(0.0)

    def _hear(self, lane: Lane) -> None:
        key, ended = lane.key, lane.hear()
        if ended is not None:
            assert key is not None
            callers, milliseconds = lane.end(), 0.0
            if isinstance(ended, Refused) or ended.detail:
                self._refuse(key, ended.detail)
            else:
                milliseconds = ended.milliseconds
                self._note(key, ended)
            for done in callers:
                done(milliseconds)
        if lane.is_due:
            self._begin(lane)

    def _note(self, key: KernelKey, compiled: Compiled) -> None:
        """A process has compiled the kernel: the renderer loads it now, unless the driver keeps none."""
        log.debug("compiled ahead", {"ms": round(compiled.milliseconds)})
        self._needs_no_wait.add(key)
        if compiled.cached:
            self._record(key)
        else:
            log.warning("compiled ahead in vain: the driver has no disk cache to write to")

    def _refuse(self, key: KernelKey, detail: str) -> None:
        """Refuse the kernel: neither a helper nor the renderer compiles it, and its callers get the reason."""
        log.warning("a kernel could not be compiled", {"entry": key.entry, "error": detail})
        if len(self._refused) >= REMEMBERED:
            self._refused.clear()
        self._refused[key] = detail, time.monotonic() + REFUSED_S


def compilers(is_software: bool, cores: int) -> int:
    """The number of processes of a priority. On the processor one: compiling takes time from tracing."""
    return 1 if is_software else max(1, min(MOST_COMPILERS, cores // CORES_A_COMPILER))


def compiler_memory(info: dict[str, Any]) -> int:
    """Bytes that a process may take for kernels, beside its context; `info` is the renderer's."""
    return min(MEMORY[info["software"]], machine_memory() // 2)


def _nobody(milliseconds: float) -> None:
    """A caller that does not wait."""


def _has_cache() -> bool:
    """True if the environment leaves the driver's disk cache on; the helper finds out the rest."""
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


class UsedKernels:
    """A record of the kernels that pictures were made with on this machine, the latest last. A new version of Sunbox
    or of the driver needs all of them anew: those that were used here are compiled first.

    It is a file, which other renderers of this user's may write as well: the last one has the last word.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._noted = set[KernelKey]()

    def note(self, key: KernelKey) -> None:
        """Put a kernel at the record's end, at its first use by this process."""
        if key in self._noted:
            return
        self._noted.add(key)
        recent = [each for each in self._read() if each != key][1 - MOST :]
        temporary = self._path.with_name(f"{self._path.name}.{os.getpid()}")
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_text(json.dumps([_plain(each) for each in [*recent, key]]))
            temporary.replace(self._path)
        except OSError as error:
            log.info("could not record a kernel that is used", {"error": error})

    def latest_first(self) -> Iterator[KernelKey]:
        """Those that this version of the shaders still has. To look at one takes some milliseconds."""
        return filter(_is_known, reversed(self._read()))

    def _read(self) -> list[KernelKey]:
        with suppress(OSError, ValueError, TypeError, KeyError):  # nothing is there yet, or another version wrote it
            return [_key(each) for each in json.loads(self._path.read_text())]
        return []


def _plain(key: KernelKey) -> dict[str, Any]:
    return {"entry": key.entry, "defines": dict(key.defines), "textures": key.textures}


def _key(plain: dict[str, Any]) -> KernelKey:
    textures = tuple((unit, channels, dtype, w, h) for unit, channels, dtype, w, h in plain["textures"])
    return KernelKey(tuple(plain["defines"].items()), textures, plain["entry"])


def _is_known(key: KernelKey) -> bool:
    try:
        return bool(key.text)
    except CompileError:  # the shaders have another flag now, or the file is gone
        return False
