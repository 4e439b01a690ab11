"""Kernels that are compiled for nobody who is there: at the lowest priority, one for each idle compiler, and within a
bound."""

from __future__ import annotations

from collections import deque
from math import inf

from gpu import KernelKey
from gpu.precompile import kernel_keys
from service.ipc.messages import Foresee
from service.system.power import has_power_to_spare
from service.worker.device.loaded_scene import begin_key, slider_keys
from service.worker.helpers.compile_client import CompileClient

BUDGET_S = 60.0  # of a processor, after a start, for "some"
LONGEST_S = 10.0  # that one kernel takes: none is begun for which less is left


class ForeseenKernels:
    """Handed to the compilers one by one: those that were used here before, then those of scenes with which a
    client may begin or go on, then those of panels."""

    def __init__(self, compiler: CompileClient, bounded: bool = True) -> None:
        """Without a bound the sliders of all these scenes are foreseen, too."""
        self._compiler = compiler
        self._used = compiler.used() if compiler.foresees else iter(())
        self._scenes = deque[KernelKey]()
        self._sliders = deque[KernelKey]()
        self._panels = kernel_keys.bsdf_keys()
        self._bounded = bounded
        self._begun = False  # scenes have come: panels are not the first

    def add(self, message: Foresee) -> None:
        """Take a scene with which a client may begin or go on."""
        self._begun = True
        self._scenes.append(begin_key(message))
        if not self._bounded:
            self._sliders += slider_keys(message)

    def prepare(self) -> bool:
        """Hand on a kernel, if it is time for one; whether it was."""
        compiler = self._compiler
        budget_s = BUDGET_S - LONGEST_S if self._bounded else inf
        if not compiler.foresees or not compiler.is_idle("spare") or compiler.spare_s >= budget_s:
            return False
        if not has_power_to_spare() or (key := self._next()) is None:
            return False
        compiler.prepare([key], "spare")
        return True

    def _next(self) -> KernelKey | None:
        if (key := next(self._used, None)) is not None:
            return key
        for line in (self._scenes, self._sliders):
            if line:
                return line.popleft()
        return next(self._panels, None) if self._begun else None
