"""A task's GPU resources: loading, evicting idle tasks to make room, offloading to host memory, restoring."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from gpu import OutOfMemory, RenderSettings, scene_bytes
from service.ipc.messages import Update
from service.worker.device.loaded_scene import EditedScene, LoadedScene, Offloaded, needed
from service.worker.device.memory import DeviceMemory, Evictable
from service.worker.device.resolution_ladder import ResolutionLadder

if TYPE_CHECKING:
    from gpu import Picture, Renderer

T = TypeVar("T")


class Residency:
    """One task's scene on the device, offloaded, or absent. Its methods raise what the renderer raises."""

    def __init__(
        self, renderer: Renderer, memory: DeviceMemory, owner: Evictable, parting: Callable[[], None]
    ) -> None:
        """Others evict the resources through `owner`; `parting` is called before these leave the device."""
        self.loaded: LoadedScene | None = None
        self.rested_since = 0.0
        self._offloaded: Offloaded | None = None
        self._renderer, self._memory = renderer, memory
        self._owner, self._parting = owner, parting

    @property
    def there(self) -> bool:
        """True if there is a scene, on the device or offloaded."""
        return self.loaded is not None or self._offloaded is not None

    @property
    def offloaded(self) -> Offloaded | None:
        return self._offloaded

    @property
    def bytes(self) -> int:
        return 0 if self.loaded is None else self.loaded.bytes

    @property
    def ladder(self) -> ResolutionLadder:
        assert self.loaded is not None
        return self.loaded.ladder

    @property
    def full(self) -> Picture:
        return self.ladder.full

    def touch(self) -> None:
        """Note that it was in use until now."""
        self.rested_since = time.monotonic()

    def change(self, update: Update, edited: EditedScene, settings: RenderSettings) -> LoadedScene | None:
        """Put on the device what the update leads to. Where that is another scene, it is returned, and takes the
        place of the present one, which is released only now that the other one is there."""
        if update.scene is None:
            self.wake()
            assert self.loaded is not None
            if update.edit is not None:
                growth = scene_bytes(edited.arrays) - scene_bytes(self.loaded.arrays)
                if growth > 0:
                    self.make_room(growth)
                self.loaded.scene.edit(edited.arrays, edited.flags)
            if update.settings is None:
                if update.restarts:
                    self.ladder.reset()
                return None
            old = self.full.settings
            if (old.width, old.height) == (settings.width, settings.height):
                self.ladder.configure(settings)
                return None

        arrays = None if update.scene is None else edited.arrays

        def make() -> LoadedScene | None:
            if arrays is None:
                assert self.loaded is not None
                self.loaded.resize(settings)
                return None
            return LoadedScene(self._renderer, arrays, settings, edited.editing, edited.flags)

        return self._with_room(needed(arrays, settings), make, arrays is not None)

    def make_room(self, size: int) -> None:
        """Make room on the device for that many more bytes. Raises OutOfMemory."""
        self._memory.make_room(size, self._owner)

    def _with_room(self, size: int, make: Callable[[], LoadedScene | None], whole: bool) -> LoadedScene | None:
        """The result of `make`; where memory is short, idle tasks and then this one's own resources make room."""
        try:
            self.make_room(size)
            return self.insist(make)
        except OutOfMemory:
            if self.loaded is None or not whole:
                raise
            self.offload()
            self.make_room(size)
            return self.insist(make)

    def insist(self, make: Callable[[], T]) -> T:
        """The result of `make`, which is tried again after evicting: the driver may have less memory than is
        allowed."""
        while True:
            try:
                return make()
            except OutOfMemory:
                if not self._memory.evict_one(self._owner):
                    raise

    def wake(self) -> None:
        """Restore to the device what was offloaded."""
        offloaded = self._offloaded
        if offloaded is not None and self.loaded is None:
            self.make_room(needed(offloaded.arrays, offloaded.settings))
            self.loaded = self.insist(lambda: LoadedScene.back(self._renderer, offloaded))
            self._offloaded = None

    def offload(self) -> None:
        """Move everything to the machine's memory."""
        assert self.loaded is not None
        self._parting()
        self._offloaded, self.loaded = self.loaded.offloaded(), None

    def release(self) -> None:
        loaded, self.loaded, self._offloaded = self.loaded, None, None
        self._parting()
        if loaded is not None:
            loaded.release()
