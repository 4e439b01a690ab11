"""The scene of a render: as a document while it waits, packed when it begins, and the memory that this takes."""

from __future__ import annotations

import threading
from collections.abc import Awaitable, Callable

from service.document.quality import ResolvedSettings
from service.ipc.messages import Update
from service.pack import RENDERED_PIXEL_BYTES, SAVED_PIXEL_BYTES, Packed
from service.problems import TooLarge, Unavailable
from service.server.requests.request_reader import stop_rule
from service.system.memory import MemoryBudget

# Packs the scene of a folded document; it calls its second argument with the bytes of memory that parsing takes, and
# packing.
Load = Callable[[bytes, Callable[[int], None]], Awaitable[Packed]]

COPIES = 2  # of a packed scene: the server's, with which another renderer could go on, and the renderer's
WAITING_BYTES = 256 << 20  # of the packed scenes of renders that wait


class PackedScenes:
    """The packed scenes of renders that wait, up to a number of bytes: these need not be packed again. For any
    thread."""

    def __init__(self, most: int = WAITING_BYTES) -> None:
        self.bytes = 0
        self._most = most
        self._scenes: dict[RenderScene, int] = {}  # in the order of arrival, which is about that of their turns
        self._lock = threading.Lock()

    def keep(self, scene: RenderScene, size: int) -> bool:
        """True if there is room for it."""
        with self._lock:
            if self.bytes + size > self._most:
                return False
            self.bytes += size - self._scenes.pop(scene, 0)
            self._scenes[scene] = size
            return True

    def remove(self, scene: RenderScene) -> None:
        with self._lock:
            self.bytes -= self._scenes.pop(scene, 0)

    def shrink(self, size: int) -> None:
        """Free that many bytes, as far as there are any: those of the last ones, which wait longest."""
        with self._lock:
            scenes = list(reversed(self._scenes.items()))
        for scene, bytes in scenes:
            if size <= 0:
                break
            scene.forget()
            size -= bytes


class RenderScene:
    """For the event loop, but for `forget`."""

    def __init__(
        self,
        settings: ResolvedSettings,
        load: Load,
        document: bytes | None,
        packed: Packed | None,
        budget: MemoryBudget | None,
        waiting: PackedScenes | None = None,
        patch: bytes | None = None,
        base: int | None = None,
    ) -> None:
        """The scene is `document` with the merge patch `patch`, both folded; None: they are stored. `base`: the
        number of a render that brought the same document to the store. While it waits, the scene stays packed where
        there is room in `waiting`. Raises TooLarge for a render that never fits into `budget`."""
        self.document, self.patch, self.base = document, patch, base
        self.memory = RenderMemory(settings, budget)
        self._settings, self._load = settings, load
        self._packed = packed
        self._waiting = waiting
        self._budget = budget
        size = sum(len(each) for each in (document, patch) if each is not None)
        if budget is not None and size:
            budget.count("documents", self, size)  # the values that it was made from are more, and count until here
        if packed is not None:
            self._take_over(packed)
            self.memory.check()
            try:
                self.memory.hold_scene()
            except Unavailable:
                self._packed = None

    def _take_over(self, packed: Packed) -> None:
        """From now on the scene counts here."""
        if self._budget is not None:
            self._budget.release(packed)
        self.memory.packed(packed)

    def forget_document(self) -> None:
        """The store has it, or the render is given up."""
        self.document = self.patch = None
        if self._budget is not None:
            self._budget.release(self)

    def set_aside(self) -> None:
        """It waits: without room for the packed scene it waits as a document, and is packed again at its turn."""
        if self._packed is not None and (
            self._waiting is None or not self._waiting.keep(self, self.memory.scene_bytes)
        ):
            self._packed = None
        self.memory.release()

    def wait_as_document(self) -> None:
        """It is not even in line yet."""
        self._packed = None
        self.memory.release()

    def forget(self) -> None:
        """Forget the packed scene. For any thread."""
        self._packed = None
        if self._waiting is not None:
            self._waiting.remove(self)

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
        packed = self._packed
        self.forget()
        self.memory.hold(reads=packed is None)
        if packed is None:
            packed = await self._load(await document(), self.memory.read)
        self._take_over(packed)
        return packed

    def update(self, task: int, packed: Packed) -> Update:
        """The message that begins a task with it."""
        settings = self._settings
        return Update(task, 1, packed.arrays, settings.for_gpu(), stop_rule(settings), denoise=settings.denoise)


def picture_bytes(settings: ResolvedSettings) -> int:
    """The bytes of a picture in the renderer."""
    return settings.render_width * settings.render_height * RENDERED_PIXEL_BYTES


class RenderMemory:
    """The bytes of one render, from its beginning until the renderer lets it go."""

    def __init__(self, settings: ResolvedSettings, budget: MemoryBudget | None = None) -> None:
        """Without a budget nothing is counted."""
        self.scene_bytes = 0  # as far as it is known
        self.reading_bytes = 0  # that parsing and packing its document take, as far as it is known
        self._budget = budget
        self._settings = settings

    @property
    def bytes(self) -> int:
        """Bytes of the scene and the picture while the renderer has them."""
        return self._pictures + COPIES * self.scene_bytes

    @property
    def _pictures(self) -> int:
        settings = self._settings
        return picture_bytes(settings) + settings.render_width * settings.render_height * SAVED_PIXEL_BYTES

    def packed(self, packed: Packed) -> None:
        """Note how large the scene is."""
        self.scene_bytes = packed.bytes

    def check(self) -> None:
        """Raises TooLarge for a render that never fits."""
        if self._budget is not None:
            self._budget.check(self.bytes)

    def needed(self, reads: bool) -> int:
        """The bytes that it takes at most, where its document is still to be read or not.

        Reading ends before the renderer makes a picture, so these two never add up.
        """
        return max(self.bytes, self.reading_bytes) if reads else self.bytes

    def lacks(self, reads: bool) -> int:
        """The bytes that are missing for it to begin."""
        return 0 if self._budget is None else self._budget.lacks(self.needed(reads))

    @property
    def share(self) -> float:
        """The part of all memory that it takes."""
        return 0.0 if self._budget is None else self.bytes / self._budget.limit

    def hold(self, reads: bool = False) -> None:
        """Count all of it in one step. As before where it raises TooLarge or Unavailable.

        A render that counted its picture first and what reading takes later would wait for others that do the same.
        """
        if self._budget is not None:
            self.check()
            reading = self.needed(reads) - self.bytes
            scenes = COPIES * self.scene_bytes
            self._budget.hold_all(self, {"pictures": self._pictures, "scenes": scenes, "bodies": reading})

    def hold_scene(self) -> None:
        """Count the packed scene of a render that has not begun, once. Raises TooLarge, Unavailable."""
        if self._budget is not None:
            self._budget.hold("scenes", self, self.scene_bytes)

    def read(self, size: int) -> None:
        """Count that parsing or packing the document takes so many bytes, one after the other. Raises TooLarge,
        Unavailable."""
        self.reading_bytes = max(self.reading_bytes, size)
        self.hold(reads=True)

    def release(self) -> None:
        if self._budget is not None:
            self._budget.release(self)
