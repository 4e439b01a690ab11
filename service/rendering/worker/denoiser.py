"""The renderer's hold on the process that denoises: one picture at a time, and nobody waits for it."""

from __future__ import annotations

import logging
import os
import select
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpu import denoise
from service.rendering import link

ROOT = Path(__file__).parents[3]
# How long a stream waits for its denoised frame, and in times of what the last one took; then it goes on without.
PATIENCE_S, PATIENCE = 3.0, 3.0
TRIES = 3  # deaths in a row; then nothing is denoised any more, and the reason is told
NOT_INSTALLED = "Open Image Denoise (the Python package pyoidn) is not installed"
DIED = "the denoiser ended unexpectedly"

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Order:
    """A picture to denoise, as gpu.denoise.denoise takes it."""

    color: np.ndarray
    albedo: np.ndarray
    normal: np.ndarray
    fine: bool


@dataclass(frozen=True)
class Delivery:
    """The denoised picture; or None and why not, `missing` when no other will fare better."""

    pixels: np.ndarray | None
    detail: str = ""
    missing: bool = False


class Denoiser:
    """Its process starts with the first order and ends when idle for a while."""

    def __init__(self) -> None:
        self.missing: str | None = NOT_INSTALLED if denoise.version() is None else None  # why it does nothing
        self._process: subprocess.Popen[bytes] | None = None
        self._end: socket.socket | None = None
        self._told: Callable[[Delivery], None] | None = None
        self._deaths = 0
        self._asked_at = self._took_s = 0.0

    @property
    def busy(self) -> bool:
        return self._told is not None

    @property
    def left_s(self) -> float | None:
        """How much longer its answer is worth waiting for, at least 0; None when there is none to come."""
        patience_s = max(PATIENCE_S, PATIENCE * self._took_s)
        return max(self._asked_at + patience_s - time.monotonic(), 0.0) if self.busy else None

    @property
    def late(self) -> bool:
        """Busier machines starve it, as it runs at the lowest priority: what waits for it is to go on."""
        return self.left_s == 0.0

    @property
    def ends(self) -> list[socket.socket]:
        """Where it may be heard from."""
        return [] if self._end is None else [self._end]

    def ask(self, order: Order, told: Callable[[Delivery], None]) -> None:
        """Begins; `told` is called from `hear` when it is done. Only when not `busy`."""
        self._told, self._asked_at = told, time.monotonic()
        try:
            link.send(self._begin(), order)
        except link.Closed:  # it had just ended, being idle
            self.close()
            link.send(self._begin(), order)

    def hear(self) -> None:
        """Hands on what was denoised, if anything was."""
        if self._end is None:
            return
        try:
            delivery: Delivery = link.receive(self._end)
        except BlockingIOError:
            return
        except link.Closed:
            self.close()
            if not self.busy:
                return
            self._deaths += 1
            delivery = Delivery(None, DIED, missing=self._deaths >= TRIES)
        else:
            self._deaths = 0
            self._took_s = time.monotonic() - self._asked_at
        if delivery.detail:
            log.warning("not denoised: %s", delivery.detail)
        if delivery.missing:
            self.missing = delivery.detail
        told, self._told = self._told, None
        if told is not None:
            told(delivery)

    def sleep(self, other: socket.socket | None = None, timeout_s: float | None = None) -> None:
        """Until there is something to hear here, or from `other`."""
        select.select([end for end in (self._end, other) if end is not None], [], [], timeout_s)

    def close(self) -> None:
        if self._end is not None:
            self._end.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._end = self._process = None

    def _begin(self) -> socket.socket:
        if self._end is None:
            self._end, theirs = link.pair()
            module = "service.rendering.worker.denoising"
            command = [sys.executable, "-m", module, str(theirs.fileno()), "--parent", str(os.getpid())]
            self._process = subprocess.Popen(
                command,
                pass_fds=[theirs.fileno()],
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                process_group=0,  # Ctrl-C in a terminal is for the parent
            )
            theirs.close()
        return self._end


def order(color: np.ndarray, guides: tuple[np.ndarray, np.ndarray], fine: bool) -> Order:
    return Order(np.ascontiguousarray(color), np.ascontiguousarray(guides[0]), np.ascontiguousarray(guides[1]), fine)
