"""A prior for the picture after an edit: a better guess while its own picture is small or has few samples.

Before the edit the picture is kept on the device (gpu.Prior), with the small first looks that were traced of it.
First looks at the edited scene follow the same random numbers, and say what has changed. The guess fades as samples
come, and is for the eye alone: what is read, saved or captured never has it.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from gpu import OutOfMemory, Prior, can_move, prior_bytes
from service.worker.device.resolution_ladder import ResolutionLadder

if TYPE_CHECKING:
    from collections.abc import Callable

    from gpu import Picture, Renderer

# Of a picture that is kept. The guess delays the first look: by 36 ms at 512 x 512 (82 instead of 46) on two cores.
MOST_PIXELS = 768 * 768
LEAST_SAMPLES = 4  # of a picture that is worth keeping ...
GOOD_SAMPLES = 16  # ... in the place of an earlier one, from which edits have led away
DENOISED = 4  # how many times as many samples one stands for that was denoised
# How many samples a pixel of the guess counts for, until the picture has as many of its own as stand before it.
WORTH = ((16, 8.0), (32, 4.0), (64, 2.0))

log = logging.getLogger(__name__)


class PriorGuess:
    """One task's guess. `keep` before an edit, `restart` after it; then `correct` by first looks, and `shown`."""

    def __init__(self, renderer: Renderer, make_room: Callable[[int], None]) -> None:
        """`make_room` frees that many bytes of the device, or raises OutOfMemory."""
        self.wanted = False
        self.has_depth = False  # of the present picture
        self._renderer, self._make_room = renderer, make_room
        self._prior: Prior | None = None
        self._first: dict[float, np.ndarray] = {}  # the first looks at the picture that is kept, by scale
        # The small pictures, before and after the edit, that the guess is made from.
        self._change: tuple[np.ndarray | None, np.ndarray] | None = None
        self._worth = 0.0

    @property
    def bytes(self) -> int:
        return 0 if self._prior is None else self._prior.bytes

    def lacks(self, ladder: ResolutionLadder, pixel_s: float | None) -> float | None:
        """The scale of a first look that the next edit will have and that was not traced, or None."""
        if not self._fits(ladder.full):
            return None
        scale = ladder.first(pixel_s)
        while scale in ladder.begun and scale < 1.0:
            scale = ladder.next(scale, pixel_s)
        return scale if scale < 1.0 else None

    def _fits(self, full: Picture) -> bool:
        return self._small(full) and full.samples >= LEAST_SAMPLES

    def _small(self, full: Picture) -> bool:
        return self.wanted and full.settings.width * full.settings.height <= MOST_PIXELS

    def lacks_depth(self, full: Picture) -> bool:
        """True if its depth is wanted, by which the picture can be seen from elsewhere, and was not traced."""
        return not self.has_depth and self._fits(full) and can_move(full.scene.arrays.camera)

    def keep(self, ladder: ResolutionLadder, clean: np.ndarray | None) -> None:
        """Keep the picture, or its denoised form, before an edit. One that has too few samples leaves the one that
        was kept before."""
        full = ladder.full
        worth = full.samples * (1 if clean is None else DENOISED)
        if not self._small(full) or worth < (LEAST_SAMPLES if self._prior is None else GOOD_SAMPLES):
            return
        self.release()
        size = full.settings.width, full.settings.height
        try:
            self._make_room(prior_bytes(*size))
            shown = full.read() if clean is None else clean
            self._prior = self._renderer.prior(shown, full.scene.arrays.camera, full.depth())
        except OutOfMemory as error:
            log.info("could not keep the picture before an edit", {"error": error})
            return
        small = {scale: made for scale, made in ladder.begun.items() if scale < 1.0 and made.samples == 1}
        self._first = {scale: made.read() for scale, made in small.items()}

    def restart(self) -> None:
        """Begin with a picture after another edit."""
        self._change, self.has_depth = None, False

    def shown(self, ladder: ResolutionLadder, scale: float) -> Prior | None:
        """The guess to show in the place of the picture at that scale, or averaged with that of full size."""
        prior, picture, settings = self._prior, ladder.picture(scale), ladder.full.settings
        if prior is None or not self.wanted or (settings.width, settings.height) != prior.size:
            return None
        camera = ladder.full.scene.arrays.camera
        if not prior.serves(camera):
            return None
        moved = camera.tobytes() != prior.camera.tobytes()
        worth = WORTH[0][1]
        if scale < 1.0:
            before = None if moved else self._first.get(scale)
            if (moved or before is not None) and picture.samples == 1:
                self._change, self._worth = (before, picture.read()), 0.0
        else:
            worth = next((each for samples, each in WORTH if picture.samples < samples), 0.0)
        if self._change is None or worth == 0.0:
            return None
        if worth != self._worth:
            try:
                prior.correct(camera, *self._change, worth)
            except OutOfMemory as error:
                log.info("could not guess at the picture after an edit", {"error": error})
                return None
            self._worth = worth
        return prior

    def release(self) -> None:
        """Keep nothing."""
        if self._prior is not None:
            self._prior.release()
        self._prior, self._first, self._change = None, {}, None
