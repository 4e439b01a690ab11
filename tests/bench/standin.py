"""A stand-in for a GPU: how a picture's work is cut for a device whose dispatches have a floor, in simulated time.

A dispatch of `samples` samples for `pixels` pixels takes t0 + samples x L x max(1, pixels / R) + samples x L / 2: L
is the time of a sample of a full device, R the invocations that fill it, and the last term its longest paths. The
figures of t0 and R are of an H100 by arithmetic; an H200 was measured afterwards, see docs/gpu.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

from gpu import RenderSettings
from gpu.picture import noise_meter, passes
from gpu.picture.passes import Passes
from gpu.picture.tiles import SLICE_S
from service.worker.device.resolution_ladder import ResolutionLadder

SIZES = ((256, 256), (512, 512), (1280, 720), (1920, 1080))
L_MS = (0.05, 0.1, 0.3, 1.0, 3.0)
T0_S, FULL = 3e-4, 33_792  # a dispatch with its wait; invocations of a full device
BYTES_A_S = 2e12  # of the device's memory
SECONDS = 20.0  # of simulated time
METER_LINES = 32


class Device:
    """The clock, and what was started since the last wait."""

    def __init__(self, l_s: float) -> None:
        self.now, self.l_s, self.longest_s = 0.0, l_s, 0.0
        self._started: list[tuple[int, int]] = []
        self._moved_s = 0.0

    def start(self, pixels: int, samples: int) -> None:
        self._started.append((pixels, samples))

    def move(self, size: int) -> None:
        self._moved_s += size / BYTES_A_S

    def finish(self) -> None:
        """Wait for all that was started, which runs at the same time as far as the device is not full."""
        if not self._started and not self._moved_s:
            return
        full = sum(pixels * samples for pixels, samples in self._started) * self.l_s / FULL
        deepest = max((samples for _, samples in self._started), default=0) * self.l_s
        took = T0_S + max(full, deepest) + deepest / 2 + self._moved_s
        self.now += took
        self.longest_s = max(self.longest_s, took)
        self._started, self._moved_s = [], 0.0


def passes_on(device: Device, size: tuple[int, int]) -> Passes:
    """A picture's passes on that device; what they would write is left out."""
    settings = RenderSettings(*size)

    def run(kernel: Any, uniforms: dict[str, Any], groups: Any, beside: bool = False) -> None:
        device.start(uniforms["size"][0] * uniforms["size"][1], uniforms["count"])

    def uniforms(origin: Any, tile: tuple[int, int], first: int, count: int) -> dict[str, Any]:
        return {"size": tile, "count": count}

    context = SimpleNamespace(finish=device.finish, extra=None)
    dispatcher = SimpleNamespace(
        context=context, settings=settings, is_software=False, most_pixels=1 << 27, bind=lambda: None,
        bind_part=lambda *given: 0, uniforms=uniforms, run=run, run_beside=run,
        scene=SimpleNamespace(defines=lambda settings: {}),
    )  # fmt: skip
    sums = SimpleNamespace(total={}, block={}, open=False)

    def opened(value: bool) -> None:
        sums.open = value

    def merge(first: int, count: int) -> None:
        device.move(6 * 16 * count)
        device.finish()

    sums.open_block, sums.end_block, sums.merge = lambda: opened(True), lambda: opened(False), merge
    meter = SimpleNamespace(lines=METER_LINES, buffers={}, place=lambda total, seed: None)
    light = SimpleNamespace(on=False, even=0, odd=0, reset=lambda: 0.0)
    kernels = SimpleNamespace(
        get=lambda entry, defines: "", last_compile_ms=0.0, hold=lambda kernel: None, let_go=lambda kernel: None
    )
    made: Any = (dispatcher, kernels, sums, meter, light)
    picture = Passes(*made)
    picture.reset()
    return picture


@contextmanager
def clock_of(device: Device, metered: bool = True) -> Iterator[None]:
    """Within this block passes read the device's clock."""
    clock = SimpleNamespace(perf_counter=lambda: device.now)
    since = noise_meter.FROM if metered else 1 << 40
    with patch.object(passes, "time", clock), patch.object(noise_meter, "FROM", since):
        yield


def traced(size: tuple[int, int], l_s: float, metered: bool = True) -> tuple[float, float, float]:
    """Share of the device in SECONDS, the longest wait, and seconds of a sample of a pixel as they were measured."""
    device = Device(l_s)
    with clock_of(device, metered):
        picture = passes_on(device, size)
        while device.now < SECONDS:
            picture.trace(1.0, 1 << 30)
    ideal = picture.samples * size[0] * size[1] / FULL * l_s
    return ideal / device.now, device.longest_s, picture.schedule.cost_s


def cell(size: tuple[int, int], l_ms: float) -> dict[str, Any]:
    share, longest_s, cost_s = traced(size, l_ms / 1e3)
    without, _, _ = traced(size, l_ms / 1e3, metered=False)
    renderer: Any = SimpleNamespace(info={"software": False}, picture=lambda scene, settings: None)
    ladder = ResolutionLadder(renderer, renderer, RenderSettings(*size))
    return {
        "width": size[0],
        "height": size[1],
        "l_ms": l_ms,
        "share": round(share, 3),
        "longest_ms": round(1e3 * longest_s, 2),
        "meter": round(max(0.0, 1 - share / without), 4),
        "first_look": ladder.first(cost_s),
    }


def measure() -> dict[str, Any]:
    return {"slice_ms": 1e3 * SLICE_S, "cells": [cell(size, l_ms) for size in SIZES for l_ms in L_MS]}


def table(document: dict[str, Any]) -> str:
    """Markdown."""
    lines = ["| size | L, ms | share | longest, ms | meter | first look |", "|---|---|---|---|---|---|"]
    lines += [
        f"| {row['width']} x {row['height']} | {row['l_ms']:g} | {row['share']:.0%} | {row['longest_ms']:.1f}"
        f" | {row['meter']:.1%} | {row['first_look']:g} |"
        for row in document["cells"]
    ]
    return "\n".join(lines)
