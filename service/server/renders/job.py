"""One render asked for over REST, as the queue and its callers see it."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.ipc.messages import FromRenderer, Progress, View
from service.pack import Packed
from service.renderers.protocol import Renderers
from service.server.renders.life import Life, PictureAt
from service.server.renders.ordered import Ordered
from service.server.renders.rendering import Rendering
from service.server.renders.scene import Load, PackedScenes, RenderScene
from service.server.renders.status import snapshot
from service.server.renders.store.record import Order, Outcome
from service.server.renders.viewer import PictureViewer
from service.system.memory import MemoryBudget


class Job(Ordered):
    """A render, on the event loop.

    With a `recorder` it outlives the server, and its picture comes back from the disk when somebody looks at it.
    Without one it keeps its picture in the renderer until `release`."""

    def __init__(
        self,
        renderers: Renderers,
        order: Order,
        load: Load,
        document: bytes | None = None,
        packed: Packed | None = None,
        outcome: Outcome | None = None,
        budget: MemoryBudget | None = None,
        waiting: PackedScenes | None = None,
        patch: bytes | None = None,
        base: int | None = None,
    ) -> None:
        """The folded `document`, and the `patch` to it, may be left out where there is a recorder; for the others see
        RenderScene. Raises TooLarge for a render that never fits into the `budget`."""
        scene = RenderScene(order.settings, load, document, packed, budget, waiting, patch, base)
        super().__init__(renderers, order, Life(outcome or Outcome()), scene)
        self.viewer = PictureViewer(self)
        self.rendering = Rendering(self, self.viewer)
        if self.outcome.error is not None:
            self.viewer.refuse(self.outcome.error)

    async def run(self) -> None:
        """Render until it has ended, however it ends, or until the server ends.

        A stored one returns unfinished as well, without its memory, where it has to go back in line: it gave way to
        another render, or it `waits` for memory, for the disk, or for a renderer.
        """
        await self.rendering.run()

    @property
    def can_give_way(self) -> bool:
        """Whether another render may have its slot."""
        return self.rendering.can_give_way

    async def give_way(self) -> bool:
        """Store the samples so far and have `run` return, to go on later to the same bits. Whether it does."""
        return await self.rendering.give_way()

    def cancel(self) -> None:
        """Stop at once; the image so far stays."""
        if not self.rendering.ends:
            self.scene.forget()
            self.rendering.cancel()

    async def recorded(self) -> None:
        """Return when its end is on the disk."""
        await self.rendering.recorded()

    async def close(self) -> None:
        """The server ends: have the last samples stored, and leave the render for the next start."""
        self.life.close()
        self.wake()
        await self.rendering.store_samples()
        await self.recorded()

    async def changed(self) -> bool:
        """Return at the next change of the status: True; or when the server ends, which leaves it as it is."""
        await self.changes.next()
        return self.finished.is_set() or not self.life.over.is_set()

    def status(self, kernel: bool = False) -> dict[str, Any]:
        return snapshot(self, kernel)()

    async def image(self, view: View) -> tuple[np.ndarray, Progress]:
        """The picture so far. Raises Conflict before the first sample, and the render's own error where it failed."""
        return await self.viewer.image(view)

    def heard(self, message: FromRenderer) -> None:
        """A message about its picture, from whichever task shows it."""
        self.rendering.heard(message)

    def lost(self, detail: str) -> None:
        self.rendering.lost(detail)

    @property
    def picture_at(self) -> PictureAt:
        """Where its newest samples are, if it has any."""
        if self.viewer.task is not None:
            return PictureAt.BOTH
        if self.task is not None:
            whole = self.finished.is_set() and self.recorder is not None and self.recorder.whole
            return PictureAt.BOTH if whole else PictureAt.RENDERER
        stored = self.recorder is not None and self.recorder.store.latest(self.id) is not None
        return PictureAt.DISK if stored else PictureAt.NOWHERE

    @property
    def resident_bytes(self) -> int:
        """About the memory that its scene and its picture take while a renderer has them; 0 otherwise."""
        return self.scene.memory.bytes if PictureAt.RENDERER in self.picture_at else 0

    @property
    def size(self) -> int:
        """The bytes that it keeps: on the disk, or in memory where it is not stored."""
        if self.recorder is not None and self.recorder.whole:
            return self.recorder.store.size(self.order)
        return self.resident_bytes + self.order.bytes

    def release(self) -> None:
        """Have the renderer forget it."""
        self.viewer.close()
        self.rendering.release()
        self.scene.forget_document()

    def rest(self) -> bool:
        """Release what can be brought back from the disk, if nobody waits for it; whether that was possible."""
        possible = self.picture_at is PictureAt.BOTH and not self.viewer.busy
        if possible:
            self.release()
        return possible
