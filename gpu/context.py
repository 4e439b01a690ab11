"""A headless OpenGL context through EGL, or an error that names what is missing."""

from __future__ import annotations

import contextlib
import ctypes
import logging
import threading
from functools import cache
from typing import Any

import numpy as np

from gpu import egl
from gpu.errors import ContextError, DeviceLost, OutOfMemory, SceneTooLarge

log = logging.getLogger(__name__)
_thread = threading.local()

REQUIRED = 430  # compute shaders and storage buffers
STORAGE_BLOCKS = 16  # of the largest kernel; OpenGL 4.3 promises 8, and drivers of desktops' GPUs have 16 or more
PACKAGES = "libegl1 libopengl0 libgl1-mesa-dri"
DEDICATED_VIDEO_MEMORY = 0x9047  # GPU_MEMORY_INFO_DEDICATED_VIDMEM_NVX
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "basic render driver")


def devices() -> list[egl.Device]:
    """EGL's devices; their numbers are their places in the list. Raises ContextError without libEGL."""
    found = egl_library()
    if found is None:
        raise ContextError(f"libEGL is not installed: on Debian `apt-get install {PACKAGES}`")
    try:
        return egl.devices(egl.functions(found))
    except egl.EglError as error:
        raise ContextError(f"this libEGL cannot list its devices ({error})") from None


def software_device() -> int:
    """The number of EGL's device that is the processor. Raises ContextError where there is none."""
    number = next((i for i, device in enumerate(devices()) if device.software), None)
    if number is None:
        raise ContextError(f"Mesa's software renderer is not installed: on Debian `apt-get install {PACKAGES}`")
    return number


def create(device: int | None = None) -> Any:
    """A moderngl context of OpenGL 4.3 or later that belongs to the calling thread.

    `device` counts EGL's devices from 0; None takes the default. Raises ContextError naming the package, driver or
    version that is missing.
    """
    import moderngl

    opengl = opengl_library()
    for name, library in (("libEGL", egl_library()), ("libOpenGL", opengl)):
        if library is None:
            raise ContextError(f"{name} is not installed: on Debian `apt-get install {PACKAGES}`")
    options: dict[str, Any] = {"backend": "egl", "libgl": opengl}
    if device is not None:
        options["device_index"] = device
    try:
        context = _resettable(device or 0) or moderngl.create_context(REQUIRED, standalone=True, **options)
    except Exception as error:  # glcontext raises bare Exception, moderngl several others
        where = "the default EGL device" if device is None else f"EGL device {device}"
        raise ContextError(
            f"no OpenGL {REQUIRED / 100:.1f} context on {where} ({error}): needs a GPU driver with EGL, "
            f"or Mesa's software renderer (on Debian `apt-get install {PACKAGES}`). An NVIDIA GPU that is divided by "
            "MIG has no OpenGL, and a container needs NVIDIA_DRIVER_CAPABILITIES=graphics,utility,compute"
        ) from error
    _thread.current = context
    if (blocks := int(context.info["GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS"])) < STORAGE_BLOCKS:
        renderer = context.info["GL_RENDERER"]
        release(context)
        raise ContextError(f"{renderer} gives a kernel {blocks} storage buffers; Sunbox needs {STORAGE_BLOCKS}")
    log.info("created context", {"driver": context.info["GL_RENDERER"], "version": context.info["GL_VERSION"]})
    return context


def _resettable(device: int) -> Any:
    """A context that says when its device was reset; None where EGL gives none, or none of OpenGL 4.3."""
    import moderngl

    try:
        library = egl.functions(egl_library() or "")
        backend = egl.EglContext(library, ctypes.CDLL(opengl_library()), device, REQUIRED)
    except (egl.EglError, AttributeError, OSError) as error:
        log.info("a reset of the device will not be noticed", {"error": error})
        return None
    context = moderngl.create_context(REQUIRED, standalone=True, context=backend)  # type: ignore[arg-type]
    context.extra = backend
    return context


def finish(context: Any) -> None:
    """Wait for the device. Raises DeviceLost: what it has of pictures since is not to be shown to anybody."""
    context.finish()
    if reason := reset_reason(context):
        raise DeviceLost(f"the device was reset {reason}")


def reset_reason(context: Any) -> str | None:
    """Why the context's device was reset, in words; None where it was not, or nobody can tell."""
    return None if context.extra is None else egl.reset(context.extra)


def use(context: Any) -> None:
    """Make `context` the thread's current one, where another has been made or closed since."""
    if getattr(_thread, "current", None) is not context:
        context.__enter__()
        _thread.current = context


def release(context: Any) -> None:
    """Release `context`; none is current afterwards."""
    use(context)
    context.release()
    _thread.current = None


def allocate(context: Any, contents: np.ndarray | int) -> Any:
    """A buffer with these bytes, or of that many. Raises OutOfMemory, for which moderngl itself does not check."""
    size = contents if isinstance(contents, int) else contents.nbytes
    context.error  # noqa: B018  # an older one is not this buffer's
    try:
        buffer = context.buffer(reserve=size) if isinstance(contents, int) else context.buffer(contents)
    except Exception as error:  # moderngl.Error is not importable without its binary parts
        raise OutOfMemory(f"the device has no {size / 2**20:.0f} MiB left") from error
    if context.error == "GL_OUT_OF_MEMORY":
        buffer.release()
        raise OutOfMemory(f"the device has no {size / 2**20:.0f} MiB left")
    return buffer


def block(context: Any, contents: np.ndarray | int) -> Any:
    """A buffer of which a kernel is given all at once. Raises SceneTooLarge, OutOfMemory.

    llvmpipe promises 128 MiB and gives what there is.
    """
    size = contents if isinstance(contents, int) else contents.nbytes
    most = storage_block_bytes(context)
    if size > most and not is_software(context):
        raise SceneTooLarge(
            f"{size / 2**20:.0f} MiB of one kind of record: this driver gives a kernel {most / 2**20:.0f} MiB at once"
        )
    return allocate(context, contents)


def texture(context: Any, size: tuple[int, int], channels: int, dtype: str, data: np.ndarray | None = None) -> Any:
    """A texture of `size`, (width, height). Raises SceneTooLarge, and OutOfMemory, for which moderngl does not
    check."""
    most, bytes_ = int(context.info["GL_MAX_TEXTURE_SIZE"]), size[0] * size[1] * channels * int(dtype[1:])
    if max(size) > most:
        raise SceneTooLarge(f"a texture of {size[0]} x {size[1]} texels: this driver takes {most} on a side")
    context.error  # noqa: B018  # an older one is not this texture's
    short = f"the device has no {bytes_ / 2**20:.0f} MiB left for textures"
    try:
        made = context.texture(size, channels, data, dtype=dtype)
    except Exception as error:  # moderngl.Error is not importable without its binary parts
        raise OutOfMemory(short) from error
    if context.error == "GL_OUT_OF_MEMORY":
        made.release()
        raise OutOfMemory(short)
    return made


def dispatch(context: Any, kernel: Any, *groups: int, beside: bool = False) -> None:
    """Start a kernel, the one way to do so; the caller waits for it. Whatever later commands do, they see what the
    kernel wrote: by OpenGL 4.3, 7.12.2, nothing else makes them, glFinish neither.

    With `beside` the next dispatch may run at the same time: it touches nothing that this one writes.
    """
    kernel.run(*groups)
    if not beside:
        context.memory_barrier()


def is_software(context: Any) -> bool:
    """True if the context's device is the processor."""
    renderer = str(context.info["GL_RENDERER"]).lower()
    return any(name in renderer for name in _SOFTWARE)


def storage_block_bytes(context: Any) -> int:
    """The most bytes of a buffer that a kernel may be given at once."""
    return int(context.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"])


def describe(context: Any) -> dict[str, Any]:
    """Renderer, version and vendor as the driver says them; `software`: it runs on the CPU; `memory`: a GPU's own, in
    bytes, None where the driver does not say."""
    info = context.info
    renderer = str(info["GL_RENDERER"])
    software = is_software(context)
    return {
        "renderer": renderer,
        "version": str(info["GL_VERSION"]),
        "vendor": str(info["GL_VENDOR"]),
        "software": software,
        "memory": None if software else _memory(context),  # llvmpipe lists the extension and answers with anything
    }


def _memory(context: Any) -> int | None:
    """Bytes of a GPU's own memory, by the extension GL_NVX_gpu_memory_info, which moderngl has no name for."""
    if "GL_NVX_gpu_memory_info" not in context.extensions:
        return None
    kibibytes = ctypes.c_int(0)
    ctypes.CDLL(opengl_library()).glGetIntegerv(DEDICATED_VIDEO_MEMORY, ctypes.byref(kibibytes))
    return kibibytes.value * 1024 if kibibytes.value > 0 else None


def egl_library() -> str | None:
    """The name of EGL's library; None where it is not installed."""
    return _first_library("libEGL.so.1")


def opengl_library() -> str | None:
    """The name of the library with OpenGL's functions; the first of these comes without X11's libraries."""
    return _first_library("libOpenGL.so.0", "libGL.so.1")


@cache
def _first_library(*names: str) -> str | None:
    """The first of these libraries that can be loaded, under the name by which programs are linked to it.

    ctypes.util.find_library starts a process for each question, which takes 5 ms.
    """
    for name in names:
        with contextlib.suppress(OSError):
            ctypes.CDLL(name)
            return name
    return None
