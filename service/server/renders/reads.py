"""Requests for a render's picture that the renderer has not answered yet."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable

from service.ipc.messages import Image, Read, View
from service.problems import ServiceError


class Reads:
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
