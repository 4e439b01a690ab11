"""Another compiler than the driver's reads every kernel: Khronos' reference front end takes what the specification
allows, where Mesa takes more. No kernel is compiled for a device."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator

import pytest

from gpu import RenderSettings
from gpu.kernels import features
from gpu.kernels.source import KernelSource
from gpu.precompile.kernel_keys import common_keys
from service.document import parse_scene
from service.pack import pack
from tests.gpu.flag_scenes import IMAGES, SCENES
from tests.marks import seldom

PROGRAM = shutil.which("glslangValidator")
ENTRIES = ("pathtrace.comp", "lighttrace.comp", "guides.comp", "cover.comp")
OFTEN = {
    "TRIANGLES", "FILM", "METAL_FILM", "DISPERSION", "MEDIA", "LIGHT_TREE", "HEIGHTS", "OPENPBR_LOBES",
    "MEASURED_ADAPTIVE",
}  # fmt: skip

pytestmark = pytest.mark.skipif(
    PROGRAM is None and not os.environ.get("CI"), reason="glslangValidator is not installed (Debian: glslang-tools)"
)


def said(text: str) -> list[str]:
    """What the compiler says of a kernel; warnings, too."""
    assert PROGRAM is not None
    done = subprocess.run([PROGRAM, "--stdin", "-S", "comp"], input=text, capture_output=True, text=True)
    return [line for line in done.stdout.splitlines() if line.strip() and line != "stdin"]


def kernels(raised: frozenset[str], shapes: dict[str, object] | None = None) -> Iterator[str]:
    for entry in ENTRIES:
        yield KernelSource(entry, features.defines(raised, RenderSettings(8, 8), shapes)).text


def test_it_finds_what_mesa_lets_pass() -> None:
    """A test that cannot fail holds nothing: a name hidden by a macro, a number that is no constant."""
    assert said("#version 430\nlayout(local_size_x = 1) in;\nvoid main() { float x = 1; int y = x; }")


@pytest.mark.parametrize("raised", [frozenset(), features.everything()], ids=["nothing", "everything"])
def test_kernels_of_all_flags_and_of_none(raised: frozenset[str]) -> None:
    assert [said(text) for text in kernels(raised)] == [[]] * len(ENTRIES)


def test_kernels_that_every_scene_needs() -> None:
    assert {key.entry: lines for key in common_keys() if (lines := said(key.text))} == {}


@pytest.mark.parametrize("name", seldom(SCENES, SCENES.keys() - OFTEN))
def test_kernels_of_a_scene_of_each_flag(name: str) -> None:
    arrays = pack(parse_scene(SCENES[name]), IMAGES).arrays
    assert [said(text) for text in kernels(features.flags(arrays), features.counts(arrays))] == [[]] * len(ENTRIES)
