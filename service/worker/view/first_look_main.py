"""Shows first looks: `GALLIVM_PERF=nopt python -m service.worker.view.first_look_main DESCRIPTOR --parent PID`.

A renderer of its own, by kernels that LLVM does not optimise. The pictures are for the eye alone: what is kept is
traced by the kernels of the other renderer, from the first sample.
"""

from __future__ import annotations

import argparse
import logging
import select
import socket
from typing import TYPE_CHECKING

from service.ipc import channel
from service.ipc.messages import FromRenderer, Want
from service.system.confined import hide
from service.system.lifeline import end_with
from service.system.shared_memory import trim
from service.worker.helpers.compile_main import bound_memory
from service.worker.helpers.first_look_client import Leave, Look, Wanted

if TYPE_CHECKING:
    import numpy as np

    from gpu import Renderer
    from service.worker.view.first_look import FirstLook

IDLE_S = 300.0  # then it ends, and gives back what the driver holds; its start takes half a second of a core

log = logging.getLogger(__name__)


def denoised(color: np.ndarray) -> np.ndarray:
    """The picture without its noise, by its colour alone; as it is where the library is not there."""
    from gpu import denoise

    return color if denoise.missing() else denoise.denoise(color, None, None, fine=False)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m service.worker.view.first_look_main")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("--parent", type=int, required=True)
    parser.add_argument("--memory", type=int, required=True, help="bytes that it may take beside its context")
    parser.add_argument("--device", type=int)
    arguments = parser.parse_args()
    if not end_with(arguments.parent):
        return 0
    hide()
    from gpu import GpuError, Renderer

    with socket.socket(fileno=arguments.descriptor) as end:
        try:
            renderer = Renderer(arguments.device)
            bound_memory(arguments.memory)
            FirstLooks(end, renderer).run()
        except (channel.Closed, GpuError):
            pass
    return 0


class FirstLooks:
    """The tasks that have first looks, each with its newest scene alone."""

    def __init__(self, end: socket.socket, renderer: Renderer) -> None:
        self._end, self._renderer = end, renderer
        self._asked: dict[int, Look] = {}  # by task, not begun
        self._wants: dict[int, Want] = {}
        self._shown: dict[int, FirstLook] = {}

    def run(self) -> None:
        """Work until the renderer is gone, then raise channel.Closed; return when idle for a while."""
        while self._busy or self._hears(IDLE_S):
            while self._hears(0.0):
                self._take(channel.receive(self._end, wait=True))
            self._work()

    @property
    def _busy(self) -> bool:
        return bool(self._asked) or any(look.due for look in self._shown.values())

    def _hears(self, seconds: float) -> bool:
        return bool(select.select([self._end], [], [], seconds)[0])

    def _take(self, message: Look | Wanted | Leave) -> None:
        if isinstance(message, Wanted):
            self._wants[message.task] = message.want
            return
        self._asked.pop(message.task, None)
        if isinstance(message, Look):
            self._asked[message.task] = message
            return
        self._wants.pop(message.task, None)
        if (shown := self._shown.pop(message.task, None)) is not None:
            shown.release()
            self._renderer.tidy()
            trim()

    def _work(self) -> None:
        """Begin what was asked for longest ago, or trace a slice of each that has begun; and show what is wanted."""
        from gpu import CompileError, OutOfMemory, SceneTooLarge

        if self._asked:
            look = self._asked.pop(next(iter(self._asked)))
            try:
                self._begin(look)
            except (CompileError, OutOfMemory, SceneTooLarge) as error:
                log.info("no first look", {"error": error})
        for task, shown in list(self._shown.items()):
            try:
                if shown.due:
                    shown.step()
                if shown.answer(self._wants.get(task)):
                    del self._wants[task]
            except OutOfMemory as error:
                log.info("no first look", {"error": error})
                self._shown.pop(task).release()

    def _begin(self, look: Look) -> None:
        from gpu.precompile import fallback
        from service.worker.view.first_look import FirstLook

        shown = self._shown.setdefault(look.task, FirstLook(look.task, self._send, self._renderer, denoised))
        shown.release()
        scene = self._renderer.load_fallback(look.arrays, fallback.least(look.arrays))
        shown.begin(scene, look.settings, look.generation)

    def _send(self, message: FromRenderer) -> None:
        channel.send(self._end, message)


if __name__ == "__main__":
    raise SystemExit(main())
