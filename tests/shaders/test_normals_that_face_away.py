"""What is done with shading normals that face away from the viewer. Ours are bent until they are just in view; other
renderers, Mitsuba among them, take such points as black, and shade smooth meshes darker by that."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.kernels.source import SHADERS
from service.document import parse_scene
from service.pack import pack
from tests.rays import ball_mesh
from tests.rendering import Images, document

FILE = "path/interaction.glsl"
LINE = "    here.transmits = material_transmits(m);\n"
BLACK = "    if (dot(here.behind ? -path.at.ns : path.at.ns, wo_w) <= 0.0) path.throughput = vec3(0.0);\n"
SETTINGS = RenderSettings(48, 48, max_bounces=7, filter="box", seed=1)


def _mean(arrays: Any, *folders: Path) -> np.ndarray:
    with Renderer(shaders=folders) as renderer:
        picture = renderer.picture(renderer.load(arrays), SETTINGS)
        picture.trace(600.0, 16)
        return picture.read()[..., :3].astype(float)


@pytest.fixture
def blackened(tmp_path: Path) -> Path:
    """A folder with the shader that ends paths at normals which face away."""
    text = (SHADERS / FILE).read_text()
    assert text.count(LINE) == 1
    (tmp_path / FILE).parent.mkdir()
    (tmp_path / FILE).write_text(text.replace(LINE, BLACK + LINE))
    return tmp_path


@pytest.mark.usefixtures("gpu")  # skips where there is none
def test_flat_meshes_have_no_such_normals(blackened: Path) -> None:
    """The same picture to the bit; with smooth normals what would be black is at most a hundredth of the light."""
    floor = {"type": "quad", "origin": [-4, -1, 4], "u": [8, 0, 0], "v": [0, 0, -8], "material": "m"}
    sky = {"type": "constant", "radiance": 0.8}
    means = {}
    for smooth in (False, True):
        ball = {**ball_mesh(2), "smooth": smooth, "material": "m"}
        arrays = pack(parse_scene(document([ball, floor], environment=sky)), Images()).arrays
        ours, theirs = _mean(arrays, SHADERS), _mean(arrays, blackened, SHADERS)
        assert (ours == theirs).all() or smooth
        means[smooth] = theirs.mean() / ours.mean()
    assert means[False] == 1 and 0.99 < means[True] < 1
