"""A zip is what is in it: a model with its parts, materials, or textures; what is left out of it; which is meant."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.config import Config
from service.formats import AssetInfo
from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.gltf_files import Gltf
from tests.mtlx_files import mtlx, surface, value
from tests.obj_files import TEXTURED, zipped
from tests.serving import Server

OAK = make.png(np.full((2, 2, 3), (200, 100, 50), np.uint8))
PINE = make.png(np.full((2, 2, 3), (50, 100, 200), np.uint8))
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
PLY = make.ply(SQUARE, [[0, 1, 2, 3]])
STL = make.stl(SQUARE[np.array([[0, 1, 2], [0, 2, 3]])])
MTLX = mtlx(surface("gltf_pbr", value("base_color", "1, 0.5, 0", "color3")))
COLOURED = "newmtl m\nKd 1 1 1\nmap_Kd {}\n"


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    opened = AssetStore(tmp_path_factory.mktemp("data"), Config(max_asset=64 << 20))
    yield opened
    opened.close()


def scattered(image: str = "textures/oak.png", buffer: str = "scene.bin", **more: Any) -> tuple[bytes, bytes]:
    """A .gltf that names its buffer and its image, and the buffer."""
    file = Gltf()
    index = file.texture(np.zeros((2, 2, 3), np.uint8))
    file.of({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}})
    tree = dict(file.tree) | {
        "images": [{"uri": image}],
        "buffers": [{"byteLength": len(file.binary), "uri": buffer}],
    }
    return json.dumps(tree | more).encode(), bytes(file.binary)


def sketchfab(folder: str = "") -> dict[str, bytes | str]:
    text, binary = scattered()
    files = {"scene.gltf": text, "scene.bin": binary, "textures/oak.png": OAK, "license.txt": b"CC-BY"}
    return {folder + name: data for name, data in files.items()}


def usda(body: str = "") -> bytes:
    square = (
        "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n"
        "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]"
    )
    mesh = 'def Mesh "M" {\n' + square + "\n}"
    return f"#usda 1.0\n(\nmetersPerUnit = 1\n)\n{body or mesh}\n".encode()


def unused(info: AssetInfo) -> list[str]:
    """The warnings about files of the zip that the model does not use; others are about the model's file."""
    return [detail for detail in told(info) if "not used" in detail]


def told(info: AssetInfo) -> list[str]:
    return [warning["detail"] for warning in info.warnings or []]


def texture(store: AssetStore, info: AssetInfo) -> bytes:
    """The only image of a scene or of materials."""
    (found,) = store.materials(info.id).document["textures"].values()
    return store.read(found["asset"])


MODELS: dict[str, dict[str, bytes | str]] = {
    "a glTF with its parts": sketchfab(),
    "a folder of them": sketchfab("model/"),
    "a GLB": {"a.glb": make.glb(make.gltf())},
    "a GLB by its bytes": {"a.vrm": make.glb(make.gltf())},
    "an OBJ": {"a.obj": TEXTURED, "m.mtl": COLOURED.format("oak.png"), "oak.png": OAK},
    "an STL": {"part.stl": STL},
    "a text of STL": {"part.STL": make.stl_text(SQUARE[np.array([[0, 1, 2]])])},
    "a PLY": {"scan/part.ply": PLY},
}


@pytest.mark.parametrize("name", MODELS)
def test_a_zip_of_a_model_is_that_model(store: AssetStore, name: str) -> None:
    files = MODELS[name]
    info = store.add(zipped(files))
    assert info.kind == "scene" and info.triangles
    document = store.scene(info.id).document
    assert len(document["shapes"]) >= 1
    assert len(store.mesh(info.id).faces) == info.triangles, "and one mesh, where a mesh is needed"
    if any(path.endswith("oak.png") for path in files):
        assert texture(store, info) == OAK
    assert len(unused(info)) == ("license.txt" in str(files))


@pytest.mark.parametrize("name", MODELS)
def test_what_the_model_does_not_use_is_told_by_name(store: AssetStore, name: str) -> None:
    """Loose images as well, whose names say what they are of: beside a model they make no material."""
    info = store.add(zipped({**MODELS[name], "wood_color.png": PINE, "notes.txt": "hello"}))
    assert info.kind == "scene"
    (detail,) = unused(info)
    assert "wood_color.png" in detail and "notes.txt" in detail


@pytest.mark.usd
@pytest.mark.parametrize(
    "files",
    [
        {"readme.txt": b"hello", "a.usda": usda()},
        {"a.usda": usda(), "readme.txt": b"hello"},
        {"readme.txt": b"hello", "a.usdz": zipped({"a.usda": usda()}, zipfile.ZIP_STORED)},
        {
            "readme.txt": b"hello",
            "parts/m.usda": usda(),
            "root.usda": usda('def "X" (\nreferences = @./parts/m.usda@</M>\n) {}'),
        },
    ],
)
def test_a_zip_of_usd_is_that_scene(store: AssetStore, files: dict[str, bytes | str]) -> None:
    info = store.add(zipped(files))
    assert (info.kind, info.triangles) == ("scene", 1)
    assert len(store.mesh(info.id).faces) == 1
    assert any("readme.txt" in detail for detail in told(info))


@pytest.mark.usd
def test_layers_to_which_no_other_refers_are_models(store: AssetStore) -> None:
    with pytest.raises(AssetError, match=r"2 models, a\.usda and b\.usda"):
        store.add(zipped({"a.usda": usda(), "b.usda": usda()}))
    one = store.add(zipped({"a.usda": usda(), "b.usda": usda()}), entry="b.usda")
    assert one.id == "sha256:" + hashlib.sha256(usda()).hexdigest()


@pytest.mark.usd
def test_the_first_layer_of_a_package_is_its_root(store: AssetStore) -> None:
    """As the format of packages demands: files stored as they are, each at a multiple of 64 bytes."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as package:
        for name in ("a.usda", "b.usda"):
            entry = zipfile.ZipInfo(name)
            space = -(made.tell() + 30 + len(name) + 4) % 64
            entry.extra = b"\x86\x19" + space.to_bytes(2, "little") + bytes(space)
            package.writestr(entry, usda())
    info = store.add(made.getvalue())
    assert info.kind == "scene" and any("b.usda" in detail for detail in told(info))


def test_an_animation_and_a_variant_of_a_zipped_gltf_are_posed(server: Server) -> None:
    """The same as of the file alone."""
    file = Gltf()
    file.of({})
    times, moves = file.accessor(np.array([0, 1], "<f4")), file.accessor(np.array([[0, 0, 0], [0, 2, 0]], "<f4"))
    file.tree["animations"] = [
        {
            "name": "Up",
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": times, "output": moves}],
        }
    ]
    answer = server.http.post("/v1/assets", content=zipped({"a.glb": file.glb()})).json()
    assert [one["name"] for one in answer["animations"]] == ["Up"]
    alone = server.http.post("/v1/assets", content=file.glb()).json()
    posed = [
        server.http.get(f"/v1/assets/{one['id']}/scene", params={"animation": "Up", "time": 1}).json()
        for one in (answer, alone)
    ]
    assert posed[0] == posed[1]


JUNK = {
    "__MACOSX/a.obj": b"junk",
    "d/__MacOSX/._a.obj": b"junk",
    "._a.obj": b"\x00\x05\x16\x07",
    "._a.gltf": b"junk",
    "._a.mtlx": b"junk",
    "._oak_color.png": b"junk",
    "d/.DS_Store": b"junk",
    "Thumbs.db": b"junk",
    "THUMBS.DB": b"junk",
    "Desktop.ini": b"junk",
}


@pytest.mark.parametrize(
    ("files", "kind"),
    [
        ({"a.obj": TEXTURED}, "scene"),
        ({"d/a.obj": TEXTURED}, "scene"),
        ({"a.glb": make.glb(make.gltf())}, "scene"),
        ({"a.stl": STL}, "scene"),
        ({"a.mtlx": MTLX}, "materials"),
        ({"oak_color.png": OAK}, "materials"),
    ],
)
def test_files_of_file_managers_are_left_out(store: AssetStore, files: dict[str, bytes | str], kind: str) -> None:
    info, clean = store.add(zipped({**JUNK, **files})), store.add(zipped(files))
    assert info.kind == kind
    assert info.warnings == clean.warnings, "and are not worth a word"
    assert store.materials(info.id).document == store.materials(clean.id).document


def test_several_models_are_named_and_one_is_chosen(store: AssetStore) -> None:
    files = {
        "a.obj": TEXTURED, "m.mtl": COLOURED.format("oak.png"), "oak.png": OAK, "b/part.stl": STL,
        **sketchfab("c/"), "m.mtlx": MTLX, "pine_color.png": PINE,
    }  # fmt: skip
    data = zipped(files)
    with pytest.raises(AssetError, match=r"3 models, a\.obj, b/part\.stl and c/scene\.gltf; choose one"):
        store.add(data)
    with pytest.raises(AssetError, match=r"no model 'x\.obj'; they are a\.obj, b/part\.stl") as refused:
        store.add(data, entry="x.obj")
    assert refused.value.place == "/entry"

    part = store.add(data, entry="part.stl")
    assert part.id == store.add(STL).id, "a model without parts is the file itself"
    for entry, names in (
        ("a.obj", {"a.obj", "m.mtl", "oak.png"}),
        ("C/Scene.gltf", {"c/scene.gltf", "c/scene.bin", "c/textures/oak.png"}),
    ):
        info = store.add(data, entry=entry)
        assert info.kind == "scene" and told(info) == [] and texture(store, info) == OAK
        kept = store.read(info.id)
        assert info.id == "sha256:" + hashlib.sha256(kept).hexdigest()
        assert set(zipfile.ZipFile(io.BytesIO(kept)).namelist()) == names
        assert store.add(kept).id == info.id and store.add(data, entry=entry).id == info.id
    assert store.add(data, entry="m.mtlx").kind == "materials"


def test_a_chosen_model_has_the_images_of_all_its_variants(store: AssetStore) -> None:
    """What it names belongs to it, whether or not the picture shows it at first."""
    text, binary = scattered(images=[{"uri": "oak.png"}, {"uri": "pine.png"}])
    files: dict[str, bytes | str] = {
        "a.gltf": text,
        "scene.bin": binary,
        "oak.png": OAK,
        "pine.png": PINE,
        "b.stl": STL,
    }
    kept = store.read(store.add(zipped(files), entry="a.gltf").id)
    assert "pine.png" in zipfile.ZipFile(io.BytesIO(kept)).namelist()


def test_an_entry_needs_a_zip(store: AssetStore) -> None:
    for data in (STL, b"", b"nonsense", OAK):
        with pytest.raises(AssetError, match="this file is none"):
            store.add(data, entry="a.obj")
    with pytest.raises(AssetError, match=r"no model 'a\.obj'; it has none"):
        store.add(zipped({"oak_color.png": OAK}), entry="a.obj")


def test_several_models_over_rest(server: Server) -> None:
    data = zipped({"a.stl": STL, "b.ply": PLY})
    refused = server.http.post("/v1/assets", content=data)
    assert refused.status_code == 422
    assert "the zip holds 2 models, a.stl and b.ply" in refused.json()["detail"]
    assert refused.json()["choices"] == ["a.stl", "b.ply"]
    taken = server.http.post("/v1/assets", params={"entry": "b.ply", "filename": "x.zip"}, content=data)
    assert taken.status_code == 201, taken.text
    assert taken.json()["id"] == "sha256:" + hashlib.sha256(PLY).hexdigest()
    assert server.http.get(f"/v1/assets/{taken.json()['id']}/scene").status_code == 200
    wrong = server.http.post("/v1/assets", params={"entry": "c.ply"}, content=data)
    assert wrong.status_code == 422 and wrong.json()["errors"][0]["pointer"] == "/entry"


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (
            {"readme.txt": "hi", "a.blend": b"BLENDER"} | {f"{k}.dat": b"x" for k in range(10)},
            "the zip holds readme.txt, a.blend, 0.dat, 1.dat, 2.dat, 3.dat, 4.dat, 5.dat, 6.dat, 7.dat and 2 more; "
            "no model",
        ),
        ({"readme.txt": "hi", "a.MAX": b"x"}, "a.MAX is a model in a format that is not read; export it as glTF"),
        ({"IMG_1.png": OAK}, "the zip holds IMG_1.png; no model"),
        ({"IMG_1.png": OAK}, "no images whose names say what they are"),
        ({"IMG_1.png": OAK}, "an image that is used by itself is uploaded without a zip"),
        ({"oak_color.TIF": b"II*"}, "oak_color.TIF is not an image in a supported format (PNG, JPEG"),
        ({"in.zip": zipped({"a.obj": TEXTURED})}, "the zip holds in.zip; a zip within a zip is not opened"),
        ({"__MACOSX/a.obj": TEXTURED}, "the zip is empty"),
        ({"a.gltf": scattered()[0], "oak.png": OAK}, "'scene.bin', which is not there: the zip holds a.gltf"),
        ({"a.stl": b""}, "a.stl: "),
    ],
)  # fmt: skip
def test_a_refusal_says_what_is_in_the_zip(store: AssetStore, files: dict[str, bytes | str], said: str) -> None:
    with pytest.raises(AssetError) as refused:
        store.add(zipped(files))
    assert said in refused.value.detail


def test_a_zip_beside_a_model_is_told(store: AssetStore) -> None:
    info = store.add(zipped({"source.zip": zipped({"b.obj": TEXTURED}), "a.stl": STL}))
    (detail,) = told(info)
    assert "source.zip" in detail and "a zip within a zip is not opened" in detail
    info = store.add(zipped({"source.zip": zipped({"b.obj": TEXTURED}), "oak_color.png": OAK}))
    assert [warning["pointer"] for warning in info.warnings or []] == ["source.zip"]


def test_a_model_that_is_not_read_is_told_beside_its_textures(store: AssetStore) -> None:
    info = store.add(zipped({"oak.blend": b"BLENDER", "oak_color.png": OAK}))
    assert told(info) == ["a model in a format that is not read; export it as glTF (.glb); left out"]


def test_each_file_that_makes_no_material_is_named(store: AssetStore) -> None:
    files: dict[str, bytes | str] = {
        "oak_color.png": OAK,
        "readme.txt": "a",
        "license.txt": "b",
        "cover.png": PINE,
        "IMG_2.png": OAK,
    }
    info = store.add(zipped(files))
    text = " ".join(f"{warning['pointer']} {warning['detail']}" for warning in info.warnings or [])
    assert {name for name in files if name in text} == files.keys() - {"oak_color.png"}


def test_a_gltf_alone_says_what_to_do(store: AssetStore) -> None:
    with pytest.raises(AssetError, match="upload a zip of the model and its files, or save the model as a GLB"):
        store.add(scattered()[0])


def test_an_image_that_is_lost_is_told_and_the_model_shown(store: AssetStore) -> None:
    text, binary = scattered()
    info = store.add(zipped({"a.gltf": text, "scene.bin": binary}))
    assert told(info) == ["the image 'textures/oak.png' is not there; it is left out"]
    web, binary = scattered("https://example.org/oak.png")
    info = store.add(zipped({"a.gltf": web, "scene.bin": binary, "oak.png": OAK}))
    assert "the image 'https://example.org/oak.png' is not there" in told(info)[0]


def test_a_zip_that_was_recorded_as_materials_is_a_scene_now(tmp_path: Path) -> None:
    """An older version took the images of a zipped glTF for all that there is."""
    with closing(AssetStore(tmp_path, Config())) as own:
        id = own.add(zipped(sketchfab())).id
        (record,) = (path for path in tmp_path.rglob("*") if path.is_file() and id in path.read_text("latin-1")[:200])
        record.write_text(json.dumps(json.loads(record.read_text()) | {"kind": "materials"}))
        assert own.info(id).kind == "materials" and own.scene(id).document["shapes"]


def test_the_command_takes_a_zip_and_one_of_its_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    model, target = tmp_path / "m.zip", tmp_path / "s.json"
    model.write_bytes(zipped(sketchfab()))
    assert main(["import", str(model), "-o", str(target)]) == 0
    assert "license.txt" in capsys.readouterr().err
    model.write_bytes(zipped({**sketchfab(), "part.stl": STL}))
    assert main(["import", str(model), "-o", str(target)]) == 2
    assert "--entry NAME" in capsys.readouterr().err
    assert main(["import", str(model), "-o", str(target), "--entry", "scene.gltf"]) == 0
    assert capsys.readouterr().err == ""
    assert len(json.loads(target.read_text())["textures"]) == 1
    assert main(["export", str(target), "-o", str(tmp_path / "a.glb"), "--entry", "x"]) == 2
    assert "--entry: names a model of a zip" in capsys.readouterr().err
