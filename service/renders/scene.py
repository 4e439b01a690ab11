"""The scene of a render: as a document while it waits, packed when it begins, and the memory that this takes."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from service.ipc.messages import Update
from service.pack import Packed
from service.problems import TooLarge
from service.quality import ResolvedSettings
from service.renders.memory import RenderMemory
from service.requests.request_reader import stop_rule
from service.system.memory import MemoryBudget

# Packs the scene of a folded document; it calls its second argument with the bytes of memory that parsing takes.
Load = Callable[[bytes, Callable[[int], None]], Awaitable[Packed]]


class RenderScene:
    """For the event loop."""

    def __init__(
        self,
        settings: ResolvedSettings,
        load: Load,
        document: bytes | None,
        packed: Packed | None,
        budget: MemoryBudget | None,
    ) -> None:
        """`document` is folded; None: it is stored. Raises TooLarge for a render that never fits into `budget`."""
        self.document = document
        self.memory = RenderMemory(settings, budget)
        self._settings, self._load = settings, load
        self._packed = packed
        if packed is not None:
            self.memory.packed(packed)
            self.memory.check()

    def set_aside(self) -> None:
        """Forget the packed scene: it waits as a document, and is packed again when its turn comes."""
        self._packed = None

    def reserve(self) -> None:
        """Count the memory that the render is known to need. Raises Unavailable where there is too little."""
        try:
            self.memory.hold(reads=self._packed is None)
        except TooLarge:  # which `load` will raise again: it is the render's own error
            self.memory.release()

    @property
    def lacks(self) -> int:
        """The bytes of memory that are missing for it to begin, as far as that is known."""
        return self.memory.lacks(reads=self._packed is None)

    async def load(self, document: Callable[[], Awaitable[bytes]]) -> Packed:
        """The packed scene, its memory counted. Raises what reading it raises, and Unavailable."""
        packed, self._packed = self._packed, None
        self.memory.hold(reads=packed is None)
        if packed is None:
            packed = await self._load(await document(), self.memory.read)
        self.memory.packed(packed)
        return packed

    def update(self, task: int, packed: Packed) -> Update:
        """The message that begins a task with it."""
        settings = self._settings
        return Update(task, 1, packed.arrays, settings.for_gpu(), stop_rule(settings), denoise=settings.denoise)
