"""First looks at what waits for its kernel, by a small one without optimisation, in a process beside the renderer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gpu import FIRST_HIT_AOVS, scene_bytes
from gpu.precompile import fallback
from service.worker.helpers.first_look_client import Look
from service.worker.view.first_look import serves

if TYPE_CHECKING:
    from collections.abc import Callable

    from service.ipc.messages import Frame, FromRenderer, Want
    from service.worker.device.loaded_scene import KernelRequest
    from service.worker.helpers.first_look_client import FirstLookClient


class UnoptimisedLook:
    """Shows an update between `begin` and `release`."""

    def __init__(self, number: int, send: Callable[[FromRenderer], None], client: FirstLookClient | None) -> None:
        """Without a `client` there is never a first look."""
        self.generation = 0
        self.scale: float | None = None  # of what was shown
        self.shows = False
        self.bytes = 0  # of the machine's memory, which is the device's
        self._number, self._send, self._client = number, send, client
        self._want: Want | None = None  # what the process was asked for
        self._frame: Frame | None = None  # what it answered
        self._shown = (0, 0.0)

    def can(self, wanted: KernelRequest) -> bool:
        """Whether the update could be shown before its kernel is there."""
        able = self._client is not None and self._client.able
        return able and serves(wanted) and fallback.settings_for(wanted.settings) is not None

    def begin(self, wanted: KernelRequest, generation: int) -> None:
        """Begin to show what `can` be shown."""
        settings = fallback.settings_for(wanted.settings)
        assert self._client is not None and settings is not None
        self.generation, self.scale, self._want, self._frame = generation, None, None, None
        self.shows, self.bytes = True, scene_bytes(wanted.arrays)
        look = Look(self._number, generation, wanted.arrays, settings)
        self._client.begin(look, self._hear)

    def answer(self, want: Want | None) -> bool:
        """Send the frame that is wanted, if it has come; else ask for it once. Whether it was sent."""
        if want is None or not self.shows or want.view.aov in FIRST_HIT_AOVS:
            return False
        frame, self._frame = self._frame, None
        if frame is not None and frame.serial == want.serial:
            self.scale, self._shown = frame.scale, (frame.generation, frame.scale)
            self._send(frame)
            return True
        if want != self._want:
            assert self._client is not None
            self._want = want
            self._client.want(self._number, want)
        return False

    def shown(self, generation: int) -> float:
        """The scale at which that generation was shown; 0 where it was not."""
        return self._shown[1] if self._shown[0] == generation else 0.0

    def release(self) -> None:
        if self.shows and self._client is not None:
            self._client.leave(self._number)
        self.shows, self.bytes, self.scale, self._frame = False, 0, None, None

    def _hear(self, frame: Frame) -> None:
        self._frame = frame
