"""The ways that an OBJ with materials comes in: over REST as a zip, to `sunbox render` and `import` by its path."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.cli.program import main
from tests.asset_files import png
from tests.obj_files import QUAD, zipped
from tests.serving import Server

SMALL = ["--set", "width=24", "--set", "height=24", "--spp", "4", "--tone-map", "linear"]
GREEN = png(np.full((4, 4, 3), (0, 255, 0), np.uint8))
GLOWING = "newmtl m\nKd 0 0 0\nmap_Ke {}\n"
MODEL = QUAD + "mtllib parts/m.mtl\nusemtl m\nf 1/1 2/2 3/3 4/4\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A model whose library lies in a folder of its own, and its texture beside that."""
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    own = tmp_path / "own"
    (own / "parts" / "images").mkdir(parents=True)
    (own / "m.obj").write_text(MODEL)
    (own / "parts" / "m.mtl").write_text(GLOWING.format("images\\green.png"))
    (own / "parts" / "images" / "green.png").write_bytes(GREEN)
    return own


def is_green(picture: Path) -> bool:
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    green = (pixels[..., 1] > 250) & (pixels[..., [0, 2]].max(axis=2) < 5)
    return bool(0.1 < green.mean() < 0.9)


def test_over_rest(server: Server) -> None:
    files = {"m.obj": MODEL, "parts/m.mtl": GLOWING.format("green.png") + "disp d.png\n", "parts/green.png": GREEN}
    answer = server.http.post("/v1/assets", content=zipped(files))
    assert answer.status_code == 201, answer.text
    info = answer.json()
    assert (info["kind"], info["format"], info["triangles"]) == ("scene", "zip", 2)
    assert [warning["pointer"] for warning in info["warnings"]] == ["m.mtl:4"]
    document = server.http.get(f"/v1/assets/{info['id']}/scene").json()
    assert document["environment"]["type"] == "image" and len(document["textures"]) == 1
    settings = {"width": 16, "height": 16, "max_samples": 1}
    rendered = server.http.post("/v1/render?format=npy", json={"scene": document, "settings": settings})
    assert rendered.status_code == 200, rendered.text


def test_a_bad_zip_over_rest(server: Server) -> None:
    answer = server.http.post("/v1/assets", content=zipped({"../m.obj": MODEL}))
    assert answer.status_code == 422 and "leads out of its folder" in answer.json()["detail"]


def test_render(gpu: Any, folder: Path, tmp_path: Path) -> None:
    """The model, then the picture's own metadata, give the same picture."""
    first, again = tmp_path / "a.png", tmp_path / "b.png"
    assert main(["render", str(folder / "m.obj"), "-o", str(first), *SMALL]) == 0
    assert is_green(first)
    assert main(["render", str(first), "-o", str(again)]) == 0
    assert np.array_equal(np.asarray(Image.open(first)), np.asarray(Image.open(again)))


def test_import(gpu: Any, folder: Path, tmp_path: Path) -> None:
    """A document that stands on its own feet: nothing in the data folder."""
    document, picture = tmp_path / "s.json", tmp_path / "a.png"
    assert main(["import", str(folder / "m.obj"), "-o", str(document)]) == 0
    references = [one["asset"] for one in json.loads(document.read_text())["shapes"]]
    assert all(reference.startswith("s.assets/") for reference in references)
    assert main(["render", str(document), "-o", str(picture), *SMALL]) == 0
    assert is_green(picture)


def test_the_line_ends_of_old(folder: Path, tmp_path: Path) -> None:
    (folder / "m.obj").write_text(MODEL.replace("\n", "\r"), newline="")
    assert main(["import", str(folder / "m.obj"), "-o", str(tmp_path / "s.json")]) == 0
    assert len(json.loads((tmp_path / "s.json").read_text())["textures"]) == 1


def test_a_zip_is_imported(folder: Path, tmp_path: Path) -> None:
    model = tmp_path / "m.zip"
    model.write_bytes(zipped({"m.obj": MODEL, "parts/m.mtl": GLOWING.format("g.png"), "parts/g.png": GREEN}))
    assert main(["import", str(model), "-o", str(tmp_path / "s.json")]) == 0
    assert len(json.loads((tmp_path / "s.json").read_text())["textures"]) == 1


@pytest.mark.parametrize("reference", ["../../green.png", "/outside/green.png"])
def test_files_outside_the_folder_are_not_read(
    folder: Path, tmp_path: Path, reference: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """A path that leaves the folder is refused; one from another machine is looked for by its name alone, inside."""
    (tmp_path / "green.png").write_bytes(GREEN)
    (folder / "parts" / "m.mtl").write_text(GLOWING.format(reference))
    ended = main(["import", str(folder / "m.obj"), "-o", str(tmp_path / "s.json")])
    told = capsys.readouterr().err
    if reference.startswith("/"):
        assert ended == 0 and "'parts/images/green.png', the only file of that name, is used" in told
        (folder / "parts" / "images" / "green.png").unlink()
        assert main(["import", str(folder / "m.obj"), "-o", str(tmp_path / "s.json")]) == 0
        assert "the texture '/outside/green.png' is not there" in capsys.readouterr().err
        return
    assert ended == 2 and "leaves the scene's folder; --asset-root DIR allows another one" in told
    assert not (tmp_path / "s.json").exists()
    allowed = ["--asset-root", str(tmp_path)]
    assert main(["import", str(folder / "m.obj"), "-o", str(tmp_path / "s.json"), *allowed]) == 0
    assert len(json.loads((tmp_path / "s.json").read_text())["textures"]) == 1


def test_a_link_that_leaves_the_folder_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "green.png").write_bytes(GREEN)
    image = folder / "parts" / "images" / "green.png"
    image.unlink()
    image.symlink_to(tmp_path / "green.png")
    assert main(["import", str(folder / "m.obj"), "-o", str(tmp_path / "s.json")]) == 2
    assert "leaves the scene's folder" in capsys.readouterr().err


def test_without_its_files_a_model_is_grey(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "parts" / "m.mtl").unlink()
    assert main(["import", str(folder / "m.obj"), "-o", str(tmp_path / "s.json")]) == 0
    told = capsys.readouterr().err
    assert "m.obj:9: the material library 'parts/m.mtl' is not there" in told
    assert json.loads((tmp_path / "s.json").read_text())["materials"] == {"m": {"type": "diffuse", "albedo": 0.8}}
