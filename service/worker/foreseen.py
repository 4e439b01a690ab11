"""Kernels that are compiled before anything needs them. In a renderer: for nobody who is there, at the lowest
priority, one for each idle compiler, and within a bound. Before there is a renderer: into the driver's cache,
several at a time, each in its process.
"""

from __future__ import annotations

import multiprocessing
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from gpu import KernelKey, Renderer, software_device
from gpu.precompile import kernel_keys
from service.ipc.messages import Foresee, driver_of
from service.worker.device.loaded_scene import begin_key, slider_keys
from service.worker.helpers.compile_client import CompileClient, records

if TYPE_CHECKING:
    from gpu.precompile.precompiler import Precompiler


BUDGET_S = 60.0  # of a processor, after a start, for "some"
LONGEST_S = 10.0  # that one kernel takes: none is begun for which less is left

SUPPLIES = Path("/sys/class/power_supply")  # Linux' power supply class
QUOTA = Path("/sys/fs/cgroup/cpu.max")  # of a control group, version 2: microseconds of a processor, of how many

OnProgress = Callable[[int, int], None]

_compiling: list[Precompiler] = []  # the one of a process that compiles


class ForeseenKernels:
    """Handed to the compilers one by one: those that were used here before, then those of scenes with which a
    client may begin or go on, then those of panels."""

    def __init__(self, compiler: CompileClient, bounded: bool = True) -> None:
        """Without a bound the sliders of all these scenes are foreseen, too."""
        self._compiler = compiler
        self._used = compiler.used() if compiler.foresees else iter(())
        self._scenes = deque[KernelKey]()
        self._sliders = deque[KernelKey]()
        self._panels = kernel_keys.bsdf_keys()
        self._bounded = bounded
        self._begun = False  # scenes have come: panels are not the first

    def add(self, message: Foresee) -> None:
        """Take a scene with which a client may begin or go on."""
        self._begun = True
        self._scenes.append(begin_key(message))
        if not self._bounded:
            self._sliders += slider_keys(message)

    def prepare(self) -> bool:
        """Hand on a kernel, if it is time for one; whether it was."""
        compiler = self._compiler
        budget_s = BUDGET_S - LONGEST_S if self._bounded else inf
        if not compiler.foresees or not compiler.is_idle("spare") or compiler.spare_s >= budget_s:
            return False
        if not has_power_to_spare() or (key := self._next()) is None:
            return False
        compiler.prepare([key], "spare")
        return True

    def _next(self) -> KernelKey | None:
        if (key := next(self._used, None)) is not None:
            return key
        for line in (self._scenes, self._sliders):
            if line:
                return line.popleft()
        return next(self._panels, None) if self._begun else None


def has_power_to_spare() -> bool:
    """False on battery, and in a container that gets less than one whole processor."""
    return not _on_battery() and _processors() >= 1.0


def _on_battery() -> bool:
    """True if there is a battery and no adapter is plugged in."""
    kinds = [(_read(each / "type"), _read(each / "online")) for each in SUPPLIES.glob("*")]
    return any(kind == "Battery" for kind, _ in kinds) and ("Mains", "1") not in kinds and ("USB", "1") not in kinds


def _processors() -> float:
    """How many processors' time this process's control group may use; infinite where there is no bound."""
    quota, _, period = _read(QUOTA).partition(" ")
    return int(quota) / int(period) if quota.isdigit() and period.isdigit() and int(period) else float("inf")


def _read(path: Path) -> str:
    with suppress(OSError):
        return path.read_text().strip()
    return ""


class NotKept(Exception):
    """The driver does not keep what it compiles."""


def wanted(foreseen: Sequence[Foresee]) -> list[KernelKey]:
    """The keys of what any scene needs, of these scenes and of their sliders, and of panels; each once."""
    return list(dict.fromkeys(_wanted(foreseen)))


def _wanted(foreseen: Sequence[Foresee]) -> Iterator[KernelKey]:
    yield from kernel_keys.common_keys()
    for scene in foreseen:
        yield begin_key(scene)
        if scene.before is None:
            yield from slider_keys(scene)
    yield from kernel_keys.bsdf_keys()


def warm(keys: Sequence[KernelKey], device: int | None, software: bool, jobs: int, on_progress: OnProgress) -> str:
    """Compile what is not compiled yet, in so many processes; `on_progress` is called with how many are done and how
    many there are. Returns the driver's name and version.

    Raises GpuError, BrokenProcessPool, NotKept, OSError."""
    device = software_device() if software else device
    with Renderer(device) as renderer:  # which says what the driver is
        info = renderer.info
    driver = driver_of(info)

    def record(key: KernelKey) -> Path:
        return records() / key.digest(driver)

    def is_there(key: KernelKey) -> bool:
        return key.is_cached(info) if key.is_ours and not info["software"] else record(key).exists()

    missing = [key for key in keys if not is_there(key)]
    done = len(keys) - len(missing)
    on_progress(done, len(keys))
    records().mkdir(parents=True, exist_ok=True)
    # Processes and not threads: LLVM compiles a kernel in one thread, and a context belongs to one.
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _begin, (device,)) as pool:
        work = {pool.submit(_compile, key): key for key in missing}
        try:
            for future in as_completed(work):
                if not future.result():
                    raise NotKept
                record(work[future]).touch()
                done += 1
                on_progress(done, len(keys))
        finally:
            pool.shutdown(cancel_futures=True)
    return driver


def _begin(device: int | None) -> None:
    from gpu.precompile.precompiler import Precompiler

    _compiling.append(Precompiler(device))


def _compile(key: KernelKey) -> bool:
    """True if the driver keeps it. Raises CompileError."""
    return _compiling[0].compile(key)[1]
