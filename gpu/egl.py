"""EGL's devices, and a headless context that says when its device was reset, which moderngl's backend asks for
nowhere."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

PLATFORM_DEVICE, OPENGL_API = 0x313F, 0x30A2  # EGL_PLATFORM_DEVICE_EXT, EGL_OPENGL_API
SURFACE_TYPE, PBUFFER, RENDERABLE_TYPE, OPENGL, NONE = 0x3033, 1, 0x3040, 8, 0x3038
MAJOR, MINOR, PROFILE, CORE = 0x3098, 0x30FB, 0x30FD, 1
# EGL 1.5, 3.7.1: what was allocated and is under way may be lost, and the context says so from then on.
RESET_STRATEGY, LOSE_ON_RESET = 0x31BD, 0x31BF
RESETS = {0x8253: "by what it was doing", 0x8254: "by another program", 0x8255: "for an unknown reason"}

# What EGL tells of a device: EGL_EXT_device_query, _device_drm, _device_query_name and _device_persistent_id, and
# EGL_NV_device_cuda.
EXTENSIONS, VENDOR, DRM_FILE, RENDERER, UUID, CUDA_DEVICE = 0x3055, 0x3053, 0x3233, 0x335F, 0x335C, 0x323A
DRM_CLASS = Path("/sys/class/drm")
VENDORS = {"0x1002": "AMD", "0x8086": "Intel", "0x10de": "NVIDIA"}  # by their numbers on the PCI bus

Pointer = ctypes.c_void_p


class EglError(Exception):
    """EGL refused a call."""


@dataclass(frozen=True)
class Device:
    """One of EGL's devices: its `name` as far as EGL says it, its number among CUDA's devices, its UUID, 32
    hexadecimal digits, and its place on the PCI bus, 0000:01:00.0; None and "" where EGL does not say."""

    name: str
    software: bool
    cuda: int | None = None
    uuid: str = ""
    pci: str = ""


class EglContext:
    """A context as moderngl takes it: it is made current by `with`, and finds OpenGL's functions."""

    def __init__(self, egl: ctypes.CDLL, opengl: ctypes.CDLL, device: int, version: int) -> None:
        """A core context of OpenGL `version` (430) on EGL's device of that number, which is current afterwards.

        Raises EglError.
        """
        self._egl, self._opengl = egl, opengl
        self._display = _display(egl, device)
        attributes = [MAJOR, version // 100, MINOR, version // 10 % 10, PROFILE, CORE, RESET_STRATEGY, LOSE_ON_RESET]
        wanted = [SURFACE_TYPE, PBUFFER, RENDERABLE_TYPE, OPENGL]
        config, count = Pointer(), ctypes.c_int(0)
        egl.eglBindAPI(OPENGL_API)
        if not egl.eglChooseConfig(self._display, _list(wanted), ctypes.byref(config), 1, ctypes.byref(count)):
            raise EglError(f"eglChooseConfig: {_error(egl)}")
        if count.value < 1:
            raise EglError("no configuration for OpenGL")
        self._context = egl.eglCreateContext(self._display, config, None, _list(attributes))
        if not self._context:
            raise EglError(f"eglCreateContext: {_error(egl)}")
        if not self._current(self._context):
            error = _error(egl)
            egl.eglDestroyContext(self._display, Pointer(self._context))
            raise EglError(f"eglMakeCurrent: {error}")

    def load_opengl_function(self, name: str) -> int:
        """Its address, 0 where there is none."""
        address = self._egl.eglGetProcAddress(name.encode())
        if not address:
            found = getattr(self._opengl, name, None)
            address = None if found is None else ctypes.cast(found, Pointer).value
        return address or 0

    load = load_opengl_function

    def __enter__(self) -> EglContext:
        self._current(self._context)
        return self

    def __exit__(self, *_: object) -> None:
        self._current(None)

    def release(self) -> None:
        self._current(None)
        self._egl.eglDestroyContext(self._display, Pointer(self._context))

    def _current(self, context: int | None) -> bool:
        return bool(self._egl.eglMakeCurrent(self._display, None, None, Pointer(context)))


def functions(egl: str) -> ctypes.CDLL:
    """EGL's library, with the types of what is called."""
    library = ctypes.CDLL(egl)
    library.eglGetProcAddress.restype, library.eglGetProcAddress.argtypes = Pointer, [ctypes.c_char_p]
    library.eglChooseConfig.argtypes = [Pointer, Pointer, Pointer, ctypes.c_int, Pointer]
    library.eglCreateContext.restype, library.eglCreateContext.argtypes = Pointer, [Pointer] * 4
    library.eglMakeCurrent.argtypes, library.eglDestroyContext.argtypes = [Pointer] * 4, [Pointer] * 2
    library.eglInitialize.argtypes = [Pointer] * 3
    return library


def devices(egl: ctypes.CDLL) -> list[Device]:
    """EGL's devices. Raises EglError where it cannot list them."""
    ask = Questions(egl)
    return [described(ask, handle) for handle in _handles(egl)]


class Questions:
    """The questions that EGL answers about a device."""

    def __init__(self, egl: ctypes.CDLL) -> None:
        address = egl.eglGetProcAddress
        kinds_of = b"String", b"Attrib", b"Binary"
        string, number, binary = (address(b"eglQueryDevice%sEXT" % kind) for kind in kinds_of)
        if not string:
            raise EglError("no EGL_EXT_device_base")
        self._string = ctypes.CFUNCTYPE(ctypes.c_char_p, Pointer, ctypes.c_int)(string)
        kinds = ctypes.c_uint, Pointer, ctypes.c_int
        self._number = ctypes.CFUNCTYPE(*kinds, Pointer)(number) if number else None
        self._binary = ctypes.CFUNCTYPE(*kinds, ctypes.c_int, Pointer, Pointer)(binary) if binary else None

    def string(self, device: Any, name: int) -> str:
        return (self._string(device, name) or b"").decode(errors="replace")

    def number(self, device: Any, name: int) -> int | None:
        value = ctypes.c_ssize_t(0)
        return value.value if self._number and self._number(device, name, ctypes.byref(value)) else None

    def binary(self, device: Any, name: int) -> bytes:
        value, size = ctypes.create_string_buffer(16), ctypes.c_int(0)
        able = self._binary and self._binary(device, name, len(value), value, ctypes.byref(size))
        return value.raw[: size.value] if able else b""


def described(ask: Questions, device: Any) -> Device:
    extensions = ask.string(device, EXTENSIONS).split()
    file = ask.string(device, DRM_FILE) if "EGL_EXT_device_drm" in extensions else ""
    vendor, pci = _on_bus(file)
    names = [vendor, file]  # Mesa's EGL says no more
    if "EGL_EXT_device_query_name" in extensions:
        names = [ask.string(device, VENDOR), ask.string(device, RENDERER), file]
    software = "EGL_MESA_device_software" in extensions
    return Device(
        "software" if software else ", ".join(filter(None, names)) or "GPU",
        software,
        ask.number(device, CUDA_DEVICE) if "EGL_NV_device_cuda" in extensions else None,
        ask.binary(device, UUID).hex() if "EGL_EXT_device_persistent_id" in extensions else "",
        pci,
    )


def _on_bus(file: str) -> tuple[str, str]:
    """The vendor of the device with this file, /dev/dri/card0, and its place on the PCI bus; "" where Linux does not
    say."""
    folder = DRM_CLASS / Path(file).name / "device"
    try:
        vendor, place = (folder / "vendor").read_text().strip(), folder.resolve().name
    except OSError:
        return "", ""
    return VENDORS.get(vendor, ""), place


def _handles(egl: ctypes.CDLL) -> list[int | None]:
    place, count = egl.eglGetProcAddress(b"eglQueryDevicesEXT"), ctypes.c_int(0)
    if not place:
        raise EglError("no EGL_EXT_device_base")
    query = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, Pointer, Pointer)(place)
    query(0, None, ctypes.byref(count))
    handles = (Pointer * count.value)()
    query(count.value, handles, ctypes.byref(count))
    return list(handles[: count.value])


def _display(egl: ctypes.CDLL, device: int) -> Any:
    """The display of EGL's device of that number, initialised."""
    place, handles = egl.eglGetProcAddress(b"eglGetPlatformDisplayEXT"), _handles(egl)
    if not place:
        raise EglError("no EGL_EXT_platform_device")
    if device >= len(handles):
        raise EglError(f"there is no EGL device {device}; there are {len(handles)}")
    display_of = ctypes.CFUNCTYPE(Pointer, ctypes.c_uint, Pointer, Pointer)(place)
    display = display_of(PLATFORM_DEVICE, handles[device], None)
    if not display or not egl.eglInitialize(display, None, None):
        raise EglError(f"eglInitialize: {_error(egl)}")
    return Pointer(display)


def _list(values: list[int]) -> Any:
    return (ctypes.c_int * (len(values) + 1))(*values, NONE)


def _error(egl: ctypes.CDLL) -> str:
    return f"error 0x{egl.eglGetError():04x}"


@cache
def _reset_status(address: int) -> Any:
    return ctypes.CFUNCTYPE(ctypes.c_uint)(address)


def reset(context: EglContext) -> str | None:
    """Why the device was reset since the context was made, in words; None where it was not, or nobody can tell."""
    for name in ("glGetGraphicsResetStatus", "glGetGraphicsResetStatusARB"):
        if address := context.load_opengl_function(name):
            status = _reset_status(address)()
            return RESETS.get(status, f"status 0x{status:04x}") if status else None
    return None
