"""One client's task: its picture, and whether it wants a turn."""

from __future__ import annotations

import time

from service.ipc.messages import Restore, ToRenderer, Update
from service.ipc.task_control import ApplyNow, Drop
from service.worker.context import WorkerContext
from service.worker.scheduler import Account
from service.worker.task_picture import Phase, TaskPicture

HOLD_S = 2.0  # an edit that takes longer to pack has to share the processor


class Task:
    """Decides when the picture has a turn: call `turn` while the task is `ready`, and `answer` when a frame is
    wanted. What concerns the picture alone is asked of `picture`."""

    def __init__(self, context: WorkerContext, number: int, client: str = "") -> None:
        self.number, self.client = number, client
        self.account = Account()
        self.picture = TaskPicture(context, number, client, self)
        self._later: list[ToRenderer] = []  # behind the pending update
        self._paused = self._away = False
        self._pause_until = 0.0  # by the monotonic clock

    @property
    def attempted(self) -> int:
        """The generation of the last update that was applied or refused."""
        return self.picture.attempted

    @property
    def traced(self) -> int:
        """Samples of pixels that were traced here."""
        return self.picture.traced

    @property
    def wanted(self) -> bool:
        """True if a frame is wanted."""
        return self.picture.frames.want is not None

    @property
    def ready(self) -> bool:
        """True if a turn would do anything."""
        picture, phase = self.picture, self.picture.phase
        if (self._away and not self._later) or phase is Phase.EMPTY:
            return False
        if phase is Phase.COMPILING:
            return picture.updates.previews and not self._paused
        if phase in (Phase.UPDATING, Phase.SAVING) or picture.frames.due:
            return True
        stands = self._paused or picture.frames.denoising.holds or self._pause_s
        return phase is Phase.TRACING and (picture.unseen or not stands) and not picture.waiting

    @property
    def unseen(self) -> bool:
        """True if a person waits for the first frame of something."""
        return self.picture.unseen

    @property
    def loads(self) -> bool:
        """True if its next turn may take as long as a compilation does."""
        return self.picture.loads

    @property
    def idle(self) -> bool:
        """True if its memory on the device may be taken."""
        picture, frames = self.picture, self.picture.frames
        waited_for = self.ready or picture.home.waiting or frames.awaited or frames.denoising.pending
        return picture.residency.loaded is not None and not waited_for

    @property
    def left_s(self) -> float | None:
        """Seconds until it is ready by itself; None where it is not, or is already."""
        home = self.picture.home
        return home.left_s if home.waiting else self._pause_s or None

    @property
    def _pause_s(self) -> float:
        """Seconds for which it goes on standing still, unless an update comes."""
        return max(0.0, self._pause_until - time.monotonic())

    @property
    def bytes(self) -> int:
        """The bytes that it takes on the device."""
        picture = self.picture
        return picture.residency.bytes + picture.updates.bytes + picture.prior.bytes

    @property
    def rested_since(self) -> float:
        return self.picture.residency.rested_since

    def update(self, update: Update) -> None:
        """Take an update, which the next turn applies together with others that wait."""
        self._pause_until = 0.0
        self.picture.updates.join(update)

    def defers(self, message: ToRenderer) -> bool:
        """True if the task keeps the message until the pending update is applied, for which its kernel may have to be
        compiled first: one that asks for that, and those behind it, but for the last."""
        if isinstance(message, Drop):
            return False
        waits = isinstance(message, ApplyNow | Restore) and self.picture.updates.pending is not None
        if waits or self._later:
            self._later.append(message)
        return bool(self._later)

    def take_deferred(self) -> list[ToRenderer]:
        """The messages that were deferred, in order, once the pending update is applied."""
        if not self._later or self.picture.updates.pending is not None:
            return []
        messages, self._later = self._later, []
        return messages

    def turn(self) -> None:
        """Do the next step of the picture."""
        self.picture.step(self._paused, only_applies=bool(self._later))

    def answer(self) -> bool:
        """Send the frame that is wanted, if it would show something new."""
        return self.picture.answer()

    def pause(self, away: bool = False) -> None:
        """Trace no more than a first look at what is new; with `away` not even that."""
        self._paused, self._away = True, away
        self.picture.home.pause(True)
        self.picture.tracker.clock.pause()

    def resume(self) -> None:
        self._paused = self._away = False
        self.picture.home.pause(False)

    def hold(self) -> None:
        """Stand still for a moment: an update is being packed, for which somebody waits."""
        self._pause_until = time.monotonic() + HOLD_S

    def evict(self) -> None:
        self.picture.evict()

    def release(self) -> None:
        """Free the device's memory; the task can be loaded again."""
        self.picture.release()

    def fail(self) -> None:
        """Give up the picture after an unexpected error; a whole scene revives it."""
        self.picture.fail()
