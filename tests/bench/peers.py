"""Sunbox beside Mitsuba 3 and Cycles on the same machine: error after the same seconds, and paths per second.

Each renders scenes of the same geometry, materials and light in a process of its own, in turns. Errors are against
each renderer's own reference (another seed over many more samples), so that no difference of models counts as noise:
relMSE = mean((x - r)^2 / (r^2 + .01)). Compiling, loading and the building of trees are not counted.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from service.bench import machine
from tests.bench import peer_blender, peer_scenes
from tests.bench.peer_scenes import PeerCase

MOMENTS_S = (1.0, 10.0)
HERE = Path(__file__).parent
VARIANT = "llvm_ad_rgb"
TRIES = 3  # attempts to make Cycles, which takes a number of samples, render for a given time
NAMES = {"sunbox": "Sunbox", "mitsuba": "Mitsuba", "cycles": "Cycles"}


@dataclass(frozen=True)
class Options:
    mitsuba: Path | None = None  # an interpreter that has mitsuba
    cycles: Path | None = None  # one that has bpy
    rounds: int = 3
    reference_s: float = 120.0
    size: int = 512


@dataclass(frozen=True)
class Course:
    """One run: seconds, samples per pixel and the picture (n, h, w, 3) at each moment."""

    seconds: np.ndarray
    samples: np.ndarray
    pictures: np.ndarray


def measure(options: Options, told: Callable[[str], None]) -> dict[str, Any]:
    """Machine, and a row for each scene. Raises OSError or CalledProcessError where a side cannot be run."""
    for python, module in ((options.mitsuba, "mitsuba"), (options.cycles, "bpy")):
        if python:  # checked before our own reference takes its minutes
            subprocess.run([python, "-c", f"import {module}"], check=True, stdout=subprocess.DEVNULL)
    rows = []
    with tempfile.TemporaryDirectory(prefix="sunbox-peers-") as folder:
        for case in peer_scenes.cases():
            rows.append(_row(case, options, Path(folder), told))
    return {"machine": {"processor": machine.processor(), "commit": machine.commit()}, "scenes": rows}


def _row(case: PeerCase, options: Options, folder: Path, told: Callable[[str], None]) -> dict[str, Any]:
    sides = {"sunbox": _sunbox}
    if options.mitsuba:
        sides["mitsuba"] = _mitsuba
    if options.cycles and not case.is_textured:
        sides["cycles"] = _cycles
    row: dict[str, Any] = {"name": case.name, "max_bounces": case.max_bounces}
    references: dict[str, np.ndarray] = {}
    courses: dict[str, list[Course]] = {}
    for name, side in sides.items():
        told(f"{case.name}: {name}'s reference")
        references[name] = side(case, options, folder, (options.reference_s,), 1).pictures[-1]
        courses[name] = []
    for turn in range(options.rounds):
        told(f"{case.name}: round {turn + 1} of {options.rounds}")
        for name, side in sides.items():
            courses[name].append(side(case, options, folder, MOMENTS_S, 2 + turn))
    for name in sides:
        row[name] = _summary(courses[name], references[name], options.size)
    peers = [name for name in sides if name != "sunbox"]
    row["ratios"] = {name: _ratios(row["sunbox"], row[name]) for name in peers}
    return row


def _ratios(ours: dict[str, Any], theirs: dict[str, Any]) -> dict[str, Any]:
    """Ours over theirs. Both show the same scene where that of the brightness is near 1."""
    return {
        "paths": ours["mpaths_per_s"] / theirs["mpaths_per_s"],
        "error": [a / b for a, b in zip(ours["rel_mse"], theirs["rel_mse"], strict=True)],
        "brightness": ours["brightness"] / theirs["brightness"],
    }


def _summary(courses: list[Course], reference: np.ndarray, size: int) -> dict[str, Any]:
    errors = [[_at(course, i, reference) for i in range(len(MOMENTS_S))] for course in courses]
    rates = [float(c.samples[-1] / c.seconds[-1]) * size * size / 1e6 for c in courses]
    return {
        "mpaths_per_s": statistics.median(rates),
        "samples": [float(statistics.median(column)) for column in zip(*(c.samples for c in courses), strict=True)],
        "rel_mse": [statistics.median(column) for column in zip(*errors, strict=True)],
        "brightness": float(reference.mean(dtype=np.float64)),
    }


def _at(course: Course, i: int, reference: np.ndarray) -> float:
    """relMSE at the moment itself: a run is looked at a little later, and error falls at least as 1 / time."""
    return rel_mse(course.pictures[i], reference) * float(course.seconds[i]) / MOMENTS_S[i]


def rel_mse(picture: np.ndarray, reference: np.ndarray) -> float:
    r = reference.astype(np.float64)
    return float(np.mean((picture - r) ** 2 / (r**2 + 0.01)))


def _sunbox(case: PeerCase, options: Options, folder: Path, moments: tuple[float, ...], seed: int) -> Course:
    job = {"case": case.name, "moments": moments, "seed": seed, "size": options.size}
    return _run([sys.executable, "-m", "tests.bench.peer_sunbox"], job, folder)


def _mitsuba(case: PeerCase, options: Options, folder: Path, moments: tuple[float, ...], seed: int) -> Course:
    description, arrays = peer_scenes.for_mitsuba(case, options.size)
    np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]  # numpy's stub takes no dict of arrays
    job = {"scene": description, "arrays": str(folder / "arrays.npz"), "moments": moments, "seed": seed}
    job |= {"variant": VARIANT}
    return _run([str(options.mitsuba), str(HERE / "peer_mitsuba.py")], job, folder)


def _cycles(case: PeerCase, options: Options, folder: Path, moments: tuple[float, ...], seed: int) -> Course:
    description, arrays = peer_blender.for_cycles(case, options.size)
    np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]  # as above
    job = {"scene": description, "arrays": str(folder / "arrays.npz"), "moments": moments, "seed": seed}
    job |= {"threads": len(os.sched_getaffinity(0)), "tries": TRIES if moments == MOMENTS_S else 1}
    return _run([str(options.cycles), str(HERE / "peer_cycles.py")], job, folder)


def _run(command: list[str], job: dict[str, Any], folder: Path) -> Course:
    (folder / "job.json").write_text(json.dumps(job))
    # Blender tells its progress on the standard output, where only the table belongs.
    command = [*command, str(folder / "job.json"), str(folder / "out.npz")]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with np.load(folder / "out.npz") as out:
        return Course(out["seconds"], out["samples"], out["pictures"])


def table(rows: list[dict[str, Any]]) -> str:
    """A line for each renderer of each scene; each ratio is Sunbox's figure over that line's."""
    name = max(len(row["name"]) for row in rows)
    lines = [f"{'':{name}}           Mpaths/s  ratio   spp: 1 s   10 s   relMSE: 1 s  ratio     10 s  ratio   light"]
    for row in rows:
        for side in ("sunbox", *row["ratios"]):
            figures, ratios = row[side], row["ratios"].get(side)
            paths = early = late = light = ""
            if ratios:
                paths, light = f"{ratios['paths']:.2f}", f"{ratios['brightness']:.4f}"
                early, late = (f"{ratio:.2f}" for ratio in ratios["error"])
            lines.append(
                f"{row['name'] if side == 'sunbox' else '':{name}}  {NAMES[side]:7}"
                f"  {figures['mpaths_per_s']:8.2f} {paths:>6}"
                f"   {figures['samples'][0]:8.0f} {figures['samples'][1]:6.0f}"
                f"   {figures['rel_mse'][0]:11.1e} {early:>6} {figures['rel_mse'][1]:8.1e} {late:>6}  {light:>6}"
            )
    return "\n".join(line.rstrip() for line in lines)
