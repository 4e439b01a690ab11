"""The renderer's side of the process that denoises: one picture at a time, and no task waits for it."""

from __future__ import annotations

import contextlib
import logging
import select
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gpu import denoise
from service.ipc import channel
from service.worker.helpers.process import HelperProcess

# How long a stream waits for its denoised frame, and in times of what the last one took; then it goes on without.
PATIENCE_S, PATIENCE = 3.0, 3.0
TRIES = 3  # deaths in a row; then nothing is denoised any more, and the reason is told
NOT_INSTALLED = "Open Image Denoise (the Python package pyoidn) is not installed"
DIED = "the denoiser ended unexpectedly"

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class DenoiseRequest:
    """A picture to denoise, as gpu.denoise.denoise takes it."""

    color: np.ndarray
    albedo: np.ndarray | None
    normal: np.ndarray | None
    fine: bool


@dataclass(frozen=True)
class DenoiseResult:
    """The denoised picture; or None and why not, `missing` when no other will fare better."""

    pixels: np.ndarray | None
    detail: str = ""
    missing: bool = False


@dataclass(frozen=True)
class Located:
    """Where pictures are denoised beside a GPU, and why not there."""

    place: str
    detail: str = ""


class DenoiseClient:
    """Denoises in a process that starts at the first request and ends when idle for a while."""

    def __init__(self, gpu: int | None = None, located: Callable[[str], None] | None = None) -> None:
        """`gpu`: EGL's number of the device that renders, where that is a GPU. Then `located` gets the place where
        pictures are denoised, once that is known and where it changes."""
        self._gpu, self._place, self._located = gpu, "", located
        self.missing: str | None = NOT_INSTALLED if denoise.version() is None else None  # why nothing is denoised
        given = [] if gpu is None else ["--gpu", str(gpu)]
        self._helper = HelperProcess("service.worker.helpers.denoise_main", *given)
        self._on_done: Callable[[DenoiseResult], None] | None = None
        self._deaths = 0
        self._asked_at = self._took_s = 0.0

    @property
    def busy(self) -> bool:
        return self._on_done is not None

    @property
    def has_answered(self) -> bool:
        """True if its process is there and has loaded what it needs."""
        return self._took_s > 0.0 and bool(self.ends)

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
        """The sockets to wait on."""
        return self._helper.ends

    @property
    def process_id(self) -> int | None:
        return self._helper.process_id

    def start(self) -> None:
        """Have the process there before the first picture, as it loads its library for most of a second."""
        if self.missing is None and not self.busy:
            with contextlib.suppress(OSError):  # the first request says why
                self._helper.start()

    def locate(self) -> None:
        """Begin to ask where pictures are denoised: beside a GPU only its process can say."""
        if self._gpu is not None:
            self.start()

    def ask(self, order: DenoiseRequest, on_done: Callable[[DenoiseResult], None]) -> None:
        """Begins; `on_done` is called from `hear` when it is done. Only when not `busy`."""
        self._on_done, self._asked_at = on_done, time.monotonic()
        self._helper.ask(order)

    def hear(self) -> None:
        """Pass on a denoised picture, if there is one."""
        try:
            delivery: DenoiseResult | Located = self._helper.hear()
        except BlockingIOError:
            return
        except channel.Closed:
            self.close()
            if not self.busy:
                return
            self._deaths += 1
            delivery = DenoiseResult(None, DIED, missing=self._deaths >= TRIES)
        else:
            if isinstance(delivery, Located):
                return self._take_place(delivery)
            self._deaths = 0
            self._took_s = time.monotonic() - self._asked_at
        if delivery.detail:
            log.warning("could not denoise", {"error": delivery.detail})
        if delivery.missing:
            self.missing = delivery.detail
        on_done, self._on_done = self._on_done, None
        if on_done is not None:
            on_done(delivery)

    def _take_place(self, news: Located) -> None:
        if news.place == self._place:  # as before its process ended
            return
        self._place = news.place
        if news.detail:
            log.warning("the processor denoises beside a GPU", {"reason": news.detail})
        if self._located is not None:
            self._located(news.place)

    def sleep(self, other: socket.socket | None = None, timeout_s: float | None = None) -> None:
        """Sleep until there is an answer here, or a message on `other`."""
        select.select([*self.ends, *([] if other is None else [other])], [], [], timeout_s)

    def close(self) -> None:
        self._helper.close()


def denoise_request(color: np.ndarray, guides: tuple[np.ndarray, np.ndarray] | None, fine: bool) -> DenoiseRequest:
    albedo, normal = (None, None) if guides is None else map(np.ascontiguousarray, guides)
    return DenoiseRequest(np.ascontiguousarray(color), albedo, normal, fine)
