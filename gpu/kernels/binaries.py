"""Machine code of the costly kernels, kept on disk by us where the driver is a GPU's.

Mesa writes its own disk cache as soon as a kernel is linked, so that what one process compiled another one loads. Of
NVIDIA's driver (580, on an H200) it was seen only from processes that ended by themselves: what a compiler beside the
renderer makes would reach nobody. By glGetProgramBinary the code is there at once, and another process loads it in 6
to 18 ms, where linking takes 2 to 70 s.

Kernels without uniforms of their own are kept; all others compile in some hundredths of a second. A file that is cut
short or of another driver is compiled anew.
"""

from __future__ import annotations

import ctypes
import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from struct import Struct
from typing import Any

from gpu import context as contexts

log = logging.getLogger(__name__)

ENTRIES = frozenset({"pathtrace.comp", "lighttrace.comp", "guides.comp", "cover.comp"})
MOST_BYTES = 512 << 20  # of all files; a kernel takes 0.1 to 0.3 MB
LINK_STATUS, BINARY_LENGTH, BINARY_FORMATS = 0x8B82, 0x8741, 0x87FE  # GL_PROGRAM_BINARY_LENGTH, GL_NUM_..._FORMATS
_HEAD = Struct("<8s32sI")  # a mark, the code's hash, its format
_MARK = b"sunbox 1"


def cache_folder() -> Path:
    """The folder for what is kept of kernels, beside the driver's own cache."""
    base = os.environ.get("MESA_SHADER_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "sunbox"


def binary_file(info: Mapping[str, Any], text: str) -> Path:
    """Where the code of the kernel with this text is kept, for the driver that `info` (`Renderer.info`) names."""
    name = sha256(repr((info["renderer"], info["version"], text)).encode()).hexdigest()[:32]
    return cache_folder() / "programs" / name


class Program:
    """A kernel that was loaded: the part of moderngl's ComputeShader that those of ENTRIES need."""

    def __init__(self, library: ctypes.CDLL, glo: int) -> None:
        self._library, self.glo = library, glo

    def run(self, x: int = 1, y: int = 1, z: int = 1) -> None:
        self._library.glUseProgram(self.glo)
        self._library.glDispatchCompute(x, y, z)

    def release(self) -> None:
        self._library.glDeleteProgram(self.glo)


class ProgramBinaries:
    """The files, for one context, which must be the current one at each call."""

    def __init__(self, context: Any) -> None:
        self._info = contexts.describe(context)
        self._library = ctypes.CDLL(contexts.opengl_library())
        self._able = not self._info["software"] and self._integer(BINARY_FORMATS) > 0

    @property
    def able(self) -> bool:
        """True if kernels are kept: not where the processor is the device, whose driver does it well itself."""
        return self._able

    def has(self, text: str) -> bool:
        return self._able and binary_file(self._info, text).exists()

    def load(self, entry: str, text: str) -> Program | None:
        """The kernel, or None where it is not kept, or the driver does not take it."""
        if not self._able or entry not in ENTRIES:
            return None
        file = binary_file(self._info, text)
        try:
            data = file.read_bytes()
        except OSError:
            return None
        code = data[_HEAD.size :]
        if len(data) > _HEAD.size and data[: _HEAD.size] == _head(code, form := _HEAD.unpack_from(data)[2]):
            glo = self._library.glCreateProgram()
            self._library.glProgramBinary(glo, form, code, len(code))
            if self._linked(glo):
                with suppress(OSError):
                    os.utime(file)
                return Program(self._library, glo)
            self._library.glDeleteProgram(glo)
        with suppress(OSError):  # of a folder that others may only read
            file.unlink()
        return None

    def store(self, entry: str, text: str, kernel: Any) -> bool:
        """Keep a compiled kernel; whether it is kept now."""
        if not self._able or entry not in ENTRIES:
            return False
        length = self._integer(BINARY_LENGTH, kernel.glo)
        code, form, got = ctypes.create_string_buffer(max(1, length)), ctypes.c_uint(0), ctypes.c_int(0)
        self._library.glGetProgramBinary(kernel.glo, length, ctypes.byref(got), ctypes.byref(form), code)
        if got.value <= 0:
            return False
        data, file = code.raw[: got.value], binary_file(self._info, text)
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            part = file.with_name(f"{file.name}.{os.getpid()}")
            part.write_bytes(_head(data, form.value) + data)
            part.replace(file)
            _prune(file.parent)
        except OSError as error:
            log.info("could not keep a compiled kernel", {"error": error})
            return False
        return True

    def _linked(self, glo: int) -> bool:
        return self._integer(LINK_STATUS, glo) == 1

    def _integer(self, name: int, glo: int | None = None) -> int:
        value = ctypes.c_int(0)
        if glo is None:
            self._library.glGetIntegerv(name, ctypes.byref(value))
        else:
            self._library.glGetProgramiv(glo, name, ctypes.byref(value))
        return value.value


def _head(code: bytes, form: int) -> bytes:
    return _HEAD.pack(_MARK, sha256(code).digest(), form)


def _prune(folder: Path, most: int = MOST_BYTES) -> None:
    """Delete what was not used for longest, down to half, where there is too much."""
    with suppress(OSError):  # another renderer prunes as well
        found = [(stat.st_mtime, stat.st_size, path) for path in folder.iterdir() if (stat := path.stat())]
        left = sum(size for _, size, _ in found)
        if left <= most:
            return
        for _, size, path in sorted(found):
            if left <= most // 2:
                return
            path.unlink(missing_ok=True)
            left -= size
