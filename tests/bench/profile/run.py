"""All parts of a profile, scene by scene."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from gpu import Renderer, RenderSettings
from service.bench import machine
from tests.bench.profile import drivers, knockouts, machine_code
from tests.bench.profile.counts import Counter
from tests.bench.profile.load_costs import load_costs
from tests.bench.profile.scenes import MAX_BOUNCES, Subject

SAMPLED_SIZE = 256


@dataclass(frozen=True)
class Options:
    """`mesa` is a folder with another Mesa, to compare with; `quick` runs are small and their figures mean
    nothing."""

    mesa: Path | None = None
    runs: int = 5
    quick: bool = False
    parts: knockouts.Options = field(default_factory=knockouts.Options)


class NotSoftware(Exception):
    """The renderer is no llvmpipe: what is measured here has no meaning on a GPU."""


def measure(subjects: Sequence[Subject], options: Options, told: Callable[[str], None]) -> dict[str, Any]:
    """The figures, as JSON: of each subject, and of the other Mesa. Raises GpuError, NotSoftware, drivers.NoMesa."""
    with Renderer() as renderer:
        about = machine.describe(renderer.info)
    if "llvmpipe" not in about["renderer"] or "256 bits" not in about["renderer"]:
        raise NotSoftware(f"{about['renderer']}: only llvmpipe with vectors of 256 bits can be profiled")
    other = drivers.described(options.mesa) if options.mesa else {}
    began = time.perf_counter()
    parts = knockouts.Options(16, 1, 0.01) if options.quick else options.parts
    scenes = {}
    with Counter() as counter:
        for subject in subjects:
            scenes[subject.name] = {
                "commit": about["commit"],
                "parts": [asdict(part) for part in knockouts.measure(subject, parts, counter, told)],
                **_loops(subject, options, told),
            }
    told("loads")
    loads = load_costs(1, 1) if options.quick else load_costs()
    document: dict[str, Any] = {"machine": about, "size": parts.size, "loads": loads, "scenes": scenes}
    if options.mesa:
        size = 32 if options.quick else drivers.SIZE
        rows = drivers.measure(options.mesa, 1 if options.quick else options.runs, told, size)
        document["drivers"] = {"commit": about["commit"], "rows": rows, **other}
    return document | {"took_s": time.perf_counter() - began, "load": os.getloadavg()[0]}


def _loops(subject: Subject, options: Options, told: Callable[[str], None]) -> dict[str, Any]:
    """The loops of the subject's machine code, or why there are none."""
    told(f"{subject.name}: machine code")
    side = 64 if options.quick else SAMPLED_SIZE
    settings = RenderSettings(side, side, MAX_BOUNCES, filter="box", seed=1)
    try:
        found = machine_code.measure(subject.packed(subject.document), settings, 1.0 if options.quick else 5.0)
    except machine_code.NotSampled as error:
        return {"loops": None, "not_sampled": str(error)}
    kept = ("first", "depth", "share", "instructions", "wide", "gathers", "stack")
    return {"loops": [{key: getattr(loop, key) for key in kept} for loop in found]}
