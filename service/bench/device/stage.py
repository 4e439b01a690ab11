"""Scenes, pictures, and the time of a sample or of a call."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from gpu import Picture, RenderSettings, SceneArrays
from service.bench import timing
from service.bench.scenes import BenchAssets, mesh_on_plane
from service.document import parse_scene, presets
from service.pack import pack

RUNS = 3  # of which the median counts
MESH = "mesh on a plane"  # 73 728 triangles, beside the built-in scenes

Row = dict[str, Any]


@dataclass(frozen=True)
class Options:
    """`device` is a number of EGL's, None its default; `scenes` are names of built-in ones."""

    seconds: float = 600.0
    device: int | None = None
    sizes: tuple[tuple[int, int], ...] = ((512, 512), (1920, 1080))
    scenes: tuple[str, ...] = tuple(entry["name"] for entry in presets.names("scenes"))

    @property
    def turn_s(self) -> float:
        """Seconds for a figure: there are about 80, and the rest goes to starting processes and compiling."""
        return self.seconds / 120


def arrays(name: str) -> SceneArrays:
    """A built-in scene, or MESH, ready to be uploaded."""
    scene = mesh_on_plane() if name == MESH else presets.get("scenes", name)
    return pack(parse_scene(scene), BenchAssets()).arrays


def settings(size: tuple[int, int], **others: Any) -> RenderSettings:
    return RenderSettings(*size, **others)


def rate(picture: Picture, turn_s: float) -> Row:
    """A `report.Rate`, measured for about `turn_s`."""
    return rates({"": picture}, turn_s)[""]


def rates(pictures: Mapping[str, Picture], turn_s: float, period: int = 1) -> dict[str, Row]:
    """A `report.Rate` of each picture, measured in turns for about `turn_s` each, so that a device that gets warm
    slows all of them. Each run has a multiple of `period` samples."""
    run_s = turn_s / (RUNS + 1)
    samples = {
        name: period * max(1, timing.samples_in(picture, run_s) // period) for name, picture in pictures.items()
    }
    seconds: dict[str, list[float]] = {name: [] for name in pictures}
    for _ in range(RUNS):
        for name, picture in pictures.items():
            seconds[name].append(timing.trace(picture, samples[name]) / samples[name])
    return {name: _rate(picture, seconds[name]) for name, picture in pictures.items()}


def _rate(picture: Picture, seconds: list[float]) -> Row:
    middle, paths = statistics.median(seconds), picture.settings.width * picture.settings.height
    spread = (max(seconds) - min(seconds)) / middle
    return {"mpaths_per_s": paths / middle / 1e6, "ms_per_sample": 1e3 * middle, "spread": spread}


def median_ms(call: Callable[[], Any], turn_s: float) -> float:
    """The median of the milliseconds that a call takes, of RUNS calls or as many as `turn_s` has room for, after one
    that does not count."""
    call()
    taken: list[float] = []
    until = time.perf_counter() + turn_s
    while len(taken) < RUNS or time.perf_counter() < until:
        began = time.perf_counter()
        call()
        taken.append(time.perf_counter() - began)
    return 1e3 * statistics.median(taken)


def percentiles(taken_ms: list[float]) -> Row:
    """A `report.Latency`."""
    ordered = sorted(taken_ms)
    return {"p50_ms": ordered[len(ordered) // 2], "p95_ms": ordered[int(0.95 * len(ordered))]}
