"""Every part in turn, within the time that was given. What fails is named in the report, with the reason."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from websockets.exceptions import WebSocketException

from gpu.analysis.device_limits import device_limits
from service.bench import machine
from service.bench.device import frames, pictures, scenes
from service.bench.device.isolated import PAIR_SCENE, SPAWN, Isolated, Lost, rate_beside_others
from service.bench.device.report import Report
from service.bench.device.stage import MESH, Options, Row

PART_S = 120.0  # for one part beside its share of the time: drivers may compile for a minute
NOT_BUILT = {
    "8-wide trees": "Sunbox has no such tree",
    "one tree stored once": "kernels know only the layout of eight orders; `trees` has one order, stored eight times",
    "work groups other than 8 x 8": "the size is compiled into kernels and the layout of passes",
    "two renderers of one server on a device": "SUNBOX_DEVICES takes each device once; `pairs` has two processes",
}


class _Run:
    """The parts so far. `progress` is called with the name of each."""

    def __init__(self, options: Options, cache: Path, progress: Callable[[str], None]) -> None:
        self.options, self.cache, self._progress = options, cache, progress
        self.began = time.perf_counter()
        self.missing = [{"what": what, "why": why} for what, why in NOT_BUILT.items()]

    def lacks(self, what: str, why: str) -> None:
        self.missing.append({"what": what, "why": why})

    def part(self, what: str, function: Callable[..., Any], *arguments: Any, cache: Path | None = None) -> Any:
        """Returns `function(*arguments)`, called in a process of its own; None where it gave nothing."""
        return self.here(what, lambda: self.isolated(function, *arguments, cache=cache).result(self.patience_s))

    def isolated(self, function: Callable[..., Any], *arguments: Any, cache: Path | None = None) -> Isolated:
        return Isolated(cache or self.cache, function, *arguments)

    def here(self, what: str, call: Callable[[], Any]) -> Any:
        """Returns `call()`; None where it failed, or the time is over."""
        spent = time.perf_counter() - self.began
        if spent > 1.5 * self.options.seconds + PART_S:
            self.lacks(what, f"left out: {spent:.0f} s had gone, of {self.options.seconds:.0f} s that were given")
            return None
        self._progress(what)
        try:
            return call()
        except (Lost, OSError, RuntimeError, WebSocketException) as error:  # all but the first are of a server
            self.lacks(what, str(error) or type(error).__name__)
            return None

    @property
    def patience_s(self) -> float:
        return PART_S + self.options.seconds / 4


def measure(options: Options, progress: Callable[[str], None]) -> dict[str, Any]:
    """A `report.Report` as JSON has it. `progress` is called with the name of each part."""
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder:
        run = _Run(options, Path(folder), progress)
        device = run.part("the device", device_limits, options.device)
        found: Row = {
            "device": device,
            "scenes": [row for name in options.scenes for row in _scene(run, name)],
            "frames": [row for size in options.sizes for row in _frames(run, size)],
            "readouts": run.part("reading and encoding", pictures.measure, options) or [],
            "blocks": run.part("blocks of samples", pictures.blocks, options) or [],
            "slices": _named(run, "dispatches by length", pictures.slices, pictures.DISPATCH_SCENES),
            "sides": _named(run, "dispatches by size", pictures.sides, pictures.DISPATCH_SCENES),
            "pairs": [row for count in (1, 2) for row in _pair(run, count)],
            "trees": _named(run, "orders of trees", scenes.trees, scenes.TREE_SCENES),
            "kernels": [row for name in scenes.KERNEL_SCENES if name in options.scenes
                        for row in _listed(run.part(f"full kernel of {name}", scenes.full_kernel, name, options))],
            "caustics": [row for name in scenes.CAUSTIC_SCENES if name in options.scenes
                         for row in _listed(run.part(f"caustics of {name}", scenes.caustics, name, options))],
        }  # fmt: skip
        _name_silence(run, device)
        about = machine.describe(device or {"renderer": None, "version": None})
        took_s = time.perf_counter() - run.began
        report = Report(machine=about, seconds=options.seconds, took_s=took_s, missing=run.missing, **found)
    out: dict[str, Any] = report.model_dump(mode="json")
    return out


def _scene(run: _Run, name: str) -> list[Row]:
    with tempfile.TemporaryDirectory(dir=run.cache) as empty:
        cold = run.part(f"{name}: first compilation", scenes.compile_ms, name, run.options, cache=Path(empty))
        row = run.part(name, scenes.measure, name, run.options, cache=Path(empty))
    return [] if cold is None or row is None else [{**row, "compile_cold_ms": cold}]


def _frames(run: _Run, size: tuple[int, int]) -> list[Row]:
    what = f"first frames of {size[0]} x {size[1]} pixels"
    return _listed(run.here(what, lambda: frames.measure(size, run.options)))


def _named(run: _Run, what: str, function: Callable[..., list[Row]], names: tuple[str, ...]) -> list[Row]:
    chosen = [name for name in names if name in run.options.scenes or name == MESH]
    return [row for name in chosen for row in run.part(f"{what}, {name}", function, name, run.options) or []]


def _pair(run: _Run, count: int) -> list[Row]:
    def rates() -> list[float]:
        together = SPAWN.Barrier(count)
        processes = [run.isolated(rate_beside_others, run.options, together) for _ in range(count)]
        try:
            return [process.result(run.patience_s) for process in processes]
        finally:
            for process in processes:
                process.end()

    found = run.here(f"{count} process{'es' * (count > 1)} on the device", rates)
    return [] if found is None else [{"scene": PAIR_SCENE, "processes": count, "mpaths_per_s": found}]


def _listed(row: Row | None) -> list[Row]:
    return [] if row is None else [row]


def _name_silence(run: _Run, device: Row | None) -> None:
    """Name what the driver does not say."""
    if device is None:
        return
    silent = {
        "subgroup_size": "the driver has neither GL_KHR_shader_subgroup nor GL_NV_shader_thread_group",
        "memory": "the driver lacks GL_NVX_gpu_memory_info",
        "free_memory": "the driver has neither GL_NVX_gpu_memory_info nor GL_ATI_meminfo",
    }
    for name, why in silent.items():
        if device[name] is None:
            shares = device["software"] and "memory" in name
            run.lacks(name, "the device is the processor, which has no memory of its own" if shares else why)
