"""Kernels keep within the registers of a GPU, as far as a compiler for one says without it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from gpu import RenderSettings
from gpu.kernels import features
from gpu.kernels.source import KernelSource
from tests.bench import radv, registers
from tests.bench.__main__ import main

pytestmark = pytest.mark.skipif(
    radv.driver() is None or shutil.which("glslangValidator") is None,
    reason="RADV or glslangValidator is not installed (Debian: mesa-vulkan-drivers libvulkan1 glslang-tools)",
)


def compiled(text: str, folder: Path) -> radv.Statistics:
    registers.spirv(text, folder / "kernel.spv")
    return radv.statistics([folder / "kernel.spv"])[0]


def test_a_kernel_of_too_many_numbers_is_seen(tmp_path: Path) -> None:
    """A test that cannot fail holds nothing: 300 numbers that are all alive at once."""
    names = [f"x{i}" for i in range(300)]
    read = "\n".join(f"float {name} = data[gl_GlobalInvocationID.x + {i}u];" for i, name in enumerate(names))
    write = "\n".join(
        f"data[gl_GlobalInvocationID.x * {i + 2}u] = {name} * {other};"
        for i, (name, other) in enumerate(zip(names, reversed(names), strict=True))
    )
    text = "#version 430\nlayout(local_size_x = 64) in;\nlayout(std430, binding = 0) buffer b { float data[]; };\n"
    found = compiled(f"{text}void main() {{\n{read}\nmemoryBarrier(); barrier();\n{write}\n}}", tmp_path)
    assert found.spilled > 0 < found.scratch and found.waves <= 4


def test_a_kernel_without_anything_has_room(tmp_path: Path) -> None:
    text = KernelSource(registers.ENTRY, features.defines(frozenset(), RenderSettings(8, 8))).text
    found = compiled(text, tmp_path)
    assert found.spilled == found.scratch == 0 and found.waves >= 8 and found.vgprs <= 128


def test_what_vulkan_does_not_take_is_told(tmp_path: Path) -> None:
    with pytest.raises(registers.NotCompiled, match="nothing"):
        registers.spirv("#version 430\nvoid main() { nothing(); }", tmp_path / "kernel.spv")


def test_the_command_has_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["registers", "cornell-empty"]) == 0
    assert "| cornell-empty |" in capsys.readouterr().out
    assert main(["registers", "nothing"]) == 2
    assert "is not one of" in capsys.readouterr().err


@pytest.mark.bench
def test_no_kernel_spills() -> None:
    """Of the library's materials and of the built-in scenes: some 60 kernels, two minutes."""
    rows = registers.measure(lambda line: None, [])
    assert len(rows) > 50
    assert [row for row in rows if row["spilled"] or row["waves"] < registers.FEWEST_WAVES] == []
