"""One client's picture: loaded, edited, traced slice by slice, shown on demand, ended by its stop rule."""

from __future__ import annotations

import logging
import time
from enum import Enum

from gpu import GpuError, OutOfMemory, RenderSettings, SceneTooLarge
from service.ipc.leases import undivided
from service.ipc.messages import Discarded, Failed, Loaded, Read, Restore, Update, Want, driver_of
from service.worker.context import WorkerContext
from service.worker.device.residency import Residency
from service.worker.device.resolution_ladder import FULL_S
from service.worker.division.home import Home
from service.worker.ending import Ending
from service.worker.payloads import saved_bands, saved_picture
from service.worker.progress.progress import ProgressTracker
from service.worker.scheduler import Account
from service.worker.updates import Updates
from service.worker.view.denoise_policy import DenoisePolicy
from service.worker.view.frames import SLICE_S, FrameSource

HOLD_S = 2.0  # an edit that takes longer to pack has to share the processor
WATCHED_FROM = 64  # samples: a picture that somebody watches, or whose noise is judged, is shared from there on

log = logging.getLogger(__name__)


class Phase(Enum):
    """What a task does in its next turn; derived from what it has, so that the two cannot disagree."""

    EMPTY = "nothing was loaded, or that failed"
    COMPILING = "an update waits for its kernel"
    UPDATING = "an update is to be applied"
    TRACING = "samples are added"
    SAVING = "the picture is read for the server, which keeps it"
    ENDED = "the render has reached its end"


class Task:
    """Applies messages in its turns: call `turn` while it is `ready`, and `answer` when a frame is wanted."""

    def __init__(self, context: WorkerContext, number: int, client: str = "") -> None:
        self.number, self.client = number, client
        self.attempted = 0  # the generation of the last update
        self.account = Account()
        self.traced = 0  # samples of pixels
        self._renderer = renderer = context.renderer
        self._send, self._forget = context.send, context.forget
        self._residency = Residency(renderer, context.memory, self, self._part)
        self._tracker = ProgressTracker()
        denoising = DenoisePolicy(context.denoiser, yields=bool(renderer.info["software"]))
        self._frames = FrameSource(context, number, client, self._residency, self._tracker, denoising, self._finish)
        self.home = Home(number, context.send)
        self._ending = Ending(
            context, number, self._residency, self._tracker, self._frames, self.answer, self.home.bands
        )
        self._sharers = context.sharers
        self._updates = Updates(context, number, client, self._residency, self._tracker)
        self._scale = 1.0  # of what is traced
        self._paused = self._away = False
        self._held_until = 0.0  # by the monotonic clock

    @property
    def phase(self) -> Phase:
        if self._updates.pending is not None:
            return Phase.COMPILING if self._updates.compiling else Phase.UPDATING
        if not self._residency.there:
            return Phase.EMPTY
        if self._ending.checkpoints.under_way:
            return Phase.SAVING
        return Phase.TRACING if self._tracker.reason is None else Phase.ENDED

    @property
    def generation(self) -> int:
        return self._tracker.generation

    @property
    def wanted(self) -> bool:
        """Whether a frame is wanted."""
        return self._frames.want is not None

    @property
    def ready(self) -> bool:
        """Whether a turn would do anything."""
        phase, stands = self.phase, self._paused or self._frames.denoising.holds
        if self._away or phase is Phase.EMPTY:
            return False
        if phase is Phase.COMPILING:
            return self._updates.preview.due and not self._paused
        if phase in (Phase.UPDATING, Phase.SAVING) or self._frames.due:
            return True
        return phase is Phase.TRACING and (self.unseen or not (stands or self._held_s)) and not self._waiting

    @property
    def _waiting(self) -> bool:
        """Whether there is nothing to trace or to save here before an assistant answers."""
        return self.home.waiting and not self._ending.checkpoints.hastened

    @property
    def unseen(self) -> bool:
        """Whether a person waits for the first frame of something."""
        updates, pending, interactive = self._updates, self._updates.pending, self._tracker.interactive
        if updates.previews:
            return updates.preview.scale is None
        if pending is not None and (pending.restarts or self._residency.loaded is None):
            return pending.interactive or interactive
        return self._frames.scale is None and interactive

    @property
    def loads(self) -> bool:
        """Whether its next turn may take as long as a compilation does."""
        return self.phase in (Phase.COMPILING, Phase.UPDATING)

    @property
    def awaited(self) -> bool:
        """Whether a stall of the loop would be noticed: there is work, or a person who may edit at any moment."""
        if self.loads:
            return True
        return self._residency.there and not self._away and (self._tracker.interactive or self.ready)

    @property
    def idle(self) -> bool:
        """Whether its memory on the device may be taken."""
        waited_for = self.ready or self.home.waiting or self._frames.awaited or self._frames.denoising.pending
        return self._residency.loaded is not None and not waited_for

    @property
    def left_s(self) -> float | None:
        """Seconds until it is ready by itself; None where it is not, or is already."""
        return self.home.left_s if self.home.waiting else self._held_s or None

    @property
    def _held_s(self) -> float:
        """Seconds for which it goes on standing still, unless an update comes."""
        return max(0.0, self._held_until - time.monotonic())

    @property
    def bytes(self) -> int:
        return self._residency.bytes + self._updates.preview.bytes

    @property
    def rested_since(self) -> float:
        return self._residency.rested_since

    def update(self, update: Update) -> None:
        """Take an update, which the next turn applies together with others that wait."""
        self._held_until = 0.0
        self._updates.join(update)

    def turn(self) -> None:
        """Apply updates, trace a slice, and end the render when that was the last."""
        pending = self._updates.pending
        if self.phase is Phase.COMPILING:
            self.traced += self._updates.preview.step()
            return
        if pending is not None:
            self.attempted = pending.generation
            if self._updates.begin_to_wait(pending, self._paused):
                return
            self._apply(pending)
        if self._updates.stops:
            self.stop()
        residency = self._residency
        residency.wake()
        if residency.loaded is None or self._frames.step() or self._ending.checkpoint():
            return
        if self._tracker.reason is not None:
            return
        if not self._ending.end_if_reached():
            self._trace()
        residency.rests()

    def _trace(self) -> None:
        residency, tracker, scale = self._residency, self._tracker, self._scale
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
        sharers = self._sharers(self.client) if tracker.interactive else 1  # nobody waits for a render's next pass
        if picture.block.shared:
            self.home.trace(budget_s)
        else:
            most = int(min(cap, self._ending.border)) if scale == 1.0 else cap
            residency.insist(lambda: picture.trace(budget_s, most, sharers))  # the second block takes memory
        tracker.clock.lap()
        if picture.samples != before:
            pixels = picture.settings.width * picture.settings.height
            self.traced += (picture.samples - before) * pixels - self.home.take_foreign()
        tracker.pixel_s = picture.cost_s or tracker.pixel_s
        if picture.samples:
            self._frames.scale = scale
            if scale < 1.0:
                self._scale = residency.ladder.next(scale, tracker.pixel_s)
        if self._paused and not self.unseen:
            tracker.clock.pause()
        if scale == 1.0:
            tracker.even = picture.samples >= cap
            tracker.eta.passed(picture.samples, tracker.clock.elapsed_s)
            if not self._ending.end_if_reached():
                self._ending.report()

    @property
    def _divides(self) -> bool:
        """Whether parts of the picture may be traced elsewhere."""
        settings, stop = self._residency.full.settings, self._tracker.stop
        return undivided(settings.adaptive, stop.time_limit) is None

    @property
    def _divided_from(self) -> int:
        """The first sample that may be shared. While somebody looks on, or noise is judged at borders inside of a
        block, the first ones are traced here."""
        alone = self._tracker.interactive or self._tracker.stop.target_noise is not None
        return WATCHED_FROM if alone else 0

    def _apply(self, update: Update) -> None:
        """Apply the pending update; where it fails, report that and leave everything as it was."""
        self._updates.pending, self.attempted = None, update.generation
        self._try(update)
        self._updates.applied(update)

    def _try(self, update: Update) -> None:
        began, tracker, residency, updates = time.monotonic(), self._tracker, self._residency, self._updates
        edited = updates.edited(update)
        if edited is None:
            return  # its first one failed, which was said; only a whole scene helps
        settings = RenderSettings(**update.settings) if update.settings is not None else updates.settings
        assert settings is not None  # a task's first update has them
        try:
            made = residency.change(update, edited, settings)
        except GpuError as error:
            fallback = self.generation if residency.there else None
            refused = isinstance(error, OutOfMemory | SceneTooLarge)
            updates.stops = False
            self._send(Failed(self.number, update.generation, str(error), refused, fallback=fallback))
            return
        if made is not None:
            self.release()
            residency.loaded = made
        tracker.generation = update.generation
        updates.settings, tracker.stop = settings, update.stop or tracker.stop
        if update.denoise is not None:
            self._frames.denoising.wanted = update.denoise
        if update.scene is not None:
            tracker.interactive = update.interactive
        tracker.reason, self._frames.owes_done = None, False
        self._ending.checkpoints.restart()
        if update.restarts:
            self._restart()
        if update.may_not_fit:
            setup_s, full = time.monotonic() - began, residency.full
            kernel = full.compile_ms + updates.take_compile_ms(), full.scene.features, full.scene.spared
            self._send(Loaded(self.number, self.generation, setup_s, *kernel, self._ending.warnings))
        if update.scene is not None or update.settings is not None:
            updates.foresee(settings)

    def evict(self) -> None:
        """Leave the device: for the machine's memory, or for good where the server has the picture already."""
        if self._forget is not None and self._ending.kept:
            self._part()
            self._forget(self.number)
        else:
            self._residency.offload()

    def settle(self) -> None:
        """Apply the pending update now, so that the next one can fall back to it."""
        if self._updates.pending is not None:
            self._apply(self._updates.pending)

    def restore(self, restore: Restore) -> None:
        self.settle()
        if self._residency.loaded is None:
            return
        tracker, full = self._tracker, self._residency.full
        saved = saved_picture(restore.saved, full.settings)
        others = restore.reason is None and restore.saved.driver not in ("", driver_of(self._renderer.info))
        if others or not full.fits(saved, goes_on=restore.reason is None):
            log.warning("another driver or version saved this picture, which begins again", {"task": self.number})
            if restore.reason is None:
                self._send(Discarded(self.number))
            return
        self._residency.insist(lambda: full.restore(saved))
        self.home.resume(saved_bands(restore.saved, full.settings))
        tracker.reason, self._frames.scale = restore.reason, 1.0
        tracker.clock.set(restore.progress.elapsed_s)
        tracker.meter.set(restore.progress.samples, restore.progress.noise)
        tracker.eta.passed(saved.samples, restore.progress.elapsed_s)
        tracker.even = not saved.under_way[0]
        self._ending.checkpoints.restart()

    def look(self, want: Want) -> None:
        self._frames.want = want

    def answer(self) -> bool:
        """Send the frame that is wanted, if it would show something new."""
        if self._updates.pending is None:
            return self._frames.answer()
        seen = self._updates.compiling and self._updates.preview.answer(self._frames.want)
        if seen:
            self._frames.want = None
        return seen

    def read(self, read: Read) -> None:
        self._frames.read(read)

    def take_checkpoint(self) -> None:
        """Save the picture in the next turn."""
        self._ending.checkpoints.hasten()

    def checkpoint_stored(self, took_s: float) -> None:
        """The server has the last checkpoint on the disk, that many seconds after it came."""
        self._ending.checkpoints.stored(took_s)

    def pause(self, away: bool = False) -> None:
        self._paused, self._away = True, away
        self.home.pause(True)
        self._tracker.clock.pause()

    def resume(self) -> None:
        self._paused = self._away = False
        self.home.pause(False)

    def hold(self) -> None:
        """Stand still for a moment: an update is being packed, for which somebody waits."""
        self._held_until = time.monotonic() + HOLD_S

    def stop(self) -> None:
        """Ends the render; an update that waits is applied first, unless the render has not even begun."""
        updates, pending, checkpoints = self._updates, self._updates.pending, self._ending.checkpoints
        if pending is not None and not pending.interactive and self._residency.loaded is None:
            updates.pending, self._tracker.generation = None, pending.generation
            self._ending.end("stopped")
        elif pending is not None:
            updates.stops = True
        else:
            updates.stops = False
            if self._tracker.reason is None or not checkpoints.under_way:
                checkpoints.restart()
                self._ending.end("stopped")

    def release(self) -> None:
        """Free the GPU's memory; the task can be loaded again."""
        self._ending.checkpoints.restart()
        self.home.restart()
        self._updates.release()
        self._residency.release()
        self._frames.forget()

    def fail(self) -> None:
        """Give up its state after an unexpected error; a whole scene revives it."""
        self._updates.pending, self._updates.stops = None, False
        self.release()

    def _finish(self) -> None:
        self._ending.finish()

    def _part(self) -> None:
        """Have all helpers of the task let go of resources that are about to leave the device."""
        self._frames.part()

    def _restart(self) -> None:
        self._frames.restart()
        self._tracker.restart()
        self.home.restart()
        first = self._residency.loaded is not None and self._tracker.interactive
        self._scale = self._residency.ladder.first(self._tracker.pixel_s) if first else 1.0
        seen = self._updates.preview.shown(self.generation)
        if self._scale <= seen:
            self._scale = self._residency.ladder.next(seen, self._tracker.pixel_s)
