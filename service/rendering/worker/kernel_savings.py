"""What the kernel of one task's picture saves beside the one with everything on: measured when somebody asks, while
nobody has work. That kernel is compiled (17 s of llvmpipe) by a process that gets what time is left over.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from gpu import GpuError
from gpu.analysis.kernel_cost import full_kernel, kernel_cost_steps
from service.rendering.ipc.messages import FromRenderer, KernelMeasured
from service.rendering.worker.helpers.compile_client import CompileClient

if TYPE_CHECKING:
    from gpu import Picture, Renderer
    from gpu.analysis.kernel_cost import KernelCostSteps

SLICE_S = 0.015  # how long who comes may have to wait
NO_KERNEL = (
    "Not measured: the kernel with everything on is not in the driver's disk cache, and nobody shall wait for it; "
    "`sunbox info` compiles it and measures."
)
NO_PICTURE = "Not measured: there is no picture of it any more, or none yet."

log = logging.getLogger(__name__)


class KernelSavings:
    def __init__(
        self, number: int, send: Callable[[FromRenderer], None], renderer: Renderer, compiler: CompileClient | None
    ) -> None:
        """`compiler` is one for spare time; without one nothing is measured."""
        self._number, self._send = number, send
        self._renderer, self._compiler = renderer, compiler
        self._asked = self._compiling = False
        self._compile_ms = 0.0  # what it took elsewhere
        self._steps: KernelCostSteps | None = None

    @property
    def due(self) -> bool:
        """There is a step to be done, when nothing else is."""
        return self._asked and not self._compiling

    def ask(self) -> None:
        self._asked = True

    def part(self) -> None:
        """The picture leaves the device, or is another: what is under way begins again."""
        if self._steps is not None:
            self._steps.close()
        if self._compiler is not None:
            self._compiler.forget(self._hear_compiled)
        self._steps, self._compiling = None, False

    def step(self, picture: Picture | None) -> None:
        if picture is None:
            self._tell(KernelMeasured(self._number, NO_PICTURE))
            return
        try:
            if self._steps is None and not self._waits(picture):
                self._steps = kernel_cost_steps(self._renderer, picture.scene, picture.settings, SLICE_S)
            if self._steps is not None:
                next(self._steps)
        except StopIteration as end:
            price = end.value
            full_ms, self._compile_ms = price.full_compile_ms + self._compile_ms, 0.0
            self._tell(KernelMeasured(self._number, "", full_ms, price.sample_s, price.full_sample_s))
        except GpuError as error:
            log.warning("could not compare kernels error=%s", error)
            self._tell(KernelMeasured(self._number, f"Not measured: {error}"))

    def _waits(self, picture: Picture) -> bool:
        """Whether the kernel with everything on is not there yet, or can't be had."""
        wanted = full_kernel(picture.scene.arrays, picture.settings)
        if self._compiler is not None:
            self._compiling = self._compiler.waits(wanted, self._hear_compiled)
            if self._compiling or self._compiler.has(wanted):
                return self._compiling
        self._tell(KernelMeasured(self._number, NO_KERNEL))
        return True

    def _hear_compiled(self, milliseconds: float) -> None:
        self._compiling, self._compile_ms = False, milliseconds

    def _tell(self, appraised: KernelMeasured) -> None:
        self._asked, self._steps = False, None
        self._send(appraised)
