"""Kernels that are compiled before anything needs them: for scenes with which streams may begin, and for panels."""

from __future__ import annotations

from collections import deque

from gpu import KernelKey
from gpu.precompile import kernel_keys
from service.ipc.messages import Foresee
from service.worker.device.loaded_scene import begin_key, slider_keys
from service.worker.helpers.compile_client import CompileClient


class ForeseenKernels:
    """Handed to the compiler one at a time, as tasks may soon need others more."""

    def __init__(self, compiler: CompileClient) -> None:
        self._compiler = compiler
        self._scenes = deque[KernelKey]()  # with which streams may begin; compiled after those that edits need
        self._sliders = deque[KernelKey]()  # of those scenes; compiled while nothing is traced
        self._panels = kernel_keys.bsdf_keys()  # compiled when nothing else is, so that no panel has to wait

    def add(self, message: Foresee) -> None:
        """Take a scene with which a stream may begin."""
        self._scenes.append(begin_key(message))
        self._sliders += slider_keys(message)

    def prepare(self, idle: bool) -> bool:
        """Queue one kernel for each priority that has none; whether there was one. `idle`: nothing is traced."""
        if not self._compiler.foresees:
            return False
        handed = False
        scenes = self._scenes or (self._sliders if idle else None)
        if scenes and self._compiler.is_idle("soon"):
            self._compiler.prepare([scenes.popleft()], "soon")
            handed = True
        if self._compiler.is_idle("spare") and (key := next(self._panels, None)) is not None:
            self._compiler.prepare([key], "spare")
            handed = True
        return handed
