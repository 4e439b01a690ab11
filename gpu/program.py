"""Shader text: includes, flags, errors by file and line, and a cache of compiled kernels."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gpu import glsl
from gpu.errors import CompileError

log = logging.getLogger(__name__)

SHADERS = Path(__file__).resolve().parent.parent / "shaders"
_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_CONDITION = re.compile(r"^\s*#\s*(?:el)?if\b(.*)")
_WORD = re.compile(r"[A-Za-z_]\w*")
_WHERE = re.compile(r"(\d+)[:(](\d+)")


def _read(name: str, folders: Sequence[Path]) -> str:
    if name == "layout.glsl":
        return glsl.text()
    for folder in folders:
        if (folder / name).is_file():
            return (folder / name).read_text()
    raise CompileError(f"{name}: no such shader file")


class Source:
    """One kernel's text, with every include in place once, and the names of the files its lines came from."""

    def __init__(self, entry: str, defines: Mapping[str, object], folders: Sequence[Path] = (SHADERS,)) -> None:
        self.files: list[str] = []
        self._folders = folders
        self._defines = defines
        head = ["#version 430"] + [f"#define {name} {value}" for name, value in defines.items()]
        self.text = "\n".join(head + self._expand(entry)) + "\n"

    def _expand(self, name: str) -> list[str]:
        number = len(self.files)
        self.files.append(name)
        out = [f"#line 1 {number}"]
        depth = 0
        for at, line in enumerate(_read(name, self._folders).splitlines(), 1):
            include, condition = _INCLUDE.match(line), _CONDITION.match(line)
            if condition:
                self._check(condition.group(1), name, at)
                depth += line.lstrip().startswith("#if")
            elif line.lstrip().startswith("#endif"):
                depth -= 1
            if include is None:
                out.append(line)
            elif depth:
                raise CompileError(f"{name}:{at}: an include inside #if may be the one that is skipped")
            elif include.group(1) not in self.files:
                out += self._expand(include.group(1))
                out.append(f"#line {at + 1} {number}")
        return out

    def _check(self, condition: str, name: str, at: int) -> None:
        # Mesa reads an unknown name in #if as 0 and says nothing.
        for word in _WORD.findall(condition.split("//")[0]):
            if word not in self._defines:
                raise CompileError(f"{name}:{at}: #if asks for {word}, which nothing defines")

    def explain(self, message: str) -> str:
        """The driver's message with file names for its source numbers."""

        def named(match: re.Match[str]) -> str:
            number = int(match.group(1))
            file = self.files[number] if number < len(self.files) else str(number)
            return f"{file}:{match.group(2)}"

        return "\n".join(_WHERE.sub(named, line, count=1) for line in message.splitlines() if line.strip())


class Kernels:
    """Compiled kernels by entry and defines; `compile_ms` of the last one is in `last_compile_ms`."""

    def __init__(self, context: Any, folders: Sequence[Path] = (SHADERS,)) -> None:
        self._context = context
        self._folders = folders
        self._cache: dict[tuple[str, tuple[tuple[str, object], ...]], Any] = {}
        self.last_compile_ms = 0.0

    def get(self, entry: str, defines: Mapping[str, object]) -> Any:
        """The kernel `entry` (a file of shaders/) with these defines. Raises CompileError naming file and line."""
        key = (entry, tuple(sorted(defines.items())))
        self.last_compile_ms = 0.0
        if key not in self._cache:
            self._cache[key] = self._compile(entry, defines)
        return self._cache[key]

    def _compile(self, entry: str, defines: Mapping[str, object]) -> Any:
        source = Source(entry, defines, self._folders)
        start = time.perf_counter()
        try:
            kernel = self._context.compute_shader(source.text)
        except Exception as error:  # moderngl.Error is not importable without its binary parts
            raise CompileError(f"{entry}: {source.explain(str(error))}") from error
        self.last_compile_ms = (time.perf_counter() - start) * 1e3
        on = sorted(name[4:].lower() for name, value in defines.items() if name.startswith("HAS_") and value)
        log.info("compiled %s flags=%s ms=%.0f", entry, "+".join(on) or "none", self.last_compile_ms)
        return kernel

    def release(self) -> None:
        for kernel in self._cache.values():
            kernel.release()
        self._cache.clear()
