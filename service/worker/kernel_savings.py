"""What the kernel of one task's picture saves beside the one with everything on: measured when somebody asks, while
nobody has work. A process that gets what time is left over compiles that kernel (a minute and a half of llvmpipe).
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from gpu import GpuError, Steps
from gpu.analysis.kernel_cost import full_kernel, kernel_cost_steps
from service.ipc.kernel_messages import KernelMeasured
from service.worker.context import WorkerContext
from service.worker.helpers.kernel_wait import KernelWait

if TYPE_CHECKING:
    from gpu import Picture
    from gpu.analysis.kernel_cost import KernelCost

SLICE_S = 0.015  # how long a task that comes meanwhile may have to wait
NO_KERNEL = (
    "Not measured: the kernel with every feature is not in the driver's disk cache, and to compile it would delay "
    "others; `sunbox info` compiles it and measures."
)
NO_PICTURE = "Not measured: the renderer has no picture of this scene, or no longer has it."

log = logging.getLogger(__name__)


class KernelSavings:
    def __init__(self, context: WorkerContext, number: int) -> None:
        """Without a compiler for spare time nothing is measured."""
        self._number, self._send, self._renderer = number, context.send, context.renderer
        self._spare, self._wait = context.spare, KernelWait(context.spare)
        self._asked = False
        self._steps: Steps[KernelCost] | None = None

    @property
    def due(self) -> bool:
        """Whether there is a step to be done while the loop has nothing else to do."""
        return self._asked and not self._wait.compiling

    def ask(self) -> None:
        self._asked = True

    def part(self) -> None:
        """The picture leaves the device or is replaced: a measurement under way begins again."""
        if self._steps is not None:
            self._steps.close()
        self._wait.forget()
        self._steps = None

    def step(self, picture: Picture | None) -> None:
        if picture is None:
            self._tell(KernelMeasured(self._number, NO_PICTURE))
            return
        try:
            if self._steps is None and not self._waits(picture):
                self._steps = Steps(kernel_cost_steps(self._renderer, picture.scene, picture.settings, SLICE_S))
            if self._steps is not None and (cost := self._steps.step()) is not None:
                full_ms = cost.full_compile_ms + self._wait.take_ms()
                self._tell(KernelMeasured(self._number, "", full_ms, cost.sample_s, cost.full_sample_s))
        except GpuError as error:
            log.warning("could not compare kernels error=%s", error)
            self._tell(KernelMeasured(self._number, f"Not measured: {error}"))

    def _waits(self, picture: Picture) -> bool:
        """Whether the kernel with every feature is not compiled yet, or cannot be."""
        wanted = full_kernel(picture.scene.arrays, picture.settings)
        if self._spare is not None and (self._wait.begin(wanted) or self._spare.has(wanted)):
            return self._wait.compiling
        self._tell(KernelMeasured(self._number, NO_KERNEL))
        return True

    def _tell(self, measured: KernelMeasured) -> None:
        self._asked, self._steps = False, None
        self._send(measured)
