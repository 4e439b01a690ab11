"""The ways that a glTF file comes in: over REST, by `sunbox render`, by `sunbox import`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx
import numpy as np
import pytest
from PIL import Image

from service.cli.program import main
from tests.gltf_files import Gltf
from tests.marks import seldom
from tests.serving import Server

SMALL = ["--set", "width=24", "--set", "height=24", "--spp", "4", "--tone-map", "linear"]


def red_square() -> Gltf:
    """Unlit: its colour is what is seen."""
    file = Gltf().of(
        {
            "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]},
            "extensions": {"KHR_materials_unlit": {}, "KHR_materials_subsurface": {}},
        }
    )
    file.node(mesh=0, translation=[0, 0, -5])
    return file


@pytest.fixture
def data_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    return tmp_path / "data"


def is_red(picture: Path) -> bool:
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    red = (pixels[..., 0] > 250) & (pixels[..., 1:].max(axis=2) < 5)
    return bool(0.1 < red.mean() < 0.9)


def test_over_rest(server: Server) -> None:
    http: httpx.Client = server.http
    answer = http.post("/v1/assets", content=red_square().glb())
    assert answer.status_code == 201
    info = answer.json()
    assert (info["kind"], info["triangles"]) == ("scene", 4)
    assert info["bounds"] == [[-1, -1, -5], [1, 1, 0]], "of both nodes, where they stand"
    assert info["warnings"][0]["pointer"] == "/materials/0/extensions/KHR_materials_subsurface"
    scene = http.get(f"/v1/assets/{info['id']}/scene")
    document = scene.json()
    assert scene.status_code == 200 and json.loads(scene.headers["sunbox-warnings"]) == info["warnings"]
    assert document["environment"]["type"] == "image" and len(document["shapes"]) == 2
    settings = {"width": 16, "height": 16, "max_samples": 1}
    rendered = http.post("/v1/render?format=npy", json={"scene": document, "settings": settings})
    assert rendered.status_code == 200, rendered.text
    part = document["shapes"][0]["asset"]
    assert http.get(f"/v1/assets/{part}").content.startswith(b"ply\n")
    assert http.get(f"/v1/assets/{part}/scene").json()["shapes"][0]["asset"] == part  # a mesh alone
    assert http.get(f"/v1/assets/sha256:{'0' * 64}/scene").status_code == 404


def test_a_broken_one_over_rest(server: Server) -> None:
    file = red_square()
    file.tree["accessors"][0]["bufferView"] = 77
    answer = server.http.post("/v1/assets", content=file.glb())
    (error,) = answer.json()["errors"]
    assert (answer.status_code, error["pointer"]) == (422, "/accessors/0/bufferView")


def test_render(gpu: Any, tmp_path: Path, data_dir: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The model, then the picture's own metadata, give the same picture."""
    model, first, again = tmp_path / "m.glb", tmp_path / "a.png", tmp_path / "b.png"
    model.write_bytes(red_square().glb())
    assert main(["render", str(model), "-o", str(first), *SMALL]) == 0
    assert "/materials/0/extensions/KHR_materials_subsurface" in capsys.readouterr().err
    assert is_red(first)
    model.unlink()
    assert main(["render", str(first), "-o", str(again)]) == 0
    assert np.array_equal(np.asarray(Image.open(first)), np.asarray(Image.open(again)))


COLORS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8)  # as the image has them


@pytest.mark.parametrize("mirrored", seldom([False, True], [False]))
@pytest.mark.parametrize(
    ("transform", "expected"),
    [
        ({}, COLORS),
        ({"offset": [0.5, 0]}, COLORS[:, ::-1]),
        ({"offset": [0, 0.5]}, COLORS[::-1]),
        # Counter-clockwise in the plane of u and v, v downwards: the picture turns clockwise about its top left.
        ({"rotation": np.pi / 2}, np.rot90(COLORS, -1)),
        ({"scale": [0.5, 0.5]}, COLORS[[0, 0]][:, [0, 0]]),
    ],
)
def test_a_picture_is_the_right_way_round(
    gpu: Any, tmp_path: Path, data_dir: Path, transform: dict[str, Any], expected: np.ndarray, mirrored: bool
) -> None:
    """An unlit square of four colours, as a rasteriser shows it; a mirroring node swaps left and right."""
    file = Gltf()
    sampler = file.add("samplers", {"wrapS": 10497, "wrapT": 10497})
    info = {"index": file.texture(np.kron(COLORS, np.ones((8, 8, 1), np.uint8)), sampler=sampler)}
    info |= {"extensions": {"KHR_texture_transform": transform}}
    file.of({"pbrMetallicRoughness": {"baseColorTexture": info}, "extensions": {"KHR_materials_unlit": {}}})
    if mirrored:
        file.tree["nodes"][0]["scale"] = [-1, 1, 1]
        expected = expected[:, ::-1]
    model, picture = tmp_path / "m.glb", tmp_path / "a.png"
    model.write_bytes(file.glb())
    assert main(["render", str(model), "-o", str(picture), *SMALL, "--set", "filter=box"]) == 0
    pixels = np.asarray(Image.open(picture).convert("RGB"))
    assert np.abs(pixels[[[7], [16]], [7, 16]].astype(int) - expected).max() < 6


@pytest.mark.parametrize("textured", [False, True])
def test_unlit_colours_are_exact_with_a_linear_tone_map(
    gpu: Any, tmp_path: Path, data_dir: Path, textured: bool
) -> None:
    """The file's (255, 128, 0), as a factor or as an image, comes out as (255, 128, 0)."""
    color, file = (255, 128, 0), Gltf()
    rough: dict[str, Any] = {"baseColorFactor": [1, ((128 / 255 + 0.055) / 1.055) ** 2.4, 0, 1]}
    if textured:
        rough = {"baseColorTexture": {"index": file.texture(np.full((4, 4, 3), color, np.uint8))}}
    model, picture = tmp_path / "m.glb", tmp_path / "a.png"
    model.write_bytes(file.of({"pbrMetallicRoughness": rough, "extensions": {"KHR_materials_unlit": {}}}).glb())
    assert main(["render", str(model), "-o", str(picture), *SMALL]) == 0
    pixels = np.asarray(Image.open(picture).convert("RGB"))
    assert (pixels[8:16, 8:16] == color).all()


def test_import(gpu: Any, tmp_path: Path, data_dir: Path) -> None:
    """A document that stands on its own feet: nothing in the data folder."""
    model, document = tmp_path / "m.glb", tmp_path / "s.json"
    model.write_bytes(red_square().glb())
    assert main(["import", str(model), "-o", str(document)]) == 0
    assert not data_dir.exists()
    shapes = json.loads(document.read_text())["shapes"]
    assert {shape["asset"] for shape in shapes} == {f"s.assets/{next((tmp_path / 's.assets').iterdir()).name}"}
    assert main(["render", str(document), "-o", str(tmp_path / "a.png"), *SMALL]) == 0
    assert is_red(tmp_path / "a.png")


def scattered(folder: Path, name: str) -> Path:
    """A .gltf whose buffer is a file called `name`."""
    file = red_square()
    tree = {**file.tree, "buffers": [{"byteLength": len(file.binary), "uri": quote(name)}]}
    path = folder / "m.gltf"
    path.write_text(json.dumps(tree))
    return path


def test_buffers_in_files_beside_it(tmp_path: Path, data_dir: Path) -> None:
    (tmp_path / "the bytes").write_bytes(red_square().binary)
    model = scattered(tmp_path, "the bytes")
    assert main(["import", str(model), "-o", str(tmp_path / "s.json")]) == 0


@pytest.mark.parametrize("name", ["missing", "../outside", "/etc/passwd", "http://127.0.0.1:9/x"])
def test_buffers_that_are_not_beside_it(
    name: str, tmp_path: Path, data_dir: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "outside").write_bytes(red_square().binary)
    folder = tmp_path / "in"
    folder.mkdir()
    model = scattered(folder, name)
    assert main(["import", str(model), "-o", str(tmp_path / "s.json")]) == 2
    assert "error: /buffers/0/uri: " in capsys.readouterr().err
    assert not (tmp_path / "s.json").exists()


def test_a_broken_one_by_the_command_line(tmp_path: Path, data_dir: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = red_square()
    file.tree["nodes"][0]["mesh"] = 3
    (tmp_path / "m.glb").write_bytes(file.glb())
    for command, output in (("import", "o.json"), ("render", "o.png")):
        assert main([command, str(tmp_path / "m.glb"), "-o", str(tmp_path / output)]) == 2
        assert "/nodes/0/mesh: refers to /meshes/3" in capsys.readouterr().err
        assert not (tmp_path / output).exists()
