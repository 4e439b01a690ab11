"""Questions about the BSDF of one material, asked of the renderers."""

from __future__ import annotations

import asyncio
from contextlib import nullcontext
from dataclasses import replace

import numpy as np

from service.problems import Internal, Unavailable
from service.rendering.ipc.messages import EvaluateBsdf, Evaluated, Failed, FromRenderer
from service.rendering.renderers import Renderers

MOST = 64  # questions at a time, of all callers together
LONG = 1 << 18  # samples: some 50 ms of two cores
LONG_AT_ONCE = 2  # long questions at a time, as each one takes as much of the renderer's time as a stream does


class BsdfQuestions:
    """Sends questions and awaits their answers, on the event loop."""

    def __init__(self, renderers: Renderers) -> None:
        self._renderers = renderers
        self._open = 0
        self._long = asyncio.Semaphore(LONG_AT_ONCE)

    async def ask(self, question: EvaluateBsdf) -> dict[str, np.ndarray]:
        """The arrays of its Evaluated; whoever asks may be cancelled. The renderers give the task its number.

        Raises Unavailable where too many wait or nothing renders, Internal where the renderer fails.
        """
        if self._open >= MOST:
            raise Unavailable("There are too many questions about materials just now.")
        self._open += 1
        try:
            async with self._long if question.samples * len(question.wo) > LONG else nullcontext():
                return await self._answer(question)
        finally:
            self._open -= 1

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
