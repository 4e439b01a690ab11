"""How a task's render comes to its end, and how its picture comes to the server, which keeps it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from service.ipc.messages import Checkpoint, Done, Progressed, Reason, driver_of
from service.worker.context import WorkerContext
from service.worker.device.checkpoints import Checkpointer
from service.worker.device.residency import Residency
from service.worker.payloads import Result, sent_picture
from service.worker.progress import ProgressTracker
from service.worker.view.frames import FrameSource

if TYPE_CHECKING:
    from gpu import Saved

PROGRESS_S = 0.1  # between two reports of how far a render is


class Ending:
    """Ends the render at its stop rule. Done waits for the denoised picture and for the server's copy."""

    def __init__(
        self,
        context: WorkerContext,
        number: int,
        residency: Residency,
        tracker: ProgressTracker,
        frames: FrameSource,
        answer: Callable[[], bool],
        bands: Callable[[], Sequence[Result]] = tuple,
    ) -> None:
        """`answer` sends the frame that is wanted, which then comes before Done. `bands` gives what is done of blocks
        that are not merged yet, as far as it is worth saving."""
        self._number, self._send = number, context.send
        self._residency, self._tracker, self._frames = residency, tracker, frames
        self._answer, self._bands = answer, bands
        self._saved_bands: Sequence[Result] = ()  # with the picture that is being saved
        self._driver = driver_of(context.renderer.info)
        self._server_keeps = context.forget is not None
        self.checkpoints = Checkpointer(context.checkpoint_s)
        self._reported = 0.0

    @property
    def is_stored(self) -> bool:
        """True if the server keeps this picture: it does those of renders, not those of streams."""
        return self._server_keeps and not self._tracker.interactive

    def checkpoint(self) -> bool:
        """Do a step of saving the picture, where that is due; whether there was one."""
        full, checkpoints = self._residency.full, self.checkpoints
        if not checkpoints.under_way:
            ended, elapsed_s = self._tracker.reason is not None, self._tracker.clock.elapsed_s
            if not self.is_stored or ended or not checkpoints.due(full, elapsed_s):
                return False
            checkpoints.begin(full)
            self._saved_bands = self._bands()
        saved = checkpoints.step()
        if saved is not None and self._tracker.reason is not None:
            self._say_done(saved)
        elif saved is not None:
            progress = self._tracker.progress(self._residency)
            picture, self._saved_bands = sent_picture(saved, self._driver, self._saved_bands), ()
            self._send(Checkpoint(self._number, self._tracker.generation, progress, picture))
        return True

    @property
    def border(self) -> float:
        """The number of samples at which the picture is to be saved, and not traced further before; inf: at any."""
        if not self.is_stored or self._tracker.reason is not None:
            return math.inf
        return self.checkpoints.border(self._residency.full, self._tracker.clock.elapsed_s)

    def end_if_reached(self) -> bool:
        """End where the first limit is reached; whether it is."""
        reason = self._tracker.enough(self._residency)
        if reason is not None:
            self.end(reason)
        return reason is not None

    def end(self, reason: Reason) -> None:
        """End now, for this reason."""
        residency, tracker, frames = self._residency, self._tracker, self._frames
        residency.wake()
        tracker.clock.pause()
        tracker.reason = reason
        residency.touch()
        if residency.loaded is not None:
            noise = tracker.meter.read(residency.full, fresh=True)
            wanted = frames.denoising.covers("color", noise) and frames.scale == 1.0 and reason != "stopped"
            frames.owes_done = wanted and frames.denoising.has(residency.full.samples) is None
        if not frames.owes_done:
            self.finish()

    def finish(self) -> None:
        """Say that the render has ended; where the server keeps the picture, once it has been saved."""
        self._frames.owes_done = False
        if self.is_stored and self._residency.loaded is not None and self._residency.full.samples:
            self.checkpoints.begin(self._residency.full)
        else:
            self._say_done(None)

    def _say_done(self, saved: Saved | None) -> None:
        reason = self._tracker.reason
        assert reason is not None
        self._answer()
        progress = self._tracker.progress(self._residency)
        sent = None if saved is None else sent_picture(saved, self._driver)
        caustics = self._residency.loaded is not None and self._residency.full.traces_caustics
        generation = self._tracker.generation
        self._send(Done(self._number, generation, reason, progress, self.warnings, sent, caustics))

    @property
    def warnings(self) -> list[str]:
        """The warnings about the picture, for the user."""
        known = self._residency.loaded is not None
        warnings = [*self._residency.full.warnings, *self._overrun()] if known else []
        why = self._frames.denoising.warning
        return warnings + ([why] if why else [])

    def _overrun(self) -> list[str]:
        """A warning where the time was over before the first sample was whole."""
        limit_s, took_s = self._tracker.stop.time_limit, self._tracker.clock.elapsed_s
        if limit_s is None or self._tracker.reason != "time_limit" or self._residency.full.samples != 1:
            return []
        if took_s <= 1.5 * limit_s:
            return []
        return [f"the first sample took {took_s:.3g} s, longer than time_limit ({limit_s:.3g} s); it was finished"]

    def report(self) -> None:
        """Report a render's progress now and then; a stream reports it with each frame."""
        now = time.monotonic()
        due = not self._tracker.interactive and now - self._reported >= PROGRESS_S
        if due and self._residency.full.samples:
            self._reported = now
            progress = self._tracker.progress(self._residency)
            self._send(Progressed(self._number, self._tracker.generation, progress))
