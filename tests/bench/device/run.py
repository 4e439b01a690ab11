"""The parts in turn, within the time that was given. What fails is named in the report, with the reason."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from service.bench import machine
from tests.bench.device.part import Options, command, tell

ROOT = Path(__file__).parents[3]
REFERENCE = Path(__file__).with_name("reference.npz")
LEFT_S = 5.0  # for the page
# Seconds of each part, in the order of their worth: a part that overruns its own by OVERRUN is ended.
PARTS = {
    "host": 5.0,
    "probes": 5.0,
    "barriers": 5.0,
    "compiling": 90.0,
    "shipped": 60.0,
    "edges": 20.0,
    "looks": 50.0,
    "pictures": 120.0,
    "bits": 40.0,
    "moves": 15.0,
    "floor": 40.0,
    "yielding": 15.0,
    "blocks": 25.0,
    "pair": 15.0,
}
OVERRUN = 1.5


def measure(
    folder: Path, limit_s: float, options: Options, names: Sequence[str] = (), told: Callable[[str], None] = print
) -> None:
    """Run the parts `names`, or all, for at most `limit_s` seconds together; report.jsonl in `folder` grows
    meanwhile. Where less is left than the parts want, each gets less."""
    chosen = [name for name in PARTS if not names or name in names]
    until = time.perf_counter() + limit_s - LEFT_S
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("report.jsonl", "said.log"):
        (folder / name).unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(prefix="sunbox-device-") as caches:
        environment = {**os.environ, **machine.shader_caches(caches), "__GL_SHADER_DISK_CACHE": "1"}
        for i, name in enumerate(chosen):
            left = until - time.perf_counter()
            if left < 1.0:
                tell(folder, name, {"failed": "left out: the time is over"})
                continue
            told(name)
            share = min(1.0, left / sum(PARTS[later] for later in chosen[i:]))
            mine = replace(options, seconds=PARTS[name] * share, folder=str(folder))
            _part(name, folder, mine, min(left, mine.seconds * OVERRUN), environment)


def _part(name: str, folder: Path, options: Options, limit_s: float, environment: dict[str, str]) -> None:
    began = time.perf_counter()
    said = folder / "said.log"
    with said.open("ab") as log:
        process = subprocess.Popen(
            command(name, folder, options), cwd=ROOT, env=environment, stdout=log, stderr=log, start_new_session=True
        )
        try:
            code: int | None = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            code = None
        finally:
            _end(process)
    took = {"took_s": round(time.perf_counter() - began, 1), "given_s": round(options.seconds, 1)}
    if code == 0:
        tell(folder, name, {"done": True, **took})
        return
    why = f"not done after {limit_s:.0f} s" if code is None else f"exit code {code}"
    tell(folder, name, {"failed": why, "said": said.read_text(errors="replace")[-1500:], **took})


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a part with all that it started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
