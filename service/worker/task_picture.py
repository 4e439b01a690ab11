"""The picture of a task: loaded, edited, traced slice by slice, shown on demand, ended by its stop rule."""

from __future__ import annotations

import logging
import time
from enum import Enum

from gpu import GpuError, OutOfMemory, RenderSettings, SceneTooLarge
from service.ipc.leases import undivided
from service.ipc.messages import Discarded, Failed, Loaded, Restore, Update, Want, driver_of
from service.worker.context import WorkerContext
from service.worker.device.memory import Evictable
from service.worker.device.residency import Residency
from service.worker.device.resolution_ladder import FULL_S
from service.worker.division.home import Home
from service.worker.ending import Ending
from service.worker.payloads import saved_bands, saved_picture
from service.worker.progress import ProgressTracker
from service.worker.updates import Updates
from service.worker.view.denoise_policy import DenoisePolicy
from service.worker.view.frames import SLICE_S, FrameSource
from service.worker.view.prior import PriorGuess

WATCHED_FROM = 64  # samples: a picture that somebody watches, or whose noise is judged, is shared from there on

log = logging.getLogger(__name__)


class Phase(Enum):
    """The picture's next step; derived from what there is, so that the two cannot disagree."""

    EMPTY = "nothing was loaded, or that failed"
    COMPILING = "an update waits for its kernel"
    UPDATING = "an update is to be applied"
    TRACING = "samples are added"
    SAVING = "the picture is read for the server, which keeps it"
    ENDED = "the render has reached its end"


class TaskPicture:
    """Joins the owners of what a picture is made of: the update that waits, the device's memory, progress, frames,
    the division among renderers, and the end. A step is done whenever the task has a turn."""

    def __init__(self, context: WorkerContext, number: int, client: str, holder: Evictable) -> None:
        """`holder`: the task, through which other tasks evict the picture from the device."""
        self.attempted = 0  # the generation of the last update
        self.traced = 0  # samples of pixels
        self._number, self._client = number, client
        self._renderer = renderer = context.renderer
        self._send, self._forget = context.send, context.forget
        self.residency = Residency(renderer, context.memory, holder, self._part)
        self.tracker = ProgressTracker()
        denoising = DenoisePolicy(context.denoiser, yields=bool(renderer.info["software"]))
        self.prior = PriorGuess(renderer, self.residency.make_room)
        shown = denoising, self.prior
        self.frames = FrameSource(context, number, client, self.residency, self.tracker, *shown, self._finish)
        self.home = Home(number, context.send)
        self.ending = Ending(context, number, self.residency, self.tracker, self.frames, self.answer, self.home.bands)
        self._sharers = context.sharers
        self.updates = Updates(context, number, client, self.residency, self.tracker)
        self._scale = 1.0  # of what is traced

    @property
    def phase(self) -> Phase:
        if self.updates.pending is not None:
            return Phase.COMPILING if self.updates.compiling else Phase.UPDATING
        if not self.residency.there:
            return Phase.EMPTY
        if self.ending.checkpoints.under_way:
            return Phase.SAVING
        return Phase.TRACING if self.tracker.reason is None else Phase.ENDED

    @property
    def waiting(self) -> bool:
        """True if there is nothing to trace or to save here before an assistant answers."""
        return self.home.waiting and not self.ending.checkpoints.hastened

    @property
    def unseen(self) -> bool:
        """True if a person waits for the first frame of something."""
        updates, pending, interactive = self.updates, self.updates.pending, self.tracker.interactive
        if updates.previews:
            return not updates.previewed
        if pending is not None and (pending.restarts or self.residency.loaded is None):
            return pending.interactive or interactive
        return self.frames.scale is None and interactive

    @property
    def loads(self) -> bool:
        """True if the next step may take as long as a compilation does."""
        return self.phase in (Phase.COMPILING, Phase.UPDATING)

    def step(self, paused: bool, only_applies: bool = False) -> None:
        """Apply updates, trace a slice, and end the render when that was the last. While `paused`, only a first look
        at what is new is traced. With `only_applies` an update is applied and nothing traced, as messages wait behind
        it, such as the picture to go on with."""
        pending = self.updates.pending
        if self.phase is Phase.COMPILING:
            self.traced += self.updates.trace_preview()
            return
        if pending is not None:
            self.attempted = pending.generation
            if self.updates.begin_to_wait(pending, paused):
                return
            self._apply(pending)
            if only_applies:
                return
        if self.updates.stops:
            self.stop()
        residency = self.residency
        residency.wake()
        if residency.loaded is None or self.frames.step() or self.ending.checkpoint():
            return
        if self.tracker.reason is not None:
            return
        if not self.ending.end_if_reached():
            self._trace(paused)
        residency.touch()

    def _trace(self, paused: bool) -> None:
        residency, tracker, scale = self.residency, self.tracker, self._scale
        lacking = self.prior.lacks(residency.ladder, tracker.pixel_s) if tracker.interactive else None
        if scale == 1.0 and lacking is not None:
            residency.insist(lambda: residency.ladder.picture(lacking).trace(FULL_S, 1))
            return
        if scale == 1.0 and tracker.interactive and self.prior.lacks_depth(residency.full):
            traced = self.frames.trace_first_hit(residency.full)
            self.prior.has_depth = traced is True
            if traced is not None:
                return
        picture = residency.ladder.picture(scale)
        cap = 1 if self.unseen or scale < 1.0 else tracker.cap(residency)
        tracker.clock.start()
        before = picture.samples
        if scale == 1.0 and self._divides:
            watched, most = tracker.interactive, cap
            cap = residency.insist(
                lambda: self.home.cap(picture, most, tracker.generation, self._divided_from, watched)
            )
        budget_s = FULL_S if self.unseen else SLICE_S
        sharers = self._sharers(self._client) if tracker.interactive else 1  # nobody waits for a render's next pass
        if picture.block.shared:
            self.home.trace(budget_s)
        else:
            most = int(min(cap, self.ending.border)) if scale == 1.0 else cap
            residency.insist(lambda: picture.trace(budget_s, most, sharers))  # the second block takes memory
        tracker.clock.lap()
        if picture.samples != before:
            pixels = picture.settings.width * picture.settings.height
            self.traced += (picture.samples - before) * pixels - self.home.take_foreign()
        tracker.pixel_s = picture.cost_s or tracker.pixel_s
        if picture.samples:
            self.frames.scale = scale
            if scale < 1.0:
                self._scale = residency.ladder.next(scale, tracker.pixel_s)
        if paused and not self.unseen:
            tracker.clock.pause()
        if scale == 1.0:
            tracker.even = picture.samples >= cap
            tracker.eta.passed(picture.samples, tracker.clock.elapsed_s)
            if not self.ending.end_if_reached():
                self.ending.report()

    @property
    def _divides(self) -> bool:
        """True if parts of the picture may be traced elsewhere."""
        settings, stop = self.residency.full.settings, self.tracker.stop
        return undivided(settings.adaptive, stop.time_limit) is None

    @property
    def _divided_from(self) -> int:
        """The first sample that may be shared. While somebody looks on, or noise is judged at borders inside of a
        block, the first ones are traced here."""
        alone = self.tracker.interactive or self.tracker.stop.target_noise is not None
        return WATCHED_FROM if alone else 0

    def _apply(self, update: Update) -> None:
        """Apply the pending update; where it fails, report that and leave everything as it was."""
        self.updates.pending, self.attempted = None, update.generation
        self._try(update)
        self.updates.applied(update)

    def _try(self, update: Update) -> None:
        began, tracker, residency, updates = time.monotonic(), self.tracker, self.residency, self.updates
        edited = updates.edited(update)
        if edited is None:
            return  # its first one failed, which was said; only a whole scene helps
        settings = RenderSettings(**update.settings) if update.settings is not None else updates.settings
        assert settings is not None  # a task's first update has them
        self._keep(update)
        try:
            updates.check()
            made = residency.change(update, edited, settings)
        except GpuError as error:
            fallback = self.tracker.generation if residency.there else None
            refused = isinstance(error, OutOfMemory | SceneTooLarge)
            updates.stops = False
            self._send(Failed(self._number, update.generation, str(error), refused, fallback=fallback))
            return
        if made is not None:
            self.release()
            residency.loaded = made
        tracker.generation = update.generation
        updates.settings, tracker.stop = settings, update.stop or tracker.stop
        if update.denoise is not None:
            self.frames.denoising.want(update.denoise)
        if update.scene is not None:
            tracker.interactive = update.interactive
        tracker.reason, self.frames.owes_done = None, False
        self.ending.checkpoints.restart()
        if update.restarts:
            self._restart()
        if update.may_not_fit:
            setup_s, full = time.monotonic() - began, residency.full
            kernel = full.compile_ms + updates.take_compile_ms(), full.scene.features, full.scene.spared
            head = self._number, self.tracker.generation, setup_s, *kernel, self.ending.warnings
            self._send(Loaded(*head, full.traces_caustics))
        if update.scene is not None or update.settings is not None:
            updates.foresee(settings)

    def _keep(self, update: Update) -> None:
        """Keep the picture that is about to be edited, as a guess at the next one; or none, where that is another."""
        residency, latest = self.residency, self.frames.denoising.latest
        if update.scene is not None or update.settings is not None:
            self.prior.release()
        elif update.restarts and self.tracker.interactive and residency.loaded is not None:
            self.prior.keep(residency.ladder, latest.pixels if latest and latest.scale == 1.0 else None)

    def evict(self) -> None:
        """Leave the device: for the machine's memory, or for good where the server has the picture already."""
        if self._forget is not None and self.ending.is_stored:
            self._part()
            self._forget(self._number)
        else:
            self.residency.offload()

    def restore(self, restore: Restore) -> None:
        """Go on with a saved picture of the scene, unless another driver or version saved it."""
        if self.residency.loaded is None:
            return
        tracker, full = self.tracker, self.residency.full
        saved = saved_picture(restore.saved, full.settings)
        others = restore.reason is None and restore.saved.driver not in ("", driver_of(self._renderer.info))
        if others or not full.fits(saved, goes_on=restore.reason is None):
            log.warning("another driver or version saved this picture, which begins again", {"task": self._number})
            if restore.reason is None:
                self._send(Discarded(self._number))
            return
        self.residency.insist(lambda: full.restore(saved))
        self.home.resume(saved_bands(restore.saved, full.settings))
        tracker.reason, self.frames.scale = restore.reason, 1.0
        tracker.clock.set(restore.progress.elapsed_s)
        tracker.meter.set(restore.progress.samples, restore.progress.noise)
        tracker.eta.passed(saved.samples, restore.progress.elapsed_s)
        tracker.even = not saved.under_way[0]
        self.ending.checkpoints.restart()

    def request_frame(self, want: Want) -> None:
        """Note which frame is wanted; `answer` sends it."""
        # A view of the first hits has more samples of them traced than a guess needs.
        self.prior.wanted = want.view.prior and want.view.aov == "color"
        self.frames.denoising.set_view(want.view)
        self.frames.want = want

    def answer(self) -> bool:
        """Send the frame that is wanted, if it would show something new."""
        if self.updates.pending is None:
            return self.frames.answer()
        seen = self.updates.answer(self.frames.want)
        if seen:
            self.frames.want = None
        return seen

    def stop(self) -> None:
        """End the render; an update that waits is applied first, unless the render has not even begun."""
        updates, pending, checkpoints = self.updates, self.updates.pending, self.ending.checkpoints
        if pending is not None and not pending.interactive and self.residency.loaded is None:
            updates.pending, self.tracker.generation = None, pending.generation
            self.ending.end("stopped")
        elif pending is not None:
            updates.stops = True
        else:
            updates.stops = False
            if self.tracker.reason is None or not checkpoints.under_way:
                checkpoints.restart()
                self.ending.end("stopped")

    def release(self) -> None:
        """Free the device's memory; the picture can be loaded again."""
        self.ending.checkpoints.restart()
        self.home.restart()
        self.updates.release()
        self.residency.release()
        self.frames.forget()

    def fail(self) -> None:
        """Give up its state after an unexpected error; a whole scene revives it."""
        self.updates.pending, self.updates.stops = None, False
        self.release()

    def _finish(self) -> None:
        self.ending.finish()

    def _part(self) -> None:
        """Have all helpers let go of resources that are about to leave the device."""
        self.prior.release()
        self.frames.part()

    def _restart(self) -> None:
        """Begin a picture without samples, at a scale that can be shown soon where a person looks on."""
        self.frames.restart()
        self.prior.restart()
        self.tracker.restart()
        self.home.restart()
        first = self.residency.loaded is not None and self.tracker.interactive
        self._scale = self.residency.ladder.first(self.tracker.pixel_s) if first else 1.0
        seen = self.updates.shown(self.tracker.generation)
        if self._scale <= seen:
            self._scale = self.residency.ladder.next(seen, self.tracker.pixel_s)
