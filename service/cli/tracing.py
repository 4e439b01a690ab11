"""One render in this process, from its beginning to its status."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

from service.cli import Failed
from service.cli.progress import ProgressLine
from service.document.quality import forecast
from service.ipc.messages import Done, FromRenderer, Loaded, Progress, Progressed, View
from service.worker.in_process import InProcessRenderer

if TYPE_CHECKING:
    import numpy as np

    from service.document.quality import ResolvedSettings
    from service.pack import Packed


class Interrupt:
    """Records the first SIGINT or SIGTERM; a second one ends the process as usual."""

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
    """A packed scene being rendered in this process. Its methods raise GpuError."""

    def __init__(self, renderer: InProcessRenderer, packed: Packed, settings: ResolvedSettings) -> None:
        self.progress = Progress()
        self.warnings = list(packed.warnings)
        self.settings = settings
        self._line = ProgressLine()
        self._reason: str | None = None
        self._kernel: dict[str, Any] | None = None
        self._render = renderer.render(packed.arrays, settings, self._receive)

    def run(self, interrupt: Interrupt) -> None:
        """Render until the first limit is reached, or until soon after a signal."""
        while self._reason is None:
            if interrupt.signal is not None:
                self._render.stop()
            self._render.step()
        self._line.close()

    def pixels(self, view: View) -> np.ndarray:
        """The picture so far. Raises Failed before its first sample."""
        pixels = self._render.pixels(view)
        if pixels is None:
            raise Failed("stopped before the first sample: there is no picture yet")
        return pixels

    def close(self) -> None:
        self._render.close()

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

    def _receive(self, message: FromRenderer) -> None:
        if isinstance(message, Progressed):
            if self._line.due():
                self._line.show(message.progress)
        elif isinstance(message, Loaded | Done):
            if isinstance(message, Loaded):
                self._kernel = message.kernel
            self.warnings += [warning for warning in message.warnings if warning not in self.warnings]
            if isinstance(message, Done):
                self.progress, self._reason = message.progress, message.reason
