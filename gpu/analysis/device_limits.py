"""A device by its driver's words: its limits, the width of its subgroups, and its free memory."""

from __future__ import annotations

import ctypes
from typing import Any

from gpu import context as contexts

LIMITS = (
    "GL_MAX_SHADER_STORAGE_BLOCK_SIZE",
    "GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS",
    "GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS",
    "GL_MAX_UNIFORM_BLOCK_SIZE",
    "GL_MAX_COMPUTE_UNIFORM_BLOCKS",
    "GL_MAX_COMPUTE_WORK_GROUP_COUNT",
    "GL_MAX_COMPUTE_WORK_GROUP_SIZE",
    "GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS",
    "GL_MAX_TEXTURE_SIZE",
)
SHADING_LANGUAGE_VERSION, MAX_COMPUTE_SHARED_MEMORY_SIZE = 0x8B8C, 0x8262
# Extension -> the name of its number, and the unit of that number.
SUBGROUPS = {"GL_KHR_shader_subgroup": (0x9532, 1), "GL_NV_shader_thread_group": (0x9339, 1)}
# Of NVIDIA the available memory of the device, of AMD that for buffers; both in KiB.
FREE_MEMORY = {"GL_NVX_gpu_memory_info": (0x9049, 1024), "GL_ATI_meminfo": (0x87FB, 1024)}


def device_limits(device: int | None = None) -> dict[str, Any]:
    """The entries of `context.describe`, and `glsl`, the version of the shading language; `limits` by OpenGL's names;
    `subgroup_size` in invocations and `free_memory` in bytes, None where the driver does not say.

    Makes a context of its own. Raises ContextError.
    """
    context = contexts.create(device)
    try:
        limits = {name: context.info[name] for name in LIMITS}
        limits["GL_MAX_COMPUTE_SHARED_MEMORY_SIZE"] = _integers(MAX_COMPUTE_SHARED_MEMORY_SIZE)[0]
        return {
            **contexts.describe(context),
            "glsl": _text(SHADING_LANGUAGE_VERSION),
            "limits": limits,
            "subgroup_size": _of_extension(context, SUBGROUPS),
            "free_memory": free_memory(context),
        }
    finally:
        contexts.release(context)


def free_memory(context: Any) -> int | None:
    """Bytes that the device has left, None where its driver does not say. `context` must be the current one."""
    if contexts.describe(context)["software"]:
        return None  # llvmpipe lists the extensions, and answers with anything
    return _of_extension(context, FREE_MEMORY)


def _of_extension(context: Any, names: dict[str, tuple[int, int]]) -> int | None:
    for extension, (name, unit) in names.items():
        if extension in context.extensions:
            value = _integers(name)[0]
            return value * unit if value > 0 else None
    return None


def _integers(name: int) -> list[int]:
    """The numbers that glGetIntegerv writes: at most four for the names above."""
    values = (ctypes.c_int * 4)()
    ctypes.CDLL(contexts.opengl_library()).glGetIntegerv(name, values)
    return list(values)


def _text(name: int) -> str:
    get = ctypes.CDLL(contexts.opengl_library()).glGetString
    get.restype = ctypes.c_char_p
    return (get(name) or b"").decode()
