"""A shape, a light or a camera more is a row and a file in each room that must know it: other code that needs to know
the kind of a thing asks its row. These lists are the files whose code names one of each; they shall not grow."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("service", "gpu", "shaders", "web", "client/src")
# Readers know what other programs' files hold, presets and the agents' guide what a scene looks like; the other two
# are generated.
LEFT_OUT = (
    "service/formats/", "service/document/presets/", "client/src/sunbox/agent_", "client/src/sunbox/document.py",
    "client/src/sunbox/widget/",
)  # fmt: skip

SHAPE = """
gpu/kernels/flag_table.py gpu/kernels/light_kinds.py gpu/layout/records.py
service/document/shape.py service/exports/gltf/tessellated.py
service/pack/geometry/shape_kinds.py service/pack/lights/light_kinds.py
shaders/lights/cylinder.glsl shaders/lights/lights.glsl
shaders/shapes/box.glsl shaders/shapes/cylinder.glsl shaders/shapes/shapes.glsl
web/document/kinds.js web/document/shapes.js
"""
LIGHT = """
gpu/kernels/flag_table.py gpu/kernels/light_kinds.py gpu/layout/records.py
service/document/light.py service/exports/gltf/placing.py service/pack/lights/light_kinds.py
shaders/lights/lights.glsl shaders/lights/spot.glsl
web/document/kinds.js web/document/lights.js
"""
CAMERA = """
gpu/kernels/flag_table.py gpu/layout/records.py
service/document/camera.py service/pack/camera_kinds.py
shaders/camera/camera.glsl shaders/camera/camera_link.glsl shaders/camera/panorama.glsl
web/document/camera.js
"""
KINDS = {
    "cylinder": (r"(?i)cylinder", SHAPE),
    "spot": (r"SPOT|SpotLight|spot_light|[\"'/]spot[\"'.]|\bspot:", LIGHT),  # other things are called a spot, too
    "panorama": (r"PANORAMA|Panorama|panorama_|\"panorama\"|camera/panorama|\bpanorama:", CAMERA),
}


def _code(path: Path) -> str:
    """The text without what is said about it."""
    text = path.read_text()
    if path.suffix != ".py":
        return re.sub(r"//.*", "", text)
    tree = ast.parse(text)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if (
            isinstance(body, list)
            and body
            and isinstance(body[0], ast.Expr)
            and isinstance(body[0].value, ast.Constant)
        ):
            body[0].value = ast.Constant(None)
    return ast.unparse(tree)


@pytest.mark.parametrize("name", KINDS)
def test_few_files_name_a_kind(name: str) -> None:
    pattern, expected = KINDS[name]
    found = set[str]()
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*")):
            place = str(path.relative_to(ROOT))
            is_ours = path.suffix in (".py", ".js", ".glsl", ".comp") and not place.startswith(LEFT_OUT)
            if is_ours and re.search(pattern, path.read_text()) and re.search(pattern, _code(path)):
                found.add(place)
    assert found == set(expected.split())


def test_readers_of_code_see_names_alone(tmp_path: Path) -> None:
    python, shader = tmp_path / "a.py", tmp_path / "a.glsl"
    python.write_text(
        '"""A cylinder."""\n\n\ndef f() -> str:\n    """Of cylinders."""\n    return "tube"  # a cylinder\n'
    )
    shader.write_text("float a; // of a cylinder\n")
    assert "cylinder" not in _code(python) + _code(shader)
    python.write_text("class CylinderShape: ...\n")
    assert "Cylinder" in _code(python)
