"""A picture carries what it was made from: rendered again it is the same, to the last bit."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sunbox
from service.cli.program import main
from service.document import references
from service.formats.images import FORMATS, encode, read_metadata, recipe
from service.formats.images.metadata import png_with_text
from service.problems import InvalidDocument
from tests.serving import PATIENCE_S, SCENE, Server

OBJ = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n"
MESH = {"type": "mesh", "asset": "meshes/one.obj", "material": "ball"}
SETTINGS = ["--set", "width=24", "--set", "height=16", "--spp", "6", "--seed", "7", "--set", "quality=draft"]


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scene file with a mesh beside it, and a data folder of its own."""
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    folder = tmp_path / "scene"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "one.obj").write_text(OBJ)
    (folder / "scene.json").write_text(json.dumps({**SCENE, "shapes": [*SCENE["shapes"], MESH]}))
    return folder / "scene.json"


def render(source: Path, out: Path, *arguments: str) -> bytes:
    assert main(["render", str(source), "-o", str(out), *arguments]) == 0
    return out.read_bytes()


@pytest.mark.parametrize(
    ("name", "view"),
    [
        ("a.png", ["--exposure", "-0.5", "--tone-map", "agx"]),
        ("a.png", ["--aov", "normal"]),
        ("a.exr", []),
        ("a.exr", ["--aov", "all"]),
    ],
)
def test_again(gpu: Any, scene: Path, tmp_path: Path, name: str, view: list[str]) -> None:
    """From another folder, when the files that the scene was made of are gone."""
    first = render(scene, tmp_path / name, *SETTINGS, *view)
    scene.unlink()
    (scene.parent / "meshes" / "one.obj").unlink()
    (tmp_path / "other").mkdir()
    assert render(tmp_path / name, tmp_path / "other" / f"again{name[1:]}") == first


def test_files_stand_in_for_a_lost_data_folder(
    gpu: Any, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    first = render(scene, tmp_path / "a.png", *SETTINGS)
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "elsewhere"))
    again = ["render", str(tmp_path / "a.png"), "-o", str(tmp_path / "b.png")]
    assert main(again) == 2 and "/scene/shapes/2/asset: 'meshes/one.obj'" in capsys.readouterr().err
    assert main([*again, "--asset-root", str(scene.parent)]) == 0
    assert (tmp_path / "b.png").read_bytes() == first
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "nowhere"))
    (scene.parent / "meshes" / "one.obj").write_text(OBJ + "# changed\n")
    assert main([*again, "--asset-root", str(scene.parent)]) == 2


def test_what_is_given_comes_first(gpu: Any, scene: Path, tmp_path: Path) -> None:
    render(scene, tmp_path / "a.png", *SETTINGS, "--exposure", "1")
    changed = render(tmp_path / "a.png", tmp_path / "b.png", "--seed", "8", "--tone-map", "linear")
    made = read_metadata(changed)
    assert made is not None and made["view"] == {"aov": "color", "exposure": 1, "tone_map": "linear", "bits": 8}
    assert made["settings"]["seed"] == 8 and made["settings"]["max_samples"] == 6 == made["samples"]
    better = render(tmp_path / "a.png", tmp_path / "c.png", "--set", "quality=preview")
    made = read_metadata(better)
    assert made is not None and made["settings"]["max_bounces"] == 5 and made["settings"]["seed"] == 7


@pytest.mark.parametrize("query", [{"bits": 16, "exposure": 0.5}, {"tone_map": "aces2"}, {"aov": "depth"}])
def test_a_servers_picture_again(server: Server, tmp_path: Path, query: dict[str, Any]) -> None:
    """It was not ended by a number of samples: the picture says how many there were, and they are what the limit is
    now."""
    settings = {"width": 32, "height": 24, "target_noise": 0.1, "time_limit": 3600, "seed": 3}
    answer = server.http.post("/v1/renders", json={"scene": SCENE, "settings": settings})
    address = f"/v1/{answer.headers['location']}"
    done = server.http.get(address, params={"wait": PATIENCE_S}).json()
    assert done["reason"] == "target_noise"
    png = server.http.get(f"{address}/image", params=query).content
    (tmp_path / "a.png").write_bytes(png)
    assert render(tmp_path / "a.png", tmp_path / "b.png") == png


WRITTEN = [name for name, each in FORMATS.items() if each.has_metadata]


@pytest.mark.parametrize("is_long", [False, True])
@pytest.mark.parametrize("format", WRITTEN)
def test_a_picture_is_a_scene_in_all_four_ways(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format: str, is_long: bool
) -> None:
    """Over REST, by the client, by `sunbox import` and by `sunbox render`; `is_long`: the text is deflated."""
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    name = 'a & b < "c" \'' + "é" * 5000 * is_long
    document = {**SCENE, "materials": {**SCENE["materials"], name: {"type": "diffuse", "albedo": 0.25}}}
    settings = {"width": 24, "height": 16, "max_samples": 2}
    answer = server.http.post("/v1/render", json={"scene": document, "settings": settings}, params={"format": format})
    assert answer.status_code == 200
    path = tmp_path / f"a.{format}"
    path.write_bytes(answer.content)
    id = server.http.post("/v1/assets", content=answer.content, params={"filename": path.name}).json()["id"]
    assert server.http.get(f"/v1/assets/{id}/scene").json() == document
    assert server.http.get(f"/v1/assets/{id}/materials").status_code == 404, "it is no set of materials"
    with sunbox.Client(server.url) as client:
        assert client.import_scene(path) == document
    assert main(["import", str(path), "-o", str(tmp_path / "a.json")]) == 0
    assert json.loads((tmp_path / "a.json").read_text()) == document
    again = render(path, tmp_path / "again.png")
    assert read_metadata(again)["scene"] == document  # type: ignore[index]


def test_an_image_is_no_scene(server: Server) -> None:
    pixels = np.zeros((2, 2, 3), np.uint8)
    id = server.http.post("/v1/assets", content=encode(pixels, "png")).json()["id"]
    answer = server.http.get(f"/v1/assets/{id}/scene")
    assert answer.status_code == 404 and "Sunbox did not make" in answer.json()["detail"]
    made = {"sunbox": "1", "scene": {"version": 7}, "settings": {}, "samples": 1, "view": {}}
    id = server.http.post("/v1/assets", content=encode(pixels, "webp", metadata=made)).json()["id"]
    answer = server.http.get(f"/v1/assets/{id}/scene")
    detail = answer.json()["detail"]
    assert answer.status_code == 422 and "metadata" in detail and "/version" in detail


def test_layers_of_a_servers_picture(server: Server, tmp_path: Path) -> None:
    import OpenImageIO

    body = {"scene": SCENE, "settings": {"width": 8, "height": 8, "max_samples": 2}}
    answer = server.http.post("/v1/render", json=body, params={"format": "exr", "aov": "all"})
    (tmp_path / "a.exr").write_bytes(answer.content)
    picture = OpenImageIO.ImageBuf(str(tmp_path / "a.exr"))
    names = picture.spec().channelnames
    assert {*"RGBA", "albedo.R", "normal.Z", "depth.Z", "variance.B", "shape_id.I"} <= set(names)
    assert render(tmp_path / "a.exr", tmp_path / "b.exr") == answer.content
    one = server.http.post("/v1/render", json=body, params={"format": "npy", "aov": "shape_id"})
    layer = picture.get_pixels(OpenImageIO.FLOAT)[..., names.index("shape_id.I")]
    assert np.array_equal(np.load(io.BytesIO(one.content))[..., 0], layer)
    refused = server.http.post("/v1/render", json=body, params={"format": "png", "aov": "all"})
    assert refused.status_code == 422 and refused.json()["errors"][0]["pointer"] == "/aov"


PLAIN = b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + b"\0" * 17


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (PLAIN, "did not make it"),
        (b"\x76\x2f\x31\x01\x02\0\0\0\0", "did not make it"),
        (png_with_text(PLAIN, '{"settings": {}, "samples": 3}'), "/scene: "),
        (png_with_text(PLAIN, json.dumps({"scene": {}, "settings": [], "samples": 1, "sunbox": "1"})), "/settings: "),
        (png_with_text(PLAIN, "[" * 100_000), "did not make it"),
    ],
)
def test_other_pictures_are_refused(
    data: bytes, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.png").write_bytes(data)
    assert main(["render", str(tmp_path / "a.png"), "-o", str(tmp_path / "b.png")]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "b.png").exists()


def test_long_metadata_is_deflated() -> None:
    long = {"scene": {"materials": {f"m{i}": {} for i in range(10_000)}}}
    png = png_with_text(PLAIN, json.dumps(long))
    assert read_metadata(png) == long and len(png) < len(json.dumps(long)) / 3


def test_references_are_found_where_they_may_stand() -> None:
    document = {
        "environment": {"type": "cubemap", "assets": {"px": "a", "nx": "b"}},
        "textures": {"asset": {"asset": "c"}},
        "materials": {"assets": {"type": "a", "asset": "d"}},
        "shapes": [{"asset": "a"}, 3, {"asset": 4}],
    }
    assert references.references(document) == ["a", "b", "c", "d"]
    renamed = references.renamed(document, str.upper)
    assert renamed["materials"] == {"assets": {"type": "a", "asset": "D"}}
    assert renamed["shapes"] == [{"asset": "A"}, 3, {"asset": 4}]
    assert references.references("nonsense") == []


def test_recipe_is_validated() -> None:
    with pytest.raises(InvalidDocument, match="/view/exposure"):
        recipe.read({"sunbox": "1", "scene": {}, "settings": {}, "samples": 1, "view": {"exposure": 61}})
