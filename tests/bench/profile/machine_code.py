"""The time by loops of the kernel's machine code: a process renders on one thread, Linux' perf samples it, and
binutils' objdump disassembles the code that llvmpipe has compiled. Neither is a dependency."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections import Counter
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory

from gpu import Renderer, RenderSettings, SceneArrays
from tests.bench.profile import loops

FREQUENCY = 2000  # samples a second
STARTING_S = 240.0  # for compiling, on a machine that has other work
TOOLS = ("perf", "objdump")


class NotSampled(Exception):
    """The machine code was not sampled; the message says why."""


def measure(arrays: SceneArrays, settings: RenderSettings, seconds: float = 5.0) -> list[loops.Loop]:
    """The loops of the kernel that traces the scene. Raises NotSampled."""
    for tool in TOOLS:
        if shutil.which(tool) is None:
            raise NotSampled(f"{tool} is not installed")
    ours, theirs = get_context("spawn").Pipe(duplex=False)
    process = get_context("spawn").Process(target=_render, args=(theirs, arrays, settings), daemon=True)
    process.start()
    theirs.close()
    try:
        if not ours.poll(STARTING_S):
            raise NotSampled(f"the process did not render after {STARTING_S:.0f} s")
        ours.recv()
        assert process.pid is not None
        return _sampled(process.pid, seconds)
    except EOFError:
        raise NotSampled("the process that renders died") from None
    finally:
        process.kill()
        process.join()
        ours.close()


def _render(answer: Connection, arrays: SceneArrays, settings: RenderSettings) -> None:
    os.environ["LP_NUM_THREADS"] = "1"
    with Renderer() as renderer:
        picture = renderer.picture(renderer.load(arrays), settings)
        picture.trace(60.0, 2)
        answer.send(True)
        until = time.monotonic() + STARTING_S
        while time.monotonic() < until:
            picture.reset()
            picture.trace(1.0, 8)  # within one block of samples, which is not merged


def _sampled(pid: int, seconds: float) -> list[loops.Loop]:
    with TemporaryDirectory(prefix="sunbox-profile-") as name:
        folder = Path(name)
        data, code = folder / "perf.data", folder / "code.bin"
        options = ["-q", "-e", "cpu-clock", "-F", str(FREQUENCY), "-p", str(pid), "-o", str(data)]
        _ran(["perf", "record", *options, "--", "sleep", str(seconds)])
        samples = Counter(int(word, 16) for word in _ran(["perf", "script", "-i", str(data), "-F", "ip"]).split())
        first, last = _region(Path(f"/proc/{pid}/maps").read_text(), samples)
        with open(f"/proc/{pid}/mem", "rb") as memory:
            memory.seek(first)
            code.write_bytes(memory.read(last - first))
        kind = ["-D", "-b", "binary", "-m", "i386:x86-64", f"--adjust-vma={first:#x}"]
        text = _ran(["objdump", *kind, str(code)])
    within = {at: n for at, n in samples.items() if first <= at < last}
    return loops.loops(loops.instructions(text), within)


def _ran(command: list[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise NotSampled(f"{command[0]}: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else 'failed'}")
    return done.stdout


def _region(maps: str, samples: Counter[int]) -> tuple[int, int]:
    """The mapping without a file into which most samples fell."""
    best = (0, 0, 0)
    for line in maps.splitlines():
        words = line.split()
        if "x" in words[1] and len(words) == 5:
            first, last = (int(word, 16) for word in words[0].split("-"))
            best = max(best, (sum(n for at, n in samples.items() if first <= at < last), first, last))
    if not best[0]:
        raise NotSampled("no sample fell into compiled code")
    return best[1], best[2]
