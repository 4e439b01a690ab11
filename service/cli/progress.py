"""Shows a render's progress on stderr: a bar that redraws itself on a terminal, else a line now and then."""

from __future__ import annotations

import shutil
import sys
import time
from typing import TextIO

from service.ipc.messages import Progress

BAR_WIDTH = 24
REDRAW_S = 0.2
LINE_S = 10.0  # between lines where the output is no terminal: the log of an hour stays readable


class ProgressLine:
    """Shows Progress on a stream, at most every few tenths of a second; `close` leaves the line behind."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._redraws = self._stream.isatty()
        self._due = time.monotonic() + (REDRAW_S if self._redraws else LINE_S)
        self._drawn = ""

    def due(self) -> bool:
        return time.monotonic() >= self._due

    def show(self, progress: Progress) -> None:
        self._due = time.monotonic() + (REDRAW_S if self._redraws else LINE_S)
        text = describe(progress)
        if not self._redraws:
            print(text, file=self._stream, flush=True)
            return
        if progress.eta_s is not None:
            full = round(BAR_WIDTH * progress.elapsed_s / max(progress.elapsed_s + progress.eta_s, 1e-9))
            text = f"[{'#' * full}{'.' * (BAR_WIDTH - full)}] {text}"
        text = text[: shutil.get_terminal_size().columns - 1]
        # Padding to the last length instead of an escape sequence: dumb terminals show those.
        self._stream.write("\r" + text.ljust(len(self._drawn)))
        self._stream.flush()
        self._drawn = text

    def close(self) -> None:
        if self._drawn:
            self._stream.write("\n")
            self._stream.flush()
            self._drawn = ""


def describe(progress: Progress) -> str:
    parts = [f"{progress.samples} samples"]
    if progress.noise is not None:
        parts.append(f"noise {100 * progress.noise:.3g} %")
    parts.append(_clock(progress.elapsed_s))
    if progress.eta_s is not None:
        parts.append(f"{_clock(progress.eta_s)} left")
    return ", ".join(parts)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
