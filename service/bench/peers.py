"""Sunbox beside Mitsuba 3 on the same machine: error after the same seconds, and paths per second.

Each renders scenes of the same geometry, materials and light in a process of its own, in turns. Errors are against
each renderer's own reference (made by its independent sampler over many more samples), so that no difference of
models counts as noise: relMSE = mean((x - r)^2 / (r^2 + .01)). Compiling and loading are not counted.
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

from service.bench import machine, peer_scenes
from service.bench.peer_scenes import PeerCase

MOMENTS_S = (1.0, 10.0)
SCRIPT = Path(__file__).parent / "peer_mitsuba.py"
VARIANT = "llvm_ad_rgb"


@dataclass(frozen=True)
class Options:
    python: Path  # an interpreter that has mitsuba
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
    """Machine, and a row for each scene. Raises CalledProcessError where a side fails."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="sunbox-peers-") as folder:
        for case in peer_scenes.cases():
            rows.append(_row(case, options, Path(folder), told))
    return {"machine": {"processor": machine.processor(), "commit": machine.commit()}, "scenes": rows}


def _row(case: PeerCase, options: Options, folder: Path, told: Callable[[str], None]) -> dict[str, Any]:
    sides = {"sunbox": _sunbox, "mitsuba": _mitsuba}
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
    means = [float(reference.mean()) for reference in references.values()]
    row["brightness_ratio"] = means[0] / means[1]  # both show the same scene when this is near 1
    row["paths_ratio"] = row["sunbox"]["mpaths_per_s"] / row["mitsuba"]["mpaths_per_s"]
    ours, theirs = row["sunbox"]["rel_mse"], row["mitsuba"]["rel_mse"]
    row["error_ratio"] = [a / b for a, b in zip(ours, theirs, strict=True)]
    return row


def _summary(courses: list[Course], reference: np.ndarray, size: int) -> dict[str, Any]:
    errors = [[_at(course, i, reference) for i in range(len(MOMENTS_S))] for course in courses]
    rates = [float(c.samples[-1] / c.seconds[-1]) * size * size / 1e6 for c in courses]
    return {
        "mpaths_per_s": statistics.median(rates),
        "rel_mse": [statistics.median(column) for column in zip(*errors, strict=True)],
    }


def _at(course: Course, i: int, reference: np.ndarray) -> float:
    """relMSE at the moment itself: a run is looked at a little later, and error falls at least as 1 / time."""
    return rel_mse(course.pictures[i], reference) * float(course.seconds[i]) / MOMENTS_S[i]


def rel_mse(picture: np.ndarray, reference: np.ndarray) -> float:
    r = reference.astype(np.float64)
    return float(np.mean((picture - r) ** 2 / (r**2 + 0.01)))


def _sunbox(case: PeerCase, options: Options, folder: Path, moments: tuple[float, ...], seed: int) -> Course:
    job = {"case": case.name, "moments": moments, "seed": seed, "size": options.size}
    return _run([sys.executable, "-m", "service.bench.peer_sunbox"], job, folder)


def _mitsuba(case: PeerCase, options: Options, folder: Path, moments: tuple[float, ...], seed: int) -> Course:
    description, arrays = peer_scenes.for_mitsuba(case, options.size)
    np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]  # numpy's stub takes no dict of arrays
    job = {"variant": VARIANT, "scene": description, "arrays": str(folder / "arrays.npz"), "moments": moments}
    return _run([str(options.python), str(SCRIPT)], job, folder)


def _run(command: list[str], job: dict[str, Any], folder: Path) -> Course:
    (folder / "job.json").write_text(json.dumps(job))
    subprocess.run([*command, folder / "job.json", folder / "out.npz"], check=True, env=os.environ)
    with np.load(folder / "out.npz") as out:
        return Course(out["seconds"], out["samples"], out["pictures"])


def table(rows: list[dict[str, Any]]) -> str:
    name = max(len(row["name"]) for row in rows)
    lines = [
        f"{'':{name}}  Mpaths/s: Sunbox Mitsuba  ratio   relMSE 1 s: Sunbox Mitsuba  ratio"
        "   10 s: Sunbox  Mitsuba  ratio  light"
    ]
    for row in rows:
        ours, theirs = row["sunbox"], row["mitsuba"]
        lines.append(
            f"{row['name']:{name}}  {ours['mpaths_per_s']:16.2f} {theirs['mpaths_per_s']:7.2f}"
            f" {row['paths_ratio']:6.2f}"
            f"   {ours['rel_mse'][0]:18.2e} {theirs['rel_mse'][0]:7.1e} {row['error_ratio'][0]:6.2f}"
            f"   {ours['rel_mse'][1]:12.2e} {theirs['rel_mse'][1]:8.1e} {row['error_ratio'][1]:6.2f}"
            f"  {row['brightness_ratio']:5.3f}"
        )
    return "\n".join(lines)
