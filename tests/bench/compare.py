"""This checkout beside an earlier revision, in turns: their speed, and their error at equal samples.

Two processes that run the same kernel differ by up to a tenth of its time, each for as long as it lives. So every
pair of times comes from a pair of processes of its own.
"""

from __future__ import annotations

import io
import json
import os
import statistics
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from service.bench import machine
from service.bench.scenes import cases
from tests.bench.peers import rel_mse

TURNS = 3  # of each process; its time is their median
SCRIPT = Path(__file__).parent / "compare_run.py"


@dataclass(frozen=True)
class Options:
    revision: str
    runs: int = 5  # pairs of processes
    size: int = 512
    samples: int = 8  # of a run that is timed
    error_size: int = 128
    error_samples: int = 16
    seeds: int = 4  # pictures whose errors are averaged
    reference_samples: int = 2048


class NoRevision(Exception):
    """The folder is no checkout, or it has no such revision."""


class Side:
    """A process that renders with the source of one revision, with these environment variables besides its own."""

    def __init__(self, tree: Path, folder: Path, variables: Mapping[str, str] | None = None) -> None:
        command = [sys.executable, "-P", str(SCRIPT), str(folder / "cases.json")]
        environment = os.environ | {"PYTHONPATH": str(tree)} | dict(variables or {})
        self._out = folder / "picture.npy"
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, cwd=tree, env=environment, text=True, stdin=pipe, stdout=pipe)

    def time(self, case: int, size: int, samples: int) -> dict[str, float]:
        """The seconds of a run by each clock. Raises EOFError where the revision cannot render the case; stderr says
        why."""
        return self._ask({"case": case, "size": size, "samples": samples, "seed": 0})

    def picture(self, case: int, size: int, samples: int, seed: int) -> np.ndarray:
        """(size, size, 3) float32."""
        self._ask({"case": case, "size": size, "samples": samples, "seed": seed, "out": str(self._out)})
        pixels: np.ndarray = np.load(self._out)
        return pixels

    def _ask(self, order: dict[str, Any]) -> dict[str, float]:
        assert self._process.stdin is not None and self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise EOFError from None
        line = self._process.stdout.readline()
        if not line:
            raise EOFError
        answer: dict[str, float] = json.loads(line)
        return answer

    def close(self) -> None:
        self._process.kill()
        self._process.wait()


def measure(options: Options, told: Callable[[str], None]) -> dict[str, Any]:
    """Machine, revisions, and a row for each scene of the speed bench. Raises NoRevision."""
    rows = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="sunbox-compare-")))
        commit = unpack(options.revision, folder / "before")
        listed = [{"scene": case.scene, "max_bounces": case.max_bounces} for case in cases()]
        (folder / "cases.json").write_text(json.dumps(listed))
        for number, case in enumerate(cases()):
            told(f"{case.name}, {case.max_bounces} bounces")
            row = {"name": case.name, "max_bounces": case.max_bounces}
            rows.append(row | _compared(number, folder, options))
    about = {"processor": machine.processor(), "before": commit, "after": machine.commit()}
    return {"machine": about, "scenes": rows}


def unpack(revision: str, to: Path) -> str:
    """Unpack the source of that revision into a folder. Returns its commit."""
    root = str(machine.ROOT)
    found = subprocess.run(["git", "-C", root, "rev-parse", f"{revision}^{{commit}}"], capture_output=True, text=True)
    if found.returncode:
        raise NoRevision(f"{revision!r} is no revision of a checkout here: {found.stderr.strip()}")
    commit = found.stdout.strip()
    tree = subprocess.run(["git", "-C", root, "archive", commit], capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(tree)) as archive:
        archive.extractall(to, filter="data")
    return commit


@contextmanager
def _sides(folder: Path) -> Iterator[tuple[Side, Side]]:
    before, after = Side(folder / "before", folder), Side(machine.ROOT, folder)
    try:
        yield before, after
    finally:
        before.close()
        after.close()


def _compared(case: int, folder: Path, options: Options) -> dict[str, Any]:
    row: dict[str, Any] = {}
    try:
        runs = [_timed(case, folder, options) for _ in range(options.runs)]
        for key in ("wall", "cpu"):
            times = [[1e3 * side[f"{key}_s"] / options.samples for side in run] for run in runs]
            before, after = (statistics.median(column) for column in zip(*times, strict=True))
            row[f"{key}_ms_per_sample"] = {"before": before, "after": after, "ratio": after / before}
        with _sides(folder) as sides:
            return row | _errors(case, sides, options)
    except EOFError:
        return {"failed": "one of the two revisions cannot render it"}


def _timed(case: int, folder: Path, options: Options) -> list[dict[str, float]]:
    """The seconds of a run of each side, by each clock, in processes that were started for it."""
    with _sides(folder) as sides:
        for side in sides:
            side.time(case, options.size, 1)  # loads the scene and its kernel
        turns = [[side.time(case, options.size, options.samples) for side in sides] for _ in range(TURNS)]
    return [
        {key: statistics.median(turn[key] for turn in each) for key in each[0]} for each in zip(*turns, strict=True)
    ]


def _errors(case: int, sides: tuple[Side, Side], options: Options) -> dict[str, Any]:
    size, count = options.error_size, options.error_samples
    reference = sides[1].picture(case, size, options.reference_samples, 1_000_000)
    pictures = [[side.picture(case, size, count, 1 + seed) for side in sides] for seed in range(options.seeds)]
    errors = np.mean([[rel_mse(picture, reference) for picture in pair] for pair in pictures], axis=0)
    return {
        "rel_mse": {"before": errors[0], "after": errors[1], "ratio": errors[1] / errors[0]},
        "same_bits": all(np.array_equal(a, b) for a, b in pictures),
    }


def table(document: dict[str, Any]) -> str:
    rows = document["scenes"]
    name = max(len(row["name"]) for row in rows)
    lines = [f"{'':{name}}  bounces  ms/sample: before   after  ratio (CPU)   relMSE: before    after  ratio"]
    for row in rows:
        head = f"{row['name']:{name}}  {row['max_bounces']:7}"
        if "failed" in row:
            lines.append(f"{head}  {row['failed']}")
            continue
        wall, cpu, error = row["wall_ms_per_sample"], row["cpu_ms_per_sample"], row["rel_mse"]
        lines.append(
            f"{head}  {wall['before']:17.1f} {wall['after']:7.1f} {wall['ratio']:6.2f} ({cpu['ratio']:4.2f})"
            f"  {error['before']:15.2e} {error['after']:8.1e} {error['ratio']:6.2f}"
            + ("  same bits" if row["same_bits"] else "")
        )
    lines += ["", *(f"{key:10} {value}" for key, value in document["machine"].items())]
    return "\n".join(lines)
