"""Compiled kernels, which stay in memory while pictures use them and for a while after that.

Loading one from the driver's disk cache takes some milliseconds. On llvmpipe a kernel takes 7 MB, and clients that
may send documents can cause thousands of them, so the number of unused ones is bounded.
"""

from __future__ import annotations

import ctypes
import logging
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from gpu import context as contexts
from gpu.errors import CompileError
from gpu.kernels.binaries import ProgramBinaries
from gpu.kernels.source import SHADERS, KernelSource

log = logging.getLogger(__name__)

MOST = 16  # kernels that stay though no picture holds them: some resolve pictures, the others trace them
LONGEST_S = 600.0  # seconds without use after which a kernel that no picture holds is evicted

_Key = tuple[str, tuple[tuple[str, object], ...]]


@dataclass
class _Cached:
    kernel: Any
    used_at: float = 0.0  # by the monotonic clock
    holders: int = 0


class KernelCache:
    """Kernels by entry and defines. `last_compile_ms` is what the last call of `get` spent on compiling, 0 for
    none."""

    def __init__(
        self, context: Any, folders: Sequence[Path] = (SHADERS,), most: int = MOST, longest_s: float = LONGEST_S
    ) -> None:
        self._context = context
        self._folders = folders
        self._binaries = ProgramBinaries(context)
        self._most, self._longest_s = most, longest_s
        self._cache: dict[_Key, _Cached] = {}
        self.last_compile_ms = 0.0
        self.evicted = 0

    def __len__(self) -> int:
        return len(self._cache)

    def get(self, entry: str, defines: Mapping[str, object]) -> Any:
        """The kernel `entry` (a file of shaders/) with these defines. It is valid until the next call; after `hold`,
        until `let_go`. Raises CompileError naming file and line."""
        key = (entry, tuple(sorted(defines.items())))
        self.last_compile_ms = 0.0
        if key not in self._cache:
            kernel = self._compile(entry, defines)
            self._evict(len(self._free) + 1 - self._most)
            self._cache[key] = _Cached(kernel)
        cached = self._cache[key]
        cached.used_at = time.monotonic()
        return cached.kernel

    def hold(self, kernel: Any) -> None:
        """Protect the kernel from eviction, until as many calls of `let_go`."""
        self._of(kernel).holders += 1

    def let_go(self, kernel: Any) -> None:
        cached = self._of(kernel)
        cached.holders -= 1
        cached.used_at = time.monotonic()
        self._evict(len(self._free) - self._most)

    def tidy(self) -> float | None:
        """Evict kernels that have not been used for long. Returns the seconds until the next one is due, or None."""
        now = time.monotonic()
        old = sum(now - self._cache[key].used_at >= self._longest_s for key in self._free)
        if old:
            self._evict(old)
            _trim()
        ages = [now - self._cache[key].used_at for key in self._free]
        return max(0.0, self._longest_s - max(ages)) if ages else None

    @property
    def _free(self) -> list[_Key]:
        """The kernels that no picture holds, the longest unused first."""
        free = [key for key, cached in self._cache.items() if not cached.holders]
        return sorted(free, key=lambda key: self._cache[key].used_at)

    def _of(self, kernel: Any) -> _Cached:
        return next(cached for cached in self._cache.values() if cached.kernel is kernel)

    def _evict(self, count: int) -> None:
        for key in self._free[: max(0, count)]:
            contexts.use(self._context)
            self._cache.pop(key).kernel.release()
            self.evicted += 1

    def _compile(self, entry: str, defines: Mapping[str, object]) -> Any:
        source = KernelSource(entry, defines, self._folders)
        start = time.perf_counter()
        kernel: Any = self._binaries.load(entry, source.text)
        what = "compiled" if kernel is None else "loaded"
        if kernel is None:
            try:
                kernel = self._context.compute_shader(source.text)
            except Exception as error:  # moderngl.Error is not importable without its binary parts
                raise CompileError(f"{entry}: {source.explain(str(error))}") from error
            self._binaries.store(entry, source.text, kernel)
        self.last_compile_ms = (time.perf_counter() - start) * 1e3
        on = sorted(name[4:].lower() for name, value in defines.items() if name.startswith("HAS_") and value)
        key, flags = sha256(source.text.encode()).hexdigest()[:12], "+".join(on) or "none"
        log.info(f"{what} {entry}", {"key": key, "flags": flags, "ms": round(self.last_compile_ms)})
        return kernel

    def release(self) -> None:
        contexts.use(self._context)  # another one has programs of the same numbers
        for cached in self._cache.values():
            cached.kernel.release()
        self._cache.clear()


def _trim() -> None:
    """Return freed memory to the system: glibc would keep the many small pieces of 40 kernels, 300 MB, for itself."""
    with suppress(AttributeError, OSError):  # another C library
        ctypes.CDLL(None).malloc_trim(0)
