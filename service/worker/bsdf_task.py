"""One question about the BSDF of a material: it has its turns among the pictures, and ends with its answer."""

from __future__ import annotations

from collections.abc import Generator

from gpu import BsdfAlbedo, BsdfTerms, BsdfValues, Steps
from gpu.precompile import kernel_keys
from service.ipc.messages import EvaluateBsdf, Evaluated
from service.worker.context import WorkerContext
from service.worker.helpers.kernel_wait import KernelWait
from service.worker.payloads import scene_arrays
from service.worker.scheduler import Account


class BsdfTask:
    """Evaluated in slices. A helper compiles its kernel first."""

    attempted = 0  # there are no generations
    wanted = False  # there are no frames

    def __init__(self, context: WorkerContext, question: EvaluateBsdf) -> None:
        self.number, self.client = question.task, question.client
        self.account = Account()
        self._question, self._material = question, scene_arrays(question.material)
        self._send = context.send
        self._evaluator = context.renderer.bsdf
        self._key = kernel_keys.bsdf_key(self._material, question.question)
        self._wait = KernelWait(context.compiler, self.client)
        self._steps: Steps[BsdfValues | BsdfAlbedo | BsdfTerms] | None = None
        self._begun = self._ended = False

    @property
    def ready(self) -> bool:
        return not self._ended and not self._wait.compiling

    @property
    def unseen(self) -> bool:
        """True if it goes first: an answer that takes more than one slice has no preference from then on."""
        return self.ready and not self._begun

    @property
    def loads(self) -> bool:
        """True if its next turn may take as long as a compilation does."""
        return not self._begun

    def turn(self) -> None:
        """Does a slice, and sends the answer after the last one."""
        if self._steps is None:
            if self._wait.begin(self._key):
                return
            self._steps = Steps(self._work())
        answer = self._steps.step()
        if not self._begun:
            self._begun = True
            self._wait.loaded(self._key)
        if answer is not None:
            self._ended = True
            self._send(Evaluated(self.number, vars(answer)))

    def _work(self) -> Generator[None, None, BsdfValues | BsdfAlbedo | BsdfTerms]:
        asked, evaluator = self._question, self._evaluator
        if asked.question == "albedo":
            return evaluator.albedo(self._material, asked.wo, asked.samples)
        if asked.question == "terms":
            return evaluator.terms(self._material, asked.wo, asked.wi)
        return evaluator.values(self._material, asked.wo, asked.wi, lobes=asked.lobes)

    def fail(self) -> None:
        """The server is told by the loop."""
        self._ended = True
        self.release()

    def release(self) -> None:
        self._wait.forget()
        if self._steps is not None:
            self._steps.close()
