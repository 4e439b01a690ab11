"""What the renderer has of a render: a task, which renders it, or only shows what was stored of it."""

from __future__ import annotations

import asyncio
from dataclasses import replace

from service.ipc.messages import Restore, Update
from service.pack import Packed
from service.problems import Conflict, Internal, ServiceError
from service.renderers.protocol import Listener, Renderers
from service.renders.ordered import Ordered
from service.renders.reads import Reads
from service.renders.scene import RenderScene
from service.renders.store.record import Order, Outcome
from service.requests.request_reader import stop_rule


class Resident(Ordered, Listener):
    """What becomes of the render, as its task tells, is for Job."""

    def __init__(
        self, renderers: Renderers, order: Order, outcome: Outcome, scene: RenderScene, document: bytes | None
    ) -> None:
        super().__init__(renderers, order, outcome, scene, document)
        self.finished = asyncio.Event()
        self._task: int | None = None
        self._shown = False  # the task only shows what was stored, and renders nothing
        self._loading = asyncio.Lock()
        self._reads = Reads()
        self._looking = 0  # how many wait for an image
        self._error: ServiceError | None = None

    @property
    def resident_bytes(self) -> int:
        """About the memory that its scene and its picture take while the renderer has them; 0 otherwise."""
        return 0 if self._task is None else self._memory.bytes

    @property
    def shown(self) -> bool:
        """Whether the renderer has its picture only to show it."""
        return self._shown

    @property
    def size(self) -> int:
        """The bytes that it keeps: on the disk, or in memory where it is not stored."""
        if self.recorder is not None and self.recorder.whole:
            return self.recorder.store.size(self.order)
        return self.resident_bytes + self.order.bytes

    def release(self) -> None:
        """Forget the picture in the renderer."""
        self._drop()
        self._memory.release()

    def _drop(self) -> None:
        if self._task is not None:
            self.renderers.drop(self._task)
            self._task, self._shown = None, False

    def rest(self) -> bool:
        """Release what can be brought back from the disk, if nobody waits for it; whether that was possible."""
        stored = self.recorder is not None and self.recorder.whole and self.finished.is_set()
        possible = (stored or self._shown) and not self._reads and not self._looking
        if possible:
            self.release()
        return possible

    async def _bring_back(self) -> None:
        """Have the renderer show what was stored last. Raises Conflict where nothing was."""
        recorder = self.recorder
        if self._task is None and (recorder is None or recorder.store.latest(self.id) is None):
            raise Conflict("There is no sample yet.")
        async with self._loading:
            if self._task is not None or recorder is None:
                return
            if (kind := recorder.store.latest(self.id)) is None:
                raise Conflict("There is no sample yet.")
            try:
                packed = await self._scene.load(self.document)
                self._memory.hold()
                self._task = task = self.renderers.open(self, "render", self.owner)
                self._shown = True
                restore = await recorder.store.read(self.id, kind, task)
                if restore is None:
                    raise Internal("The stored picture is damaged.")
                await self._send_scene(task, packed, replace(restore, reason=restore.reason or "stopped"))
            except BaseException:  # the client may go away meanwhile, too
                self.release()
                raise

    async def _send_scene(self, task: int, packed: Packed, restore: Restore | None) -> None:
        settings = self.settings
        update = Update(task, 1, packed.arrays, settings.for_gpu(), stop_rule(settings), denoise=settings.denoise)
        await self.renderers.send_scene(update, restore)
        self._reads.ask_again(task, self.renderers.send)
