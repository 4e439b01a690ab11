"""Compiles kernels before a renderer needs them, into the driver's cache: several at a time, each in its process."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import TYPE_CHECKING

from gpu import Renderer, software_device
from gpu.precompile import kernel_keys
from service.ipc.messages import Foresee, driver_of
from service.worker.device.loaded_scene import begin_key, slider_keys
from service.worker.helpers.compile_client import records

if TYPE_CHECKING:
    from pathlib import Path

    from gpu import KernelKey
    from gpu.precompile.precompiler import Precompiler

Told = Callable[[int, int], None]

_compiling: list[Precompiler] = []  # the one of a process that compiles


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


def warm(keys: Sequence[KernelKey], device: int | None, software: bool, jobs: int, told: Told) -> str:
    """Compile what is not compiled yet, in so many processes; `told` is called with how many are done and how many
    there are. Returns the driver's name and version.

    Raises GpuError, BrokenProcessPool, NotKept, OSError."""
    device = software_device() if software else device
    with Renderer(device) as renderer:  # which says what the driver is
        info = renderer.info
    driver = driver_of(info)

    def record(key: KernelKey) -> Path:
        return records() / key.digest(driver)

    def is_there(key: KernelKey) -> bool:
        return key.is_kept(info) if key.is_ours and not info["software"] else record(key).exists()

    missing = [key for key in keys if not is_there(key)]
    done = len(keys) - len(missing)
    told(done, len(keys))
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
                told(done, len(keys))
        finally:
            pool.shutdown(cancel_futures=True)
    return driver


def _begin(device: int | None) -> None:
    from gpu.precompile.precompiler import Precompiler

    _compiling.append(Precompiler(device))


def _compile(key: KernelKey) -> bool:
    """Whether the driver keeps it. Raises CompileError."""
    return _compiling[0].compile(key)[1]
