"""Questions about the BSDF of one material, asked of the renderers."""

from __future__ import annotations

import asyncio

import numpy as np

from service.ipc.messages import EvaluateBsdf, Evaluated
from service.renderers.ask import ask
from service.renderers.protocol import Renderers
from service.system.shares import Shares
from service.system.turns import KeyedLocks

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
