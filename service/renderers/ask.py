"""One question to the renderers, in a task of its own, and its one answer; among them those about BSDFs."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np

from service.ipc.messages import EvaluateBsdf, Evaluated, Failed, Frame, FromRenderer, Update, Want
from service.problems import Internal, Unavailable
from service.renderers.protocol import Renderers
from service.renderers.statistics import Kind
from service.system.executors import KeyedLocks
from service.system.shares import Shares

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


MOST = 64  # short questions at a time, of all callers together; as many long ones, most of which wait
LONG = 1 << 18  # samples: some 50 ms of two cores
# Long questions at a time, of which a caller has one: each takes as much of the renderer's time as a stream does.
LONG_AT_ONCE = 2


class BsdfQuestions:
    """Sends questions and awaits their answers, on the event loop."""

    def __init__(self, renderers: Renderers) -> None:
        self._renderers = renderers
        self._short = Shares(MOST, "questions about materials", retry_s=1)
        self._long = Shares(MOST, "long questions about materials")
        self._turns = KeyedLocks[str]()  # by caller
        self._slots = asyncio.Semaphore(LONG_AT_ONCE)

    async def ask(self, question: EvaluateBsdf, caller: str = "") -> dict[str, np.ndarray]:
        """The arrays of its Evaluated; the asking task may be cancelled. The renderers give the task its number.

        Long questions of one caller are answered one after the other. Raises TooManyRequests or Unavailable where too
        many wait, Unavailable where nothing renders, and Internal where the renderer fails.
        """
        if question.samples * len(question.wo) <= LONG:
            with self._short.taken(caller):
                return await self._answer(question)
        with self._long.taken(caller):
            async with self._turns.of(caller), self._slots:
                return await self._answer(question)

    async def _answer(self, question: EvaluateBsdf) -> dict[str, np.ndarray]:
        evaluated = await ask(self._renderers, question, answer=Evaluated, kind="bsdf", client=question.client)
        return evaluated.arrays
