"""A material model more is a row, a file of GLSL and a class: one is added to a copy of the source, and rendered."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
LAST = "from service.document.material.surface import AnySurface\n"
FIRST = '    Model("diffuse", 0, (Lobe.DIFFUSE,)),\n'
ROW = '    Model("matte", 7, (Lobe.DIFFUSE,)),\n'
CLASS = '''"""`matte`: `diffuse` by another name."""

from __future__ import annotations

from typing import Literal

from service.document.material.diffuse import DiffuseMaterial


class MatteMaterial(DiffuseMaterial):
    """Scatters equally in all directions."""

    type: Literal["matte"]
'''
RENDER = """
import json
import numpy as np
from gpu import Renderer, RenderSettings
from service.config import Config
from service.pack import pack
from service.server.requests.parsers import parse_conversion
from service.document import parse_scene

def scene(model):
    ask = {"material": {"type": "diffuse", "albedo": [0.8, 0.5, 0.1]}, "to": model}
    ball = {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "ball"}
    floor = {"type": "quad", "origin": [-5, 0, 5], "u": [10, 0, 0], "v": [0, 0, -10], "material": "floor"}
    return {
        "version": 1,
        "camera": {"position": [0, 2, 6], "target": [0, 1, 0]},
        "environment": {"type": "constant", "radiance": 0.5},
        "lights": [{"type": "point", "position": [2, 4, 3], "intensity": 60}],
        "materials": {
            "ball": parse_conversion(json.dumps(ask).encode()).material,
            "floor": {"type": "diffuse", "albedo": 0.5},
        },
        "shapes": [ball, floor],
    }

with Renderer() as renderer:
    for model in ("diffuse", "matte"):
        document = scene(model)
        assert document["materials"]["ball"]["type"] == model
        loaded = renderer.load(pack(parse_scene(document, "", Config()), None, limits=Config()).arrays)
        picture = renderer.picture(loaded, RenderSettings(32, 24, max_bounces=3))
        while picture.samples < 8:
            picture.trace(10.0, 8)
        np.save(model, picture.read())
"""


def test_a_model_more_is_a_row_a_shader_and_a_class(tmp_path: Path) -> None:
    for room in ("gpu", "service", "shaders"):
        shutil.copytree(ROOT / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    rows = tmp_path / "gpu/layout/models.py"
    rows.write_text(rows.read_text().replace(FIRST, FIRST + ROW))
    models = tmp_path / "shaders/bsdf/models"
    text = (models / "diffuse.glsl").read_text().replace("diffuse_", "matte_")
    (models / "matte.glsl").write_text(text.replace("\n\n", "\n\n#if HAS_MATTE\n", 1) + "#endif\n")
    union = tmp_path / "service/document/material/__init__.py"
    (union.parent / "matte.py").write_text(CLASS)
    given = union.read_text().replace("    | MicrofacetMaterial,", "    | MicrofacetMaterial\n    | MatteMaterial,")
    union.write_text(given.replace(LAST, LAST + "from service.document.material.matte import MatteMaterial\n"))
    subprocess.run([sys.executable, "-c", RENDER], cwd=tmp_path, check=True, timeout=600)
    known, new = (np.load(tmp_path / f"{model}.npy") for model in ("diffuse", "matte"))
    assert known.max() > 0.1
    np.testing.assert_array_equal(known, new)
