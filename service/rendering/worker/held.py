"""What one task has on the device: had at the expense of who rests, put aside, and had back."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from gpu import OutOfMemory, RenderSettings
from service.rendering.ipc.messages import Update
from service.rendering.worker.holding import Aside, Holding, needed
from service.rendering.worker.ladder import Ladder
from service.rendering.worker.memory import Holder, Memory

if TYPE_CHECKING:
    from gpu import Picture, Renderer


class Held:
    """Nothing, before something was loaded and when that failed. Raises what the renderer raises."""

    def __init__(self, renderer: Renderer, memory: Memory, owner: Holder, parting: Callable[[], None]) -> None:
        """`owner` is whom others ask to evict it; `parting` is called before what is there leaves the device."""
        self.holding: Holding | None = None
        self.rested_since = 0.0
        self._aside: Aside | None = None
        self._renderer, self._memory = renderer, memory
        self._owner, self._parting = owner, parting

    @property
    def there(self) -> bool:
        """On the device or aside."""
        return self.holding is not None or self._aside is not None

    @property
    def aside(self) -> Aside | None:
        return self._aside

    @property
    def bytes(self) -> int:
        return 0 if self.holding is None else self.holding.bytes

    @property
    def ladder(self) -> Ladder:
        assert self.holding is not None
        return self.holding.ladder

    @property
    def full(self) -> Picture:
        return self.ladder.full

    def rests(self) -> None:
        """It was worked on, or looked at, until now."""
        self.rested_since = time.monotonic()

    def change(self, update: Update, settings: RenderSettings) -> Holding | None:
        """Has on the device what the update asks for; where that is another scene, what shall take the place of
        what is there, which goes only now that this has come."""
        if update.scene is None:
            self.wake()
            assert self.holding is not None
            if update.edits:
                self.holding.scene.edit(**update.edits)
            if update.settings is None:
                if update.edits:
                    self.ladder.reset()
                return None
            old = self.full.settings
            if (old.width, old.height) == (settings.width, settings.height):
                self.ladder.configure(settings)
                return None

        def make() -> Holding | None:
            if update.scene is None:
                assert self.holding is not None
                self.holding.resize(settings)
                return None
            return Holding(self._renderer, update.scene, settings, update.interactive, update.edits)

        return self._with_room(needed(update.scene, settings), make, update.scene is not None)

    def make_room(self, size: int) -> None:
        """For so many bytes more. Raises OutOfMemory."""
        self._memory.make_room(size, self._owner)

    def _with_room(self, size: int, make: Callable[[], Holding | None], whole: bool) -> Holding | None:
        """What `make` makes, where need be at the expense of who rests, and of what is held here."""
        try:
            self.make_room(size)
            return self._insist(make)
        except OutOfMemory:
            if self.holding is None or not whole:
                raise
            self.put_aside()
            self.make_room(size)
            return self._insist(make)

    def _insist(self, make: Callable[[], Holding | None]) -> Holding | None:
        """The driver may have less than is allowed."""
        while True:
            try:
                return make()
            except OutOfMemory:
                if not self._memory.evict_one(self._owner):
                    raise

    def wake(self) -> None:
        """Has back on the device what was put aside."""
        aside = self._aside
        if aside is not None and self.holding is None:
            self.make_room(needed(aside.arrays, aside.settings))
            self.holding = self._insist(lambda: Holding.back(self._renderer, aside))
            self._aside = None

    def put_aside(self) -> None:
        """To the machine's memory."""
        assert self.holding is not None
        self._parting()
        self._aside, self.holding = self.holding.aside(), None

    def release(self) -> None:
        holding, self.holding, self._aside = self.holding, None, None
        self._parting()
        if holding is not None:
            holding.release()
