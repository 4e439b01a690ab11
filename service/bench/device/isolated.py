"""A measurement in a process of its own: what it fails of, or where its driver hangs or dies, ends it alone. And one
for two of them at once.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Any

from gpu import Renderer
from service.bench import machine, timing
from service.bench.device import stage
from service.bench.device.stage import Options

ENDING_S = 10.0  # for a process that gave its figures: drivers write their caches in the background
SPAWN = get_context("spawn")  # a fork of a process that has spoken with a driver may hang
PAIR_SCENE = "cornell-boxes"
PATIENCE_S = 60.0  # for the other process to compile


class Lost(Exception):
    """A process gave no figures; the message says why."""


class Isolated:
    """`function(*arguments)` in a process that begins at once and whose driver caches kernels in `cache`."""

    def __init__(self, cache: Path, function: Callable[..., Any], *arguments: Any) -> None:
        self._answer, theirs = SPAWN.Pipe(duplex=False)
        self._process = SPAWN.Process(target=_run, args=(theirs, cache, function, arguments), daemon=True)
        self._process.start()
        theirs.close()

    def result(self, timeout_s: float) -> Any:
        """The function's result. Raises Lost. In either case the process has ended."""
        try:
            if not self._answer.poll(max(0.0, timeout_s)):
                raise Lost(f"not done after {timeout_s:.0f} s")
            fine, answer = self._answer.recv()
        except EOFError:
            self._process.join()
            raise Lost(f"the process died, exit code {self._process.exitcode}") from None
        else:
            self._process.join(ENDING_S)
        finally:
            self.end()
        if not fine:
            raise Lost(answer)
        return answer

    def end(self) -> None:
        """End the process, wherever it is."""
        self._process.kill()
        self._process.join()
        self._answer.close()


def _run(answer: Connection, cache: Path, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    os.environ |= machine.shader_caches(cache)
    try:
        answer.send((True, function(*arguments)))
    except Exception as error:  # of whatever kind: the other measurements go on, and the report says what it was
        answer.send((False, f"{type(error).__name__}: {error}"))


def rate_beside_others(options: Options, together: Barrier) -> float:
    """Millions of paths per second of this process, from when all at the barrier are ready, for `turn_s`."""
    size = options.sizes[0]
    with Renderer(options.device) as renderer:
        picture = renderer.picture(renderer.load(stage.arrays(PAIR_SCENE)), stage.settings(size))
        samples = timing.samples_in(picture, options.turn_s / 4)
        picture.reset()
        together.wait(PATIENCE_S)
        traced, began = 0, time.perf_counter()
        while (seconds := time.perf_counter() - began) < options.turn_s or traced == 0:
            timing.trace(picture, samples)
            traced += samples
        return traced * size[0] * size[1] / seconds / 1e6
