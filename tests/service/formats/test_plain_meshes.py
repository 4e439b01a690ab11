"""PLY, STL and OBJ files as scenes: on the command line and over REST, framed like every other model."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.cli.program import main
from service.formats.read.scenes.framing import framed
from tests import asset_files as make
from tests.serving import Server

LOW, HIGH = np.array([2.0, 0.0, -1.0]), np.array([4.0, 1.0, 1.0])
SMALL = ["--set", "width=24", "--set", "height=24", "--spp", "2", "--set", "max_bounces=2"]


def box() -> tuple[np.ndarray, np.ndarray]:
    """Corners (8, 3) and triangles (12, 3), outwards."""
    corners = np.stack(np.meshgrid(*zip(LOW, HIGH, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners, np.array([[q[0], *q[k : k + 2]] for q in quads for k in (1, 2)])


def written(ending: str) -> bytes:
    corners, faces = box()
    if ending == "ply":
        return make.ply(corners.astype(np.float32), faces.tolist())
    if ending == "stl":
        return make.stl(corners[faces])
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    return "\n".join(lines).encode() + b"\n"


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))


@pytest.mark.parametrize("ending", ["ply", "stl", "obj"])
def test_import(ending: str, tmp_path: Path) -> None:
    model, document = tmp_path / f"box.{ending}", tmp_path / "box.json"
    model.write_bytes(written(ending))
    assert main(["import", str(model), "-o", str(document)]) == 0
    scene = json.loads(document.read_text())
    assert scene["camera"] == framed((LOW, HIGH))
    assert scene["environment"]["type"] == "image" and len(scene["shapes"]) == 1
    assert (tmp_path / scene["shapes"][0]["asset"]).is_file()


@pytest.mark.parametrize("ending", ["ply", "stl"])
def test_render(gpu: Any, ending: str, tmp_path: Path) -> None:
    model, picture = tmp_path / f"box.{ending}", tmp_path / "box.png"
    model.write_bytes(written(ending))
    assert main(["render", str(model), "-o", str(picture), *SMALL]) == 0
    pixels = np.asarray(Image.open(picture).convert("L"))
    assert pixels.std() > 5


def test_what_the_import_said_is_not_said_again(gpu: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    corners, faces = box()
    model = tmp_path / "box.ply"
    colors = {"rgb": np.full((8, 3), 2.0)}
    model.write_bytes(make.ply(corners.astype(np.float32), faces.tolist(), "<", colors, "float"))
    assert main(["render", str(model), "-o", str(tmp_path / "box.png"), *SMALL]) == 0
    assert capsys.readouterr().err.count("were clamped") == 1


@pytest.mark.parametrize("ending", ["ply", "stl"])
def test_a_broken_file_is_refused_by_its_format(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / f"box.{ending}"
    model.write_bytes(written(ending)[:100])
    assert main(["import", str(model), "-o", str(tmp_path / "box.json")]) == 2
    told = capsys.readouterr().err
    assert f"the {ending.upper()} file" in told and "JSON" not in told


def test_an_obj_is_not_called_a_zip(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its files go to the importer as a zip, of which the owner knows nothing."""
    model = tmp_path / "box.obj"
    model.write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 nonsense\nf 1 2 3\n")
    assert main(["import", str(model), "-o", str(tmp_path / "box.json")]) == 2
    told = capsys.readouterr().err
    assert "the OBJ file" in told and "line 3" in told and "zip" not in told.lower()


@pytest.mark.parametrize("ending", ["ply", "stl", "obj"])
def test_over_rest(server: Server, ending: str) -> None:
    id = server.http.post(f"/v1/assets?filename=box.{ending}", content=written(ending)).json()["id"]
    answer = server.http.get(f"/v1/assets/{id}/scene")
    assert answer.status_code == 200, answer.text
    scene = answer.json()
    assert scene["camera"] == framed((LOW, HIGH))
    assert scene["shapes"] == [{"type": "mesh", "asset": id, "material": "default"}]
    assert scene["environment"]["type"] == "image"


def test_an_image_is_no_scene(server: Server) -> None:
    id = server.http.post("/v1/assets", content=make.png(np.zeros((2, 2, 3), np.uint8))).json()["id"]
    answer = server.http.get(f"/v1/assets/{id}/scene")
    assert answer.status_code == 404 and "is an image" in answer.json()["detail"]
