"""What a render takes in memory, counted within SUNBOX_MEMORY."""

from __future__ import annotations

from service.document.quality import ResolvedSettings
from service.pack import RENDERED_PIXEL_BYTES, SAVED_PIXEL_BYTES, Packed
from service.system.memory import MemoryBudget

COPIES = 2  # of a packed scene: the server's, with which another renderer could go on, and the renderer's


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
        """Of the scene and the picture while the renderer has them."""
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
