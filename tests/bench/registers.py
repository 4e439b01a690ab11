"""Registers, spills and size of the kernels of paths on an AMD GPU, without one.

Khronos' front end makes SPIR-V for Vulkan of a kernel's text, Mesa's RADV compiles that (`radv`). The kernels are
those of the built-in scenes, and of the shader ball in each material of the library.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gpu import RenderSettings
from gpu.kernels import features
from gpu.kernels.source import KernelSource
from service.bench.scenes import BenchAssets
from service.document import parse_scene, presets
from service.pack import pack
from tests.bench import radv

ENTRY = "pathtrace.comp"
FEWEST_WAVES = 6  # of a SIMD: with fewer there are too few to hide how long memory takes
# OpenGL counts storage buffers, uniform blocks and textures each from 0, Vulkan all together.
SHIFTS = ("--shift-ubo-binding", "32", "--shift-texture-binding", "64", "--shift-sampler-binding", "64")
VULKAN = ("-V", "--target-env", "vulkan1.2", "-S", "comp", "--amb", *SHIFTS)


class NotCompiled(Exception):
    """The front end refused a kernel."""


def texts(wanted: Sequence[str] = ()) -> Iterator[tuple[str, str]]:
    """Names and texts of the kernels, or of those of these names; of scenes that share one, the first."""
    seen: set[str] = set()
    for name, document in documents():
        if wanted and name not in wanted:
            continue
        arrays = pack(parse_scene(document), BenchAssets()).arrays
        defines = features.defines(features.flags(arrays), RenderSettings(8, 8), features.counts(arrays))
        text = KernelSource(ENTRY, defines).text
        if text not in seen:
            seen.add(text)
            yield name, text


def documents() -> Iterator[tuple[str, dict[str, Any]]]:
    for entry in presets.names("scenes"):
        yield entry["name"], presets.get("scenes", entry["name"])
    ball = presets.get("scenes", presets.DEFAULT_SCENE)
    for entry in presets.names("materials"):
        yield f"ball of {entry['name']}", presets.dressed(ball, presets.get("materials", entry["name"]))


def spirv(text: str, path: Path) -> None:
    """Write a kernel as Vulkan's SPIR-V. Raises NotCompiled with what the front end says.

    `sampler` is a word of Vulkan's. The front end (12.0) puts a global that is `precise` into the function that uses
    it first; for the count of registers it does not matter whether a sum is.
    """
    text = re.sub(r"\bsampler\b", "sampler_kind", text)
    text = re.sub(r"^precise (?=\w+ [\w, ]+;$)", "", text, flags=re.M)
    program = shutil.which("glslangValidator")
    if program is None:
        raise NotCompiled("glslangValidator is not installed (Debian: glslang-tools)")
    command = [program, "--stdin", *VULKAN, "-o", str(path)]
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    if done.returncode:
        raise NotCompiled(done.stdout[-2000:])


def measure(told: Callable[[str], None], wanted: Sequence[str]) -> list[dict[str, Any]]:
    """A row for each kernel, or for those of these names. Raises NotCompiled, radv.NoRadv."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "kernel.spv")
        for name, text in texts(wanted):
            spirv(text, path)
            rows.append({"name": name, **asdict(radv.statistics([path])[0])})
            told(f"{name}: {rows[-1]['vgprs']} registers, {rows[-1]['spilled']} spilled")
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown."""
    lines = ["| kernel | VGPRs | spilled (scratch, bytes) | waves a SIMD of 16 | code, KB |", "|---|---|---|---|---|"]
    for row in rows:
        spilled = f"{row['spilled']} ({row['scratch']})"
        lines.append(f"| {row['name']} | {row['vgprs']} | {spilled} | {row['waves']} | {row['code'] / 1024:.0f} |")
    return "\n".join(lines)
