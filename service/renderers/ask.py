"""One question to the renderers, in a task of its own, and its one answer."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Generic, TypeVar

from service.ipc.messages import EvaluateBsdf, Evaluated, Failed, Frame, FromRenderer, Update, Want
from service.problems import Internal, Unavailable
from service.renderers.protocol import Renderers
from service.renderers.statistics import Kind

T = TypeVar("T", Frame, Evaluated)


async def ask(
    renderers: Renderers,
    *messages: Update | Want | EvaluateBsdf,
    answer: type[T],
    kind: Kind,
    client: str = "",
    patience_s: float | None = None,
) -> T:
    """The first message of the type `answer` to a task that is sent these messages, and is dropped afterwards.

    Raises Unavailable where nothing renders, Internal where the renderer fails, and TimeoutError where it does not
    answer within `patience_s`. The caller may be cancelled.
    """
    listener = _First(answer)
    task = renderers.open(listener, kind, client)
    try:
        for message in messages:
            message = replace(message, task=task)
            if isinstance(message, Update):
                await renderers.send_scene(message)
            else:
                renderers.send(message)
        async with asyncio.timeout(patience_s):
            return await listener.message
    finally:
        renderers.drop(task)
        listener.message.cancel()


class _First(Generic[T]):
    """A Listener for the first message of one type."""

    def __init__(self, kind: type[T]) -> None:
        self._kind: type[T] = kind
        self.message: asyncio.Future[T] = asyncio.get_running_loop().create_future()

    def heard(self, message: FromRenderer) -> None:
        if isinstance(message, Failed):
            self._fail(Internal(message.detail))
        elif isinstance(message, self._kind) and not self.message.done():
            self.message.set_result(message)

    def again(self) -> None:
        """Another renderer gets the same question."""

    def lost(self, detail: str) -> None:
        self._fail(Unavailable(detail))

    def _fail(self, error: Internal | Unavailable) -> None:
        if not self.message.done():
            self.message.set_exception(error)
