"""A scene that is shown while it is edited: frames go on to whoever looks, no faster than they are looked at."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any, Protocol

from sunbox.async_stream import AsyncStream
from sunbox.errors import SunboxError
from sunbox.files import Scene
from sunbox.frames import Frame
from sunbox.transport import Transport

MOST_UNSEEN = 2  # frames that are on their way to one who looks
IDLE_S = 30.0  # without anybody who looks or waits, before the stream is given back: a server has room for few
CLOSE_CODES = 1000  # from here on a status is a WebSocket's close code, after which there is no stream


class Watcher(Protocol):
    """Who is told, on the loop of the picture."""

    def framed(self, frame: Frame) -> None:
        """A frame, of which the sequence number is to be given back to `seen`."""

    def refused(self, error: SunboxError) -> None:
        """An edit that nobody waits for was refused; the last valid scene stands."""

    def ended(self, error: SunboxError) -> None:
        """The stream has broken for good."""


class LivePicture:
    """One stream, edited and watched. All calls are made on one loop. `begin` returns with the first frame."""

    def __init__(
        self, transport: Transport, scene: Any, watcher: Watcher, format: str, settings: dict[str, Any]
    ) -> None:
        self._how = transport, format, settings
        self._stream = self._opened(scene)
        self._watcher = watcher
        self._task: asyncio.Task[None] | None = None
        self._changed, self._room = asyncio.Event(), asyncio.Event()
        self._waiting: list[tuple[int, int, asyncio.Future[Frame]]] = []  # generation, samples
        self._looking: set[str] = set()
        self._unseen: list[int] = []
        self._is_paused, self._is_asleep = False, False
        self._waking = asyncio.Lock()
        self._timer: asyncio.TimerHandle | None = None
        self._end: SunboxError | None = None
        self._shown: Frame | None = None  # the last that was passed on
        self.frame: Frame | None = None  # the newest

    @property
    def scene(self) -> Scene:
        """The document as the server has it."""
        return self._stream.scene

    async def begin(self) -> None:
        """Raises SunboxError where the scene is refused or nobody answers."""
        await self._stream.__aenter__()
        self._task = asyncio.create_task(self._run())
        await self.reached(0)

    async def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        await self._leave()

    async def change(self, patch: dict[str, Any]) -> int:
        """Sends a merge patch of the scene. Returns its generation, for `reached`."""
        await self._wake()
        await self._stream.update({"scene": patch})
        self._changed.set()
        self._room.set()
        self._rest()
        return self._stream.generation

    async def reached(self, generation: int | None = None, samples: int = 0) -> Frame:
        """The first frame of that generation, or a newer one, with so many samples, or the last one there is. Raises
        SunboxError where the generation is refused."""
        generation = self._stream.generation if generation is None else generation
        if self._suffices(self.frame, generation, samples):
            assert self.frame is not None
            return self.frame
        await self._wake()
        if self._is_paused and samples:
            await self._pause(False)
        if self._end is not None:
            raise self._end
        future: asyncio.Future[Frame] = asyncio.get_running_loop().create_future()
        entry = (generation, samples, future)
        self._waiting.append(entry)
        self._room.set()
        try:
            return await future
        finally:
            self._waiting.remove(entry)
            self._rest()

    async def look(self, who: str) -> None:
        """Somebody looks, from now on, and has no frame yet."""
        self._looking.add(who)
        self._rest()
        await self._wake()
        self._unseen.clear()
        if self.frame is not None:
            self._pass_on(self.frame)
        self._room.set()
        await self._pause(False)

    async def look_away(self, who: str) -> None:
        """Nobody renders for those who do not look."""
        self._looking.discard(who)
        if not self._looking:
            self._unseen.clear()
            if not self._is_asleep:
                await self._pause(not self._waiting)
            self._rest()

    def seen(self, seq: int) -> None:
        """One who looks has painted that frame."""
        self._unseen = [each for each in self._unseen if each > seq]
        if self._has_room() and self.frame is not None and self.frame is not self._shown:
            self._pass_on(self.frame)  # it came for somebody who waited
        self._room.set()

    async def _pause(self, is_paused: bool) -> None:
        if is_paused != self._is_paused:
            self._is_paused = is_paused
            await (self._stream.pause() if is_paused else self._stream.resume())

    def _opened(self, scene: Any, generation: int = 0) -> AsyncStream:
        transport, format, settings = self._how
        return AsyncStream(transport, scene, format, settings, generation)

    def _rest(self) -> None:
        """Gives the stream back after a while, unless somebody looks."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if not self._looking and not self._is_asleep and self._end is None:
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(IDLE_S, lambda: loop.create_task(self._sleep()))

    async def _sleep(self) -> None:
        async with self._waking:
            if not self._looking and not self._waiting and not self._is_asleep:
                self._is_asleep = True
                await self._leave()

    async def _wake(self) -> None:
        """Another stream, with the scene as it was left."""
        async with self._waking:
            if not self._is_asleep:
                return
            stream = self._opened(self._stream.scene, self._stream.generation + 1)
            await stream.__aenter__()
            self._stream, self._is_asleep, self._is_paused = stream, False, False
            self._task = asyncio.create_task(self._run())

    async def _leave(self) -> None:
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task
        await self._stream.__aexit__(None, None, None)

    async def _run(self) -> None:
        try:
            while True:
                self._changed.clear()
                try:
                    async for frame in self._stream:
                        self._take(frame)
                        await self._until_room()
                    self._take_last()
                except SunboxError as error:
                    if error.status is None or error.status >= CLOSE_CODES or self.frame is None:
                        raise
                    await self._go_back(error)
                    continue
                await self._changed.wait()
        except SunboxError as error:
            self._end = error
            if not self._fail(error):
                self._watcher.ended(error)

    async def _go_back(self, error: SunboxError) -> None:
        """On with the last valid scene, whose frames count again from a new generation on."""
        if not self._fail(error):
            self._watcher.refused(error)
        await self._stream.update({})

    def _fail(self, error: SunboxError) -> bool:
        """Tells those who wait; whether there were any."""
        waiting = [future for _, _, future in self._waiting if not future.done()]
        for future in waiting:
            future.set_exception(error)
        return bool(waiting)

    def _take(self, frame: Frame) -> None:
        self.frame = frame
        if self._has_room():
            self._pass_on(frame)
        for generation, samples, future in self._waiting:
            if not future.done() and self._suffices(frame, generation, samples):
                future.set_result(frame)

    def _take_last(self) -> None:
        """The picture is done: whoever waits for more samples gets what there is."""
        assert self.frame is not None
        for generation, _, future in self._waiting:
            if not future.done() and self.frame.generation >= generation:
                future.set_result(self.frame)

    def _pass_on(self, frame: Frame) -> None:
        self._shown = frame
        self._unseen.append(frame.seq)
        self._watcher.framed(frame)

    async def _until_room(self) -> None:
        """Until the next frame has somewhere to go: to whoever waits, or looks and has seen the others."""
        while not (any(not future.done() for _, _, future in self._waiting) or self._has_room()):
            self._room.clear()
            await self._room.wait()

    def _has_room(self) -> bool:
        return bool(self._looking) and len(self._unseen) < MOST_UNSEEN

    @staticmethod
    def _suffices(frame: Frame | None, generation: int, samples: int) -> bool:
        return frame is not None and frame.generation >= generation and frame.samples >= samples
