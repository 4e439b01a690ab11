"""Decides which frame a client gets next, and when: at most two are unacknowledged, and no old one is sent."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from service.ipc.messages import Frame, Lut, Want
from service.problems import FieldError, InvalidDocument
from service.server.streams.protocol import View

CREDITS = 2  # frames unacknowledged; without a bound a slow client had 857 of them queued
MOST_FPS = 30  # unless the view says otherwise: every frame costs the renderer and the encoder some milliseconds
# A picture that has been refined for a while changes little: frames at most every 5 % of its time, and every 0.2 s.
PACE, SLOWEST_S = 0.05, 0.2
# How long an update waits for the first frame of the one before it. Taken at once, each of a hand's sixty updates a
# second would stop its predecessor's frame, and nothing would be seen until the hand rests.
PATIENCE_S = 0.25


class FlowControl:
    def __init__(self, task: int, send: Callable[[Want], None]) -> None:
        self.view = View()
        self._lut: Lut | None = None
        self.generation: int | None = None
        self._task = task
        self._send = send
        self._loop = asyncio.get_running_loop()
        self._sent = 0  # the last frame's `seq`
        self._unacknowledged: set[int] = set()
        self._serial = 0  # of the last want
        self._here = False  # a connection is attached
        self._asked = False  # a frame is wanted, or on its way out
        self._anyway = False  # the view was changed and not seen yet
        self._answered = asyncio.Event()  # something of this generation was sent
        self._last_at = -1.0
        self._updated_at = 0.0
        self._pace_s = 0.0
        self._timer: asyncio.TimerHandle | None = None

    @property
    def next_seq(self) -> int:
        return self._sent + 1

    @property
    def waited_s(self) -> float | None:
        """How long the present generation has been waiting for its first frame, s; None once that was sent."""
        return None if self._answered.is_set() else self._loop.time() - self._updated_at

    def update(self, generation: int, since: float) -> None:
        """Note an update that came at the loop's time `since`: older generations' frames are dropped from now on."""
        self._updated_at = since
        self.generation = generation
        self._answered.clear()
        self._ask()

    def set_view(self, view: View, lut: Lut | None = None) -> None:
        """`lut` is the table that the view names."""
        self.view, self._lut = view, lut
        self._serial += 1  # what was asked for before is encoded otherwise, and unwelcome
        if self.generation is not None:
            self._anyway, self._asked = True, False
            self._ask()

    def acknowledge(self, seq: int) -> None:
        if not 0 < seq <= self._sent:
            detail = f"no frame has the number {seq}: the last one is {self._sent}"
            raise InvalidDocument([FieldError("/seq", detail)])
        self._unacknowledged.discard(seq)
        self._ask()

    def welcome(self, frame: Frame) -> bool:
        """True if this frame may still be sent. If not, another one is asked for."""
        if frame.serial != self._serial:
            return False  # the view was changed, and asked for anew
        if frame.generation == self.generation:
            return True
        self._asked = False
        self._ask()
        return False

    def sent(self, frame: Frame) -> None:
        self._sent += 1
        self._unacknowledged.add(self._sent)
        self._last_at = self._loop.time()
        self._pace_s = min(SLOWEST_S, PACE * frame.progress.elapsed_s)
        if frame.serial == self._serial:
            self._asked = self._anyway = False
        if frame.generation == self.generation:
            self._answered.set()
        self._ask()

    def detach(self) -> None:
        """Count no client as attached; a frame that is being sent is lost."""
        self._here = False
        self._serial += 1
        self._unacknowledged.clear()
        self._asked = False

    def attach(self) -> None:
        """Count a client as attached that has seen nothing yet."""
        self._here = True
        if self.generation is not None:
            self._anyway, self._asked = True, False
            self._ask()

    def fall_back(self, generation: int | None) -> None:
        """The present generation failed; the picture goes on with that one."""
        self._answered.set()
        if generation is not None:
            self.generation = generation
            self._anyway, self._asked = True, False
            self._ask()

    async def idle(self) -> None:
        """Returns when the present generation has been seen, or can't be, or takes too long."""
        if self._here and self.generation is not None and len(self._unacknowledged) < CREDITS:
            try:
                async with asyncio.timeout(PATIENCE_S):
                    await self._answered.wait()
            except TimeoutError:
                return

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _ask(self) -> None:
        if not self._here or self._asked or self.generation is None or len(self._unacknowledged) >= CREDITS:
            return
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        wait_s = self._last_at + self._interval_s() - self._loop.time()
        if wait_s > 0:
            self._timer = self._loop.call_later(wait_s, self._ask)
            return
        self._asked = True
        self._serial += 1
        self._send(Want(self._task, self._serial, self.view.for_renderer(self._lut), self._anyway))

    def _interval_s(self) -> float:
        """Seconds between two frames; the first frame after an edit waits only where the view sets a rate."""
        asked_for = self._anyway or not self._answered.is_set()
        if self.view.max_fps is not None:
            return 1 / self.view.max_fps if asked_for else max(1 / self.view.max_fps, self._pace_s)
        return 0.0 if asked_for else max(1 / MOST_FPS, self._pace_s)
