"""A renderer's part in a picture whose home is elsewhere: the same scene, and the leases that it traces."""

from __future__ import annotations

import logging
from collections import deque
from typing import TYPE_CHECKING

from gpu import Band, RenderSettings
from service.ipc.leases import Lease, LeaseDone
from service.ipc.messages import Update
from service.worker.context import WorkerContext
from service.worker.device.residency import Residency
from service.worker.progress import ProgressTracker
from service.worker.scheduler import Account
from service.worker.updates import Updates
from service.worker.view.frames import SLICE_S

if TYPE_CHECKING:
    from gpu import Picture

log = logging.getLogger(__name__)


class Assistant:
    """Has turns like a task: applies updates, traces a slice of the oldest lease, and sends its result."""

    unseen = wanted = False  # nobody looks at it

    def __init__(self, context: WorkerContext, number: int, client: str = "") -> None:
        self.number, self.client = number, client
        self.attempted = 0  # the generation of the last update
        self.account = Account()
        self.traced = 0  # samples of pixels
        self._send = context.send
        self._residency = Residency(context.renderer, context.memory, self, lambda: None)
        self._tracker = ProgressTracker()
        self._updates = Updates(context, number, client, self._residency, self._tracker)
        self._leases: deque[Lease] = deque()

    @property
    def ready(self) -> bool:
        if self._updates.pending is not None:
            return not self._updates.compiling
        return bool(self._leases) and self._residency.there

    @property
    def loads(self) -> bool:
        """True if its next turn may take as long as a compilation does."""
        return self._updates.pending is not None

    @property
    def idle(self) -> bool:
        """True if its memory on the device may be taken."""
        return self._residency.loaded is not None and not self.ready

    @property
    def bytes(self) -> int:
        return self._residency.bytes

    @property
    def rested_since(self) -> float:
        return self._residency.rested_since

    def update(self, update: Update) -> None:
        self._updates.join(update)

    def lease(self, lease: Lease) -> None:
        self._leases.append(lease)

    def turn(self) -> None:
        """Apply an update, or trace a slice."""
        pending, residency = self._updates.pending, self._residency
        if pending is not None:
            self.attempted = pending.generation
            if not self._updates.begin_to_wait(pending, paused=False):
                self._apply(pending)
            return
        while self._leases and self._leases[0].generation < self._tracker.generation:
            self._leases.popleft()  # of what was edited since
        if self._leases and self._leases[0].generation == self._tracker.generation:
            residency.wake()
            self._trace(residency.full, self._leases[0])
        residency.touch()

    def _trace(self, picture: Picture, lease: Lease) -> None:
        band = Band(lease.first, lease.count, lease.top, lease.rows)
        if self._residency.insist(lambda: picture.block.trace_band(band, SLICE_S)):
            self._leases.popleft()
            self.traced += band.rows * band.count * picture.settings.width
            values, counts = picture.block.read_band(band), picture.block.take_counts()
            self._send(LeaseDone(self.number, lease.generation, lease.number, values, counts))

    def _apply(self, update: Update) -> None:
        self._updates.pending = None
        edited = self._updates.edited(update)
        if edited is None:
            return  # its first one failed, which was said
        settings = RenderSettings(**update.settings) if update.settings is not None else self._updates.settings
        assert settings is not None  # the first update has them
        self._updates.check()
        made = self._residency.change(update, edited, settings)
        if made is not None:
            self._residency.release()
            self._residency.loaded = made
        self._tracker.generation = update.generation
        self._updates.settings = settings
        self._updates.applied(update)

    def evict(self) -> None:
        self._residency.offload()

    def release(self) -> None:
        """Free the device's memory."""
        self._updates.release()
        self._residency.release()

    def fail(self) -> None:
        """Give up after an error; the loop has the server told."""
        self._updates.pending = None
        self._leases.clear()
        self.release()
