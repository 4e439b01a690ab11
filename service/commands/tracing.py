"""One render in this process: the renderer's own task, whose messages go here instead of to a server."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

import numpy as np

from gpu import GpuError
from service.commands import Failed
from service.commands.progress import ProgressLine
from service.ipc import messages
from service.ipc.messages import (
    Done,
    FromRenderer,
    Image,
    Loaded,
    Progress,
    Progressed,
    Read,
    StopRule,
    Update,
    View,
)
from service.quality import forecast
from service.worker.context import WorkerContext
from service.worker.helpers.denoise_client import DenoiseClient
from service.worker.task import Task

if TYPE_CHECKING:
    from gpu import Renderer
    from service.pack import Packed
    from service.quality import ResolvedSettings

NUMBER = 1  # of the only task
SIGNAL_S = 0.1  # how long a signal may go unnoticed while the denoiser works


class Interrupt:
    """Remembers the first SIGINT or SIGTERM; the second one does what it always does."""

    signal: int | None = None

    @contextmanager
    def watch(self) -> Iterator[None]:
        before = {number: signal.signal(number, self._take) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _take(self, number: int, frame: FrameType | None) -> None:
        self.signal = number
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)


class Tracing:
    """A packed scene being rendered. What goes wrong on the GPU is raised as GpuError."""

    def __init__(self, renderer: Renderer, packed: Packed, settings: ResolvedSettings) -> None:
        self.progress = Progress()
        self.warnings = list(packed.warnings)
        self.settings = settings
        self._line = ProgressLine()
        self._reason: str | None = None
        self._kernel: dict[str, Any] | None = None
        self._pixels: np.ndarray | None = None
        self._answered = False
        stop = StopRule(settings.max_samples, settings.time_limit, settings.target_noise)
        self._denoiser = DenoiseClient()
        self._task = Task(WorkerContext(renderer, self._hear, self._denoiser), NUMBER)
        update = Update(NUMBER, 1, packed.arrays, settings.for_gpu(), stop, denoise=settings.denoise)
        self._task.update(update)

    def run(self, interrupt: Interrupt) -> None:
        """Returns when the first limit is reached, or soon after a signal."""
        while self._reason is None:
            if interrupt.signal is None:
                self._go_on()
            else:
                self._task.stop()
                self._go_on()
        self._line.close()

    def pixels(self, view: View) -> np.ndarray:
        """The picture so far. Raises Failed before its first sample."""
        self._pixels, self._answered = None, False
        self._task.read(Read(NUMBER, 1, view))
        while not self._answered:
            self._go_on()  # the AOVs of the first hit are traced when asked for, the picture is denoised
        if self._pixels is None:
            raise Failed("stopped before the first sample: there is no picture yet")
        return self._pixels

    def close(self) -> None:
        self._denoiser.close()

    def _go_on(self) -> None:
        if self._task.ready:
            self._task.turn()
        else:
            self._denoiser.sleep(timeout_s=SIGNAL_S)
        self._denoiser.hear()

    def status(self, setup_s: float) -> dict[str, Any]:
        """The answer of GET /v1/renders/{id} for an ended render."""
        now = self.progress
        return {
            "state": "cancelled" if self._reason == "stopped" else "done",
            "reason": self._reason,
            "samples": now.samples,
            "noise": now.noise,
            "elapsed_s": now.elapsed_s,
            "setup_s": setup_s,
            "kernel": self._kernel,
            "eta_s": now.eta_s,
            "forecast": forecast(now.samples, now.noise, now.elapsed_s),
            "warnings": self.warnings,
            "settings": self.settings.document(),
        }

    def _hear(self, message: FromRenderer) -> None:
        if isinstance(message, Image):
            self._pixels, self._answered = message.pixels, True
        elif isinstance(message, Progressed):
            if self._line.due():
                self._line.show(message.progress)
        elif isinstance(message, messages.Failed):
            raise GpuError(message.detail)
        elif isinstance(message, Loaded | Done):
            if isinstance(message, Loaded):
                self._kernel = message.kernel
            self.warnings += [warning for warning in message.warnings if warning not in self.warnings]
            if isinstance(message, Done):
                self.progress, self._reason = message.progress, message.reason
