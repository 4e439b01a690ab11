"""Errors of the GPU.

GpuError
    ContextError       no EGL context: says which package or driver is missing
    CompileError       a kernel that the driver refused, with file and line
    OutOfMemory        buffers that the device would not give
    SceneTooLarge      more than the layouts can index, or the driver promises
    DeviceLost         the device was reset: what its memory holds means nothing
    WrongThread        a call from another thread than the renderer's own
    NothingRendered    an image asked for before its first sample
"""


class GpuError(Exception):
    """Root of all errors of this room."""


class ContextError(GpuError):
    pass


class CompileError(GpuError):
    pass


class OutOfMemory(GpuError):
    pass


class SceneTooLarge(GpuError):
    pass


class DeviceLost(GpuError):
    pass


class WrongThread(GpuError):
    pass


class NothingRendered(GpuError):
    pass
