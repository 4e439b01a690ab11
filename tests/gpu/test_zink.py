"""Kernels that go through SPIR-V: Mesa's zink over lavapipe, Vulkan on the processor, renders what llvmpipe does.

GLSL that a GPU's driver refuses or reads otherwise, as in the layout of blocks, is found here without a GPU.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from service.document import presets

ROOT = Path(__file__).parents[2]
FOLDERS = ("/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d")
# Of the loops over a few quads and boxes, of the tree over a thousand spheres in an image's light, and of a mesh.
SCENES = ("cornell-boxes", "sphere-field", "shader-ball")
REST = sorted({entry["name"] for entry in presets.names("scenes")} - {*SCENES})
SIZE, SAMPLES = 32, 4
PATIENCE_S = 300.0  # zink compiles a kernel in twice the time of llvmpipe, which on two busy cores is much
SCRIPT = """
import sys

import numpy as np

from gpu import Renderer, RenderSettings, software_device
from service.document import presets
from service.bench.scenes import BenchAssets
from service.pack import pack
from service.document import parse_scene

out, size, samples, *names = sys.argv[1:]
with Renderer(software_device()) as renderer:
    found = {"renderer": np.array(renderer.info["renderer"])}
    for name in names:
        scene = renderer.load(pack(parse_scene(presets.get("scenes", name)), BenchAssets()).arrays)
        picture = renderer.picture(scene, RenderSettings(int(size), int(size)))
        while picture.samples < int(samples):
            picture.trace(1.0, int(samples))
        found[name] = picture.read()
np.savez(out, **found)
"""


def lavapipe() -> Path | None:
    """The file by which Vulkan's loader finds lavapipe: that which VK_DRIVER_FILES names, or an installed one."""
    named = [Path(name) for name in os.environ.get("VK_DRIVER_FILES", "").split(":") if name]
    installed = [path for folder in FOLDERS for path in sorted(Path(folder).glob("lvp_icd*.json"))]
    return next((path for path in (*named, *installed) if path.name.startswith("lvp_icd") and path.exists()), None)


def rendered(out: Path, driver: str, scenes: Sequence[str], **variables: str) -> dict[str, np.ndarray]:
    """The scenes by a Gallium driver, and the `renderer` that it calls itself."""
    environment = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "GALLIUM_DRIVER": driver, **variables}
    command = [sys.executable, "-c", SCRIPT, str(out), str(SIZE), str(SAMPLES), *scenes]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr[-2000:]
    return dict(np.load(out))


@pytest.mark.parametrize(
    "scenes", [SCENES, *(pytest.param([name], marks=pytest.mark.slow) for name in REST)], ids=" ".join
)
def test_vulkan_renders_the_same(tmp_path: Path, scenes: Sequence[str]) -> None:
    driver = lavapipe()
    if driver is None:
        pytest.skip("lavapipe is not installed: on Debian `apt-get install mesa-vulkan-drivers`, of Mesa's version")
    ours = rendered(tmp_path / "llvmpipe.npz", "llvmpipe", scenes)
    vulkan = rendered(tmp_path / "zink.npz", "zink", scenes, VK_DRIVER_FILES=str(driver))
    assert str(ours["renderer"]).startswith("llvmpipe") and str(vulkan["renderer"]).startswith("zink")
    for name in scenes:
        mean = float(ours[name].mean())
        assert mean > 0.1 and ours[name].std() > 0.1
        np.testing.assert_allclose(vulkan[name], ours[name], rtol=1e-5, atol=1e-5 * mean, err_msg=name)
