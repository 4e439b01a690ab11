"""Waits for a kernel that a helper compiles, so that other tasks go on meanwhile."""

from __future__ import annotations

from typing import TYPE_CHECKING

from service.worker.helpers.compile_client import CompileClient

if TYPE_CHECKING:
    from gpu import KernelKey


class KernelWait:
    """One kernel at a time. Without a compiler nothing is waited for: kernels are compiled where they are used."""

    def __init__(self, compiler: CompileClient | None, client: str = "") -> None:
        """Turns at the compiler go round the clients."""
        self.compiling = False
        self.compiler = compiler
        self._client = client
        self._compiled_ms = 0.0

    def begin(self, key: KernelKey) -> bool:
        """True if that kernel is now being compiled. Raises CompileError where that has failed."""
        self.compiling = False
        self.compiling = self.compiler is not None and self.compiler.queue(key, self._hear, self._client)
        return self.compiling

    def stop(self) -> None:
        """Wait no longer; the helper may still compile the kernel."""
        self.compiling = False

    def forget(self) -> None:
        """Wait no longer, and let the helper drop a kernel that nobody else waits for."""
        self.compiling = False
        if self.compiler is not None:
            self.compiler.forget(self._hear)

    def loaded(self, key: KernelKey) -> None:
        """The renderer has this kernel."""
        if self.compiler is not None:
            self.compiler.loaded(key)

    def take_ms(self) -> float:
        """Milliseconds that the last kernel took to compile elsewhere; 0 when asked again."""
        milliseconds, self._compiled_ms = self._compiled_ms, 0.0
        return milliseconds

    def _hear(self, milliseconds: float) -> None:
        self.compiling, self._compiled_ms = False, milliseconds
