"""Shows the picture of a render: what a renderer has of it, or else what was stored last."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from service.ipc.messages import Failed, FromRenderer, Image, Progress, Read, View
from service.problems import Conflict, Internal, ServiceError, Unavailable
from service.renderers.protocol import Listener, Renderers
from service.server.renders.recorder import Recorder
from service.server.renders.scene import RenderScene
from service.server.renders.status import error_of
from service.system.background import within

PATIENCE_S = 30.0  # for the first sample after the renderer was lost
ASK_AGAIN_S = 5  # for a client whose picture was lost with a renderer


class KeepsPictures(Protocol):
    """Where pictures that a renderer has are registered, so that they make room when memory is needed."""

    def add(self, render: Any) -> None:
        """Somebody has looked at a render's picture, or it has ended."""


class Shown(Protocol):
    """A render, as far as its picture needs it."""

    id: str
    owner: str
    renderers: Renderers
    scene: RenderScene
    recorder: Recorder | None
    loaded_pictures: KeepsPictures | None
    task: int | None

    async def document(self) -> bytes: ...


class PictureViewer(Listener):
    """For the event loop. Where no renderer has the picture, it opens a task that shows what was stored and traces
    nothing; the render closes that task when it goes on."""

    def __init__(self, render: Shown) -> None:
        self.task: int | None = None  # that shows what was stored
        self.loading = asyncio.Lock()  # while this task is opened, or that of the render
        self._render, self._reads = render, Reads()
        self._waiting = 0  # callers of `image`
        self._sampled = asyncio.Event()  # cleared while there are no samples any more, the renderer having been lost
        self._sampled.set()
        self._error: ServiceError | None = None

    @property
    def busy(self) -> bool:
        """True if somebody waits for an image."""
        return bool(self._reads or self._waiting)

    async def image(self, view: View) -> tuple[np.ndarray, Progress]:
        """The picture so far. Raises Conflict before the first sample, and the error of `refuse`.

        A picture that this brings back into memory is registered here as one that can leave it again.
        """
        if self._error is not None:
            raise self._error
        self._waiting += 1
        try:
            await within(self._sampled, PATIENCE_S)
            await self._open()  # last, as the render may go on at any moment, with a task of its own
            if (task := self._source) is None:
                raise self._error or Conflict("There is no sample yet.")
            image = await self._reads.ask(view, task, self._render.renderers.send)
        finally:
            self._waiting -= 1
            if not self._waiting and self._render.loaded_pictures is not None:
                self._render.loaded_pictures.add(self._render)
        if image.pixels is None:
            raise Conflict("There is no sample yet.")
        return image.pixels, image.progress

    def follow(self, task: int) -> None:
        """The render's own task has its scene: what is asked is asked there."""
        self._reads.ask_again(task, self._render.renderers.send)

    def sampled(self, there: bool = True) -> None:
        """There are samples to show; or those that there were are lost, and come again."""
        if there:
            self._sampled.set()
        else:
            self._sampled.clear()

    def interrupt(self, error: ServiceError) -> None:
        """Answer pending reads with this; others may ask again."""
        self._reads.answer_all(error)

    def refuse(self, error: ServiceError) -> None:
        """There is no picture, and will be none."""
        self._error = error
        self._sampled.set()
        self._reads.answer_all(error)

    def close(self) -> None:
        """End the task that shows what was stored. Pending reads go to the render's own task then, or have ended."""
        if self.task is not None:
            self._render.renderers.drop(self.task)
            self.task = None

    def heard(self, message: FromRenderer) -> None:
        if isinstance(message, Image):
            self._reads.answer(message.serial, message)
        elif isinstance(message, Failed) and message.serial is not None:
            self._reads.answer(message.serial, error_of(message))
        elif isinstance(message, Failed) and self.task is not None:
            self._reads.answer_all(error_of(message))
            self._give_up()

    def again(self) -> None:
        """Another renderer gets the same stored picture."""

    def lost(self, detail: str) -> None:
        self.task = None
        self._render.scene.memory.release()
        self._reads.answer_all(Unavailable("The renderer was lost: ask again.", ASK_AGAIN_S))

    @property
    def _source(self) -> int | None:
        """The task that has the picture."""
        return self._render.task if self._render.task is not None else self.task

    async def _open(self) -> None:
        """Have a renderer show what was stored last, if none has the picture. Raises Conflict where nothing was."""
        render, recorder = self._render, self._render.recorder
        if self._source is None and (recorder is None or recorder.store.latest(render.id) is None):
            raise Conflict("There is no sample yet.")
        async with self.loading:
            if self._source is not None or recorder is None:
                return
            if (kind := recorder.store.latest(render.id)) is None:
                raise Conflict("There is no sample yet.")
            try:
                packed = await render.scene.load(render.document)
                render.scene.memory.hold()
                self.task = task = render.renderers.open(self, "render", render.owner)
                restore = await recorder.store.read(render.id, kind, task)
                if restore is None:
                    raise Internal("The stored picture is damaged.")
                restore = replace(restore, reason=restore.reason or "stopped")
                await render.renderers.send_scene(render.scene.update(task, packed), restore)
                self._reads.ask_again(task, render.renderers.send)
            except BaseException:  # the client may go away meanwhile, too
                self._give_up()
                raise

    def _give_up(self) -> None:
        self.close()
        self._render.scene.memory.release()


class Reads:
    """Requests for a picture that the renderer has not answered yet."""

    def __init__(self) -> None:
        self._open: dict[int, tuple[View, asyncio.Future[Image]]] = {}
        self._serials = itertools.count(1)

    def __bool__(self) -> bool:
        return bool(self._open)

    async def ask(self, view: View, task: int, send: Callable[[Read], None]) -> Image:
        """The answer to a Read of the task. Raises the error that is answered."""
        serial = next(self._serials)
        future: asyncio.Future[Image] = asyncio.get_running_loop().create_future()
        self._open[serial] = view, future
        send(Read(task, serial, view))
        return await future

    def ask_again(self, task: int, send: Callable[[Read], None]) -> None:
        """Ask another task what is open."""
        for serial, (view, _) in list(self._open.items()):
            send(Read(task, serial, view))

    def answer(self, serial: int, answer: Image | ServiceError) -> None:
        _, future = self._open.pop(serial, (None, None))
        if future is None or future.done():
            return
        if isinstance(answer, ServiceError):
            future.set_exception(answer)
        else:
            future.set_result(answer)

    def answer_all(self, error: ServiceError) -> None:
        for serial in list(self._open):
            self.answer(serial, error)
