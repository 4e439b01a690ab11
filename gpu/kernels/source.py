"""Shader text with its includes and flags, and the driver's errors by file and line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from gpu.errors import CompileError
from gpu.kernels import layout_glsl, models_glsl

SHADERS = Path(__file__).resolve().parents[2] / "shaders"
# Files that exist only in memory.
_GENERATED = {
    "layout.glsl": layout_glsl.text,
    "layout_constants.glsl": layout_glsl.constants,
    "models.glsl": models_glsl.text,
    "model_members.glsl": models_glsl.members,
}
# NVIDIA's compiler takes three times as long where it unrolls the loops itself, for kernels that are no faster (an
# H200, driver 580: the shader ball 7.4 s instead of 24, its glass 16 instead of 47). Others pass over the line.
_FOR_DRIVERS = ("#pragma optionNV(unroll none)",)
# There kernels that have the BSDF's code once trace 1.3 times as fast: they need fewer registers and instructions.
_SHADE_ONCE = ("#ifdef GL_NV_gpu_shader5", "#undef SHADE_ONCE", "#define SHADE_ONCE 1", "#endif")
_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_CONDITION = re.compile(r"^\s*#\s*(?:el)?if\b(.*)")
_WORD = re.compile(r"[A-Za-z_]\w*")
_WHERE = re.compile(r"(\d+)[:(](\d+)")


def _read(name: str, folders: Sequence[Path]) -> str:
    if name in _GENERATED:
        return _GENERATED[name]() + "\n"
    for folder in folders:
        if (folder / name).is_file():
            return (folder / name).read_text()
    raise CompileError(f"{name}: no such shader file")


@dataclass(frozen=True)
class _Assembled:
    """An entry with every include in place once, the files that its lines came from, and the names that are asked for
    in #if, each with the file and the line of the first time."""

    text: str
    files: tuple[str, ...]
    asked: Mapping[str, tuple[str, int]]


class _Assembly:
    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders = folders
        self._files: list[str] = []
        self._asked: dict[str, tuple[str, int]] = {}

    def make(self, entry: str) -> _Assembled:
        return _Assembled("\n".join(self._expand(entry)) + "\n", tuple(self._files), self._asked)

    def _expand(self, name: str) -> list[str]:
        number = len(self._files)
        self._files.append(name)
        out = [f"#line 1 {number}"]
        depth = 0
        for at, line in enumerate(_read(name, self._folders).splitlines(), 1):
            if "#" not in line:
                out.append(line.split("//")[0])  # llvmpipe reads a kernel in 6 % less time without comments
                continue
            include, condition = _INCLUDE.match(line), _CONDITION.match(line)
            if condition:
                for word in _WORD.findall(condition.group(1).split("//")[0]):
                    self._asked.setdefault(word, (name, at))
                depth += line.lstrip().startswith("#if")
            elif line.lstrip().startswith("#endif"):
                depth -= 1
            if include is None:
                out.append(line.split("//")[0])
            elif depth:
                raise CompileError(f"{name}:{at}: an include inside #if may be the one that is skipped")
            elif include.group(1) not in self._files:
                out += self._expand(include.group(1))
                out.append(f"#line {at + 1} {number}")
        return out


@cache
def _packaged(entry: str) -> _Assembled:
    """The entry as this package has it. To assemble it takes 6 ms, and the key of every kernel is its text."""
    return _Assembly((SHADERS,)).make(entry)


class KernelSource:
    """One kernel's text, with every include in place once, and the names of the files its lines came from."""

    def __init__(self, entry: str, defines: Mapping[str, object], folders: Sequence[Path] = (SHADERS,)) -> None:
        assembled = _packaged(entry) if tuple(folders) == (SHADERS,) else _Assembly(folders).make(entry)
        for word in assembled.asked.keys() - defines.keys():  # Mesa takes such a name for 0 without a warning
            name, at = assembled.asked[word]
            raise CompileError(f"{name}:{at}: #if asks for {word}, which nothing defines")
        self.files = assembled.files
        head = ["#version 430", *_FOR_DRIVERS, *(f"#define {name} {value}" for name, value in defines.items())]
        if "SHADE_ONCE" in defines:
            head += _SHADE_ONCE
        self.text = "\n".join(head) + "\n" + assembled.text

    def explain(self, message: str) -> str:
        """The driver's message with file names in place of its source numbers."""

        def named(match: re.Match[str]) -> str:
            number = int(match.group(1))
            file = self.files[number] if number < len(self.files) else str(number)
            return f"{file}:{match.group(2)}"

        return "\n".join(_WHERE.sub(named, line, count=1) for line in message.splitlines() if line.strip())
