"""A context that only compiles, in a process of its own, into the driver's disk cache."""

from __future__ import annotations

import time
from typing import Any
from uuid import uuid4

import numpy as np

from gpu import context as contexts
from gpu.device.tables import Tables
from gpu.device.textures import BYTES
from gpu.errors import CompileError
from gpu.kernels.binaries import ENTRIES, ProgramBinaries
from gpu.layout import bindings
from gpu.picture import accumulators
from gpu.precompile.kernel_keys import KernelKey

_BUFFER = 1 << 16  # bytes of zeros that are bound to every slot; no invocation reads them
_QUICK_S = 0.04  # seconds of processor time below which the kernel came from the disk cache
_LOADED_S = 5.0  # ... and above which it did not; on llvmpipe the kernel for many scenes takes 0.5 s
_LOOKS = 8  # times that a kernel is looked up in the disk cache, which drivers write in a thread of their own


class Precompiler:
    """A context in a process of its own that only compiles. Raises ContextError where none can be created."""

    def __init__(self, device: int | None = None) -> None:
        self._context = contexts.create(device)
        self._zeros = self._context.buffer(bytes(_BUFFER))
        self._tables = Tables(self._context)
        self._binaries = ProgramBinaries(self._context)
        self._has_cache: bool | None = None  # whether the driver has a disk cache; None: not known yet

    def compile(self, wanted: KernelKey) -> tuple[float, bool]:
        """Compile a kernel: the milliseconds that it took, and whether another process has it now, from the driver's
        disk cache or from our own.

        Raises CompileError."""
        began = time.perf_counter()
        if self._binaries.able and wanted.entry in ENTRIES:
            cached = self._binaries.has(wanted.text)
            if not cached:
                self._once(wanted)
                cached = self._binaries.has(wanted.text)
            return (time.perf_counter() - began) * 1e3, cached
        first_s = self._once(wanted)
        milliseconds = (time.perf_counter() - began) * 1e3
        if first_s < _QUICK_S or self._is_faster(wanted, first_s):
            return milliseconds, True
        return milliseconds, first_s < _LOADED_S and self._caches()

    def _is_faster(self, wanted: KernelKey, first_s: float) -> bool:
        """True if a kernel that took `first_s` seconds soon takes much less: the driver has cached it."""
        for look in range(_LOOKS):
            time.sleep(0.002 * 2**look)
            if self._once(wanted) < max(_QUICK_S, first_s / 4):
                return True
        return False

    def _caches(self) -> bool:
        """True if the driver has a disk cache. Then a kernel that gets no faster was in there from the beginning."""
        if self._has_cache is None:
            line = 1 + uuid4().int % (1 << 30)  # of which no kernel was made before
            probe = KernelKey(tuple((accumulators.defines() | {"LINE": line}).items()), (), "merge.comp")
            self._has_cache = self._is_faster(probe, self._once(probe))
        return self._has_cache

    def _once(self, wanted: KernelKey) -> float:
        """Compile to machine code by running over no pixel. Returns the processor time that it took (s)."""
        text = wanted.text
        textures = [self._texture(*kind) for kind in wanted.textures]
        for unit, table in self._tables.textures({name for name, value in wanted.defines if value}).items():
            table.use(unit)
        start = time.process_time()
        try:
            kernel = self._context.compute_shader(text)
        except Exception as error:  # moderngl.Error is not importable without its binary parts
            raise CompileError(str(error)) from error
        for slot in range(len(bindings.Slot)):
            self._zeros.bind_to_storage_buffer(slot)
        for block in (bindings.UNIFORM_BLOCK, bindings.FILTER_BLOCK, *bindings.COUNTED.values()):
            self._zeros.bind_to_uniform_block(block)
        contexts.dispatch(self._context, kernel, 1, 1)
        contexts.finish(self._context)
        self._binaries.store(wanted.entry, text, kernel)
        seconds = time.process_time() - start
        for thing in (kernel, *textures):
            thing.release()
        return seconds

    def _texture(self, unit: int, channels: int, dtype: str, width: int, height: int) -> Any:
        zeros = np.zeros((height, width, channels * BYTES[dtype]), np.uint8)
        texture = self._context.texture((width, height), channels, zeros, alignment=1, dtype=dtype)
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        texture.use(unit)
        return texture
