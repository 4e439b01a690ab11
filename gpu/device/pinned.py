"""Buffers in the caller's own memory, on a software renderer.

With GL_AMD_pinned_memory a million triangles are in memory once: the driver makes no copy of them.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np

from gpu.context import opengl_library

LEAST = 1 << 18  # bytes; smaller arrays are copied
_TARGET, _STATIC_DRAW = 0x9160, 0x88E4  # EXTERNAL_VIRTUAL_MEMORY_BUFFER_AMD
_SOFTWARE = "llvmpipe"


class Pinned:
    """A buffer that only kernels read, with moderngl's methods. It keeps the array; the context must be current."""

    def __init__(self, context: Any, array: np.ndarray) -> None:
        self._array = array
        self.size = array.nbytes
        gl, name = _functions(), ctypes.c_uint()
        context.error  # noqa: B018  # clears an older error
        gl.glGenBuffers(1, ctypes.byref(name))
        self._name = name
        gl.glBindBuffer(_TARGET, name)
        gl.glBufferData(_TARGET, ctypes.c_ssize_t(self.size), ctypes.c_void_p(array.ctypes.data), _STATIC_DRAW)
        gl.glBindBuffer(_TARGET, ctypes.c_uint(0))
        self.refused = context.error != "GL_NO_ERROR"
        self._buffer = context.external_buffer(name.value, self.size)

    def bind_to_storage_buffer(self, binding: int) -> None:
        self._buffer.bind_to_storage_buffer(binding)

    def bind_to_uniform_block(self, binding: int, size: int) -> None:
        self._buffer.bind_to_uniform_block(binding, size=size)

    def release(self) -> None:
        _functions().glDeleteBuffers(1, ctypes.byref(self._name))


def pin(context: Any, array: np.ndarray) -> Pinned | None:
    """The array as a buffer, without a copy; None where the driver cannot do that or a copy is cheap.

    The array must be read-only: the device would see a write.
    """
    if array.nbytes < LEAST or array.flags.writeable or not array.flags.c_contiguous:
        return None
    if _SOFTWARE not in context.info["GL_RENDERER"] or "GL_AMD_pinned_memory" not in context.extensions:
        return None
    pinned = Pinned(context, array)
    if pinned.refused:
        pinned.release()
        return None
    return pinned


@cache
def _functions() -> Any:
    return ctypes.CDLL(opengl_library())
