"""Questions about the BSDF of one material, asked of the renderers."""

from __future__ import annotations

import asyncio
import weakref
from dataclasses import replace

import numpy as np

from service.ipc.messages import EvaluateBsdf, Evaluated, Failed, FromRenderer
from service.problems import Internal, Unavailable
from service.renderers.protocol import Renderers
from service.system.shares import Shares

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
        self._turns: weakref.WeakValueDictionary[str, asyncio.Lock] = weakref.WeakValueDictionary()  # by caller
        self._slots = asyncio.Semaphore(LONG_AT_ONCE)

    async def ask(self, question: EvaluateBsdf, caller: str = "") -> dict[str, np.ndarray]:
        """The arrays of its Evaluated; whoever asks may be cancelled. The renderers give the task its number.

        Long questions of one caller are answered one after the other. Raises TooManyRequests or Unavailable where too
        many wait, Unavailable where nothing renders, and Internal where the renderer fails.
        """
        if question.samples * len(question.wo) <= LONG:
            with self._short.taken(caller):
                return await self._answer(question)
        with self._long.taken(caller):
            turn = self._turns.setdefault(caller, asyncio.Lock())
            async with turn, self._slots:
                return await self._answer(question)

    async def _answer(self, question: EvaluateBsdf) -> dict[str, np.ndarray]:
        waiting = _Waiting(asyncio.get_running_loop().create_future())
        task = self._renderers.open(waiting, "bsdf", question.client)
        try:
            self._renderers.send(replace(question, task=task, client=question.client or str(task)))
            return await waiting.answer
        finally:
            self._renderers.drop(task)


class _Waiting:
    """A Listener for one answer."""

    def __init__(self, answer: asyncio.Future[dict[str, np.ndarray]]) -> None:
        self.answer = answer

    def heard(self, message: FromRenderer) -> None:
        if self.answer.done():
            return
        if isinstance(message, Evaluated):
            self.answer.set_result(message.arrays)
        elif isinstance(message, Failed):
            self.answer.set_exception(Internal(message.detail))

    def again(self) -> None:
        """Another renderer gets the same question."""

    def lost(self, detail: str) -> None:
        if not self.answer.done():
            self.answer.set_exception(Unavailable(detail))
