"""One render asked for over REST: its scene, its progress and its picture."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import secrets
import time
from typing import Any, Literal

import numpy as np

from service.pack import Packed
from service.problems import Conflict, FieldError, Gone, Internal, InvalidDocument, ServiceError, answer, problem
from service.quality import ResolvedSettings, forecast
from service.rendering.ipc.messages import (
    Done,
    Failed,
    FromRenderer,
    Image,
    KernelMeasured,
    Loaded,
    MeasureKernel,
    Progress,
    Progressed,
    Read,
    Stop,
    Update,
    View,
)
from service.rendering.renderers import Renderers
from service.rendering.requests.request_reader import stop_rule, weight

State = Literal["queued", "running", "done", "cancelled", "failed"]

UNASKED = KernelMeasured(0, "Not measured yet: GET this render with ?saving=true, and wait=60 to wait for it.")
ASKED = KernelMeasured(
    0, "To be measured as soon as nothing is being rendered: ask again, or wait for it with wait=60."
)
PATIENCE_S = 30.0  # for the first sample after the renderer was lost
ID_BYTES = 16  # 128 bits: an id cannot be guessed
PICTURE_BYTES = 128  # a pixel's, in the renderer: three vec4, two more with the AOVs, the noise meter's, the denoised


class Job:
    """A render, on the event loop. Once finished, it keeps its picture in the renderer until `release`."""

    def __init__(
        self,
        renderers: Renderers,
        packed: Packed,
        settings: ResolvedSettings,
        setup_s: float,
        owner: str = "",
        document: bytes = b"",
    ) -> None:
        """`owner` may ask for it, others may not; `document` is the scene as `parsing.folded` gave it."""
        self.id = secrets.token_urlsafe(ID_BYTES)
        self.owner = owner
        self.document = document
        self.ended_at = 0.0  # by the monotonic clock, once it is finished
        self.state: State = "queued"
        self.finished = asyncio.Event()
        self.bytes = settings.render_width * settings.render_height * PICTURE_BYTES + weight(packed) + len(document)
        self._renderers = renderers
        self._packed: Packed | None = packed
        self._settings = settings
        self._warnings = list(packed.warnings)
        self._setup_s = setup_s
        self._progress = Progress()
        self._reason: str | None = None
        self._kernel: dict[str, Any] | None = None  # before it is compiled
        self._kernel_measured = UNASKED
        self._answered = asyncio.Event()  # set once the renderer has answered about its kernel
        self._error: ServiceError | None = None
        self._task: int | None = None
        self._reads: dict[int, asyncio.Future[Image]] = {}
        self._serials = itertools.count(1)
        self._sampled = asyncio.Event()  # cleared while there are no samples any more, the renderer having been lost
        self._sampled.set()

    async def run(self) -> None:
        """Take the render from queued to finished, however it ends."""
        if self._packed is None:
            return
        try:
            self._task = self._renderers.open(self, "render", self.owner or "anybody")
            arrays, self._packed = self._packed.arrays, None
            settings, stop = self._settings.for_gpu(), stop_rule(self._settings)
            update = Update(self._task, 1, arrays, settings, stop, denoise=self._settings.denoise)
            await self._renderers.send_scene(update)
            if self.finished.is_set():  # cancelled meanwhile: that message went ahead of the scene
                self._renderers.send(Stop(self._task))
        except ServiceError as error:
            self._fail(error)
        await self.finished.wait()

    def cancel(self) -> None:
        """Stop at once; the image so far stays."""
        if self.finished.is_set():
            return
        self.state, self._packed = "cancelled", None
        if self._task is not None:
            self._renderers.send(Stop(self._task))
        self._finish()

    def release(self) -> None:
        """Forget the picture."""
        if self._task is not None:
            self._renderers.drop(self._task)
            self._task = None

    def measure_kernel(self) -> None:
        """Have the renderer measure what the kernel saves, when it has nothing else to do."""
        if self._kernel_measured.sample_s is None and self._error is None:
            self._kernel_measured = ASKED
            self._answered.clear()
            if self._kernel is not None and self._task is not None:
                self._renderers.send(MeasureKernel(self._task))

    async def settled(self, measured: bool) -> None:
        """Return when the render is finished; with `measured`, once its kernel has been measured too."""
        await self.finished.wait()
        if measured and self._kernel is not None and self._task is not None:
            await self._answered.wait()

    @property
    def settings(self) -> ResolvedSettings:
        return self._settings

    def status(self) -> dict[str, Any]:
        progress = self._progress
        status: dict[str, Any] = {
            "id": self.id,
            "state": self.state,
            "reason": self._reason,
            "samples": progress.samples,
            "noise": progress.noise,
            "elapsed_s": progress.elapsed_s,
            "setup_s": self._setup_s,
            "kernel": None if self._kernel is None else self._kernel | self._kernel_measured.kernel,
            "eta_s": None if self.state in ("cancelled", "failed") else progress.eta_s,
            "forecast": forecast(progress.samples, progress.noise, progress.elapsed_s, progress.missing),
            "warnings": self._warnings,
            "settings": self._settings.document(),
        }
        return status if self._error is None else status | {"problem": problem(self._error)}

    async def image(self, view: View) -> tuple[np.ndarray, Progress]:
        """The picture so far. Raises Conflict before the first sample, and the render's own error where it failed."""
        if self._error is not None:
            raise self._error
        if self._task is None:
            raise Conflict("There is no sample yet.")
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._sampled.wait(), PATIENCE_S)
        if self._task is None:
            raise self._error or Conflict("There is no sample yet.")
        serial = next(self._serials)
        self._reads[serial] = asyncio.get_running_loop().create_future()
        self._renderers.send(Read(self._task, serial, view))
        image = await self._reads[serial]
        if image.pixels is None:
            raise Conflict("There is no sample yet.")
        return image.pixels, image.progress

    def heard(self, message: FromRenderer) -> None:
        if isinstance(message, Image):
            self._answer(message.serial, message)
        elif isinstance(message, Loaded):
            self._setup_s += message.setup_s
            self._kernel = message.kernel
            if self._kernel_measured is ASKED:
                self.measure_kernel()
            self._warnings += message.warnings
            if self.state == "queued":
                self.state = "running"
        elif isinstance(message, Progressed):
            self._progress = message.progress
            if message.progress.samples:
                self._sampled.set()
        elif isinstance(message, KernelMeasured):
            self._kernel_measured = message
            self._answered.set()
        elif isinstance(message, Done):
            self._end(message)
        elif isinstance(message, Failed):
            error = error_of(message)
            if message.serial is not None:
                self._answer(message.serial, error)
            else:
                self._fail(error)

    def again(self) -> None:
        """Another renderer begins the render again; a cancelled one has no image until that has samples."""
        if self._progress.samples:
            self._sampled.clear()
        if not self.finished.is_set():
            self._progress = Progress()

    def lost(self, detail: str) -> None:
        self._task = None
        if self.finished.is_set():
            self._forget(Gone(detail))
        else:
            self._fail(Internal(detail))

    def _end(self, done: Done) -> None:
        self._progress, self._reason = done.progress, done.reason
        self._sampled.set()
        self._warnings += [warning for warning in done.warnings if warning not in self._warnings]
        if not self.finished.is_set():
            self.state = "cancelled" if done.reason == "stopped" else "done"
            self._finish()

    def _finish(self) -> None:
        self.ended_at = time.monotonic()
        self.finished.set()

    def _fail(self, error: ServiceError) -> None:
        self.state = "failed"
        self._renderers.statistics.errors[answer(error).type] += 1
        self._forget(error)
        self._finish()

    def _forget(self, error: ServiceError) -> None:
        self._error, self._packed = error, None
        self._sampled.set()
        self._answered.set()
        for serial in list(self._reads):
            self._answer(serial, error)

    def _answer(self, serial: int, answer: Image | ServiceError) -> None:
        future = self._reads.pop(serial, None)
        if future is None or future.done():
            return
        if isinstance(answer, ServiceError):
            future.set_exception(answer)
        else:
            future.set_result(answer)


def error_of(failed: Failed) -> ServiceError:
    return InvalidDocument([FieldError("/scene", failed.detail)]) if failed.refused else Internal(failed.detail)
