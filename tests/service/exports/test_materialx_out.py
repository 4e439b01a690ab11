"""Materials as MaterialX: read in again they are the same materials, and what they lose is told."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.config import Config
from service.document import parse_scene
from service.exports import FORMATS, Exported
from service.formats.read.materialx.importer import read_materialx
from service.formats.read.references import Finder
from service.formats.types import AssetLimits, SceneFile
from service.server.assets import AssetStore
from tests.asset_files import png
from tests.exr_files import written as layered
from tests.serving import Server

mx = pytest.importorskip("MaterialX")

IMAGE = png(np.random.default_rng(5).integers(0, 256, (8, 8, 4)).astype(np.uint8))
LOOK = {"version": 1, "camera": {"position": [0, 0, 4], "target": [0, 0, 0]}, "shapes": []}
FULL: dict[str, Any] = {
    "type": "principled", "base_color": [0.8, 0.4, 0.2], "metallic": 0.25, "roughness": 0.35, "ior": 1.7,
    "anisotropic": 0.5, "sheen": 0.3, "sheen_color": [1.0, 0.5, 0.25], "sheen_roughness": 0.6, "clearcoat": 0.5,
    "clearcoat_roughness": 0.05, "emission": [2.0, 4.0, 1.0], "alpha": 0.5,
}  # fmt: skip
GLASS = {
    "type": "principled", "base_color": 1.0, "roughness": 0.1, "ior": 1.33, "transmission": 1.0,
    "attenuation_color": [0.9, 0.5, 0.25], "attenuation_distance": 0.125, "abbe": 40.0,
}  # fmt: skip
FILM = {"type": "principled", "base_color": [0.5, 0.25, 0.125], "roughness": 0.2, "metallic": 1.0,
        "film_thickness": 312.5, "film_ior": 1.75}  # fmt: skip
TINTED = {"type": "principled", "base_color": [0.2, 0.1, 0.9], "roughness": 0.2, "transmission": 1.0}
PANE = {"type": "principled", "base_color": [0.9, 1.0, 0.8], "roughness": 0.3, "transmission": 1.0, "ior": 1.45,
        "thin_walled": True}  # fmt: skip
LEAF = {"type": "principled", "base_color": [0.2, 0.5, 0.1], "roughness": 0.4, "ior": 1.4, "thin_walled": True,
        "diffuse_transmission": 0.4, "diffuse_transmission_color": [0.5, 0.8, 0.1]}  # fmt: skip
OPENPBR = {
    "type": "openpbr", "base_weight": 0.9, "base_color": [0.5, 0.25, 0.75], "base_diffuse_roughness": 0.4,
    "base_metalness": 0.5, "specular_weight": 1.5, "specular_color": [0.9, 0.8, 0.7], "specular_roughness": 0.3,
    "specular_roughness_anisotropy": 0.6, "specular_ior": 0.75, "transmission_weight": 0.25,
    "transmission_color": [0.1, 0.2, 0.3], "transmission_dispersion_scale": 0.5,
    "transmission_dispersion_abbe_number": 30.0,
    "coat_weight": 0.5, "coat_color": [0.6, 0.5, 0.4], "coat_roughness": 0.1,
    "coat_roughness_anisotropy": 0.3, "coat_ior": 1.7, "coat_darkening": 0.75, "fuzz_weight": 0.2,
    "fuzz_color": [0.3, 0.2, 0.1], "fuzz_roughness": 0.6, "emission_luminance": 500.0,
    "emission_color": [0.5, 2.0, 1.0], "geometry_opacity": 0.8, "geometry_tangent": [0.6, -0.8, 0.0],
    "geometry_coat_tangent": [-1.0, 0.0, 0.0], "geometry_thin_walled": True,
    "thin_film_weight": 0.5, "thin_film_thickness": 0.35, "thin_film_ior": 2.2,
}  # fmt: skip
TEXTURES = {
    "coat": {"asset": "", "color_space": "srgb", "wrap": ["mirror", "repeat"], "scale": [2.0, -4.0], "rotation": 30.0,
             "offset": [0.25, 0.5]},
    "data": {"asset": "", "color_space": "linear"},
}  # fmt: skip
TEXTURED = {
    "type": "principled", "base_color": {"texture": "coat", "factor": [0.5, 1.0, 0.25]},
    "roughness": {"texture": "data", "channel": "g", "factor": 0.5}, "metallic": {"texture": "data", "channel": "b"},
    "alpha": {"texture": "data", "channel": "a"}, "normal_map": {"texture": "data", "scale": 0.5},
    "emission": {"texture": "coat", "factor": 3.0},
    "film_thickness": {"texture": "data", "channel": "b", "factor": 600.0}, "film_ior": 1.6,
}  # fmt: skip
OPENPBR_TEXTURED = {
    "type": "openpbr", "base_color": {"texture": "coat", "factor": [0.5, 1.0, 0.25]},
    "coat_ior": {"texture": "data", "channel": "g", "factor": 2.0},
    "fuzz_weight": {"texture": "data", "channel": "b"}, "geometry_opacity": {"texture": "data", "channel": "a"},
    "geometry_coat_normal": {"texture": "data", "scale": 0.5},
    "emission_luminance": 100.0, "emission_color": {"texture": "coat", "factor": 3.0},
}  # fmt: skip


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


def written(store: AssetStore, materials: dict[str, Any], textures: dict[str, Any] | None = None) -> Exported:
    asset = store.add(IMAGE).id
    named = {name: {**each, "asset": asset} for name, each in (textures or {}).items()}
    scene = parse_scene({**LOOK, "materials": materials, "textures": named})
    exported = FORMATS["mtlx"].material_writer(scene, store, Config())
    document = mx.createDocument()
    mx.readFromXmlString(document, exported.data.decode())
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    document.setDataLibrary(library)
    assert document.validate()[0], document.validate()[1]
    return exported


def again(exported: Exported) -> SceneFile:
    files = {"a.mtlx": exported.data, **exported.beside}
    return read_materialx(["a.mtlx"], Finder(files), files.__getitem__, AssetLimits())


def same(found: Any, wanted: Any) -> None:
    assert found.keys() == wanted.keys()
    for name, value in wanted.items():
        if isinstance(value, dict):
            same(found[name], value)
        else:
            assert found[name] == (
                value if name == "wrap" or isinstance(value, str) else pytest.approx(value, rel=2e-6)
            ), name


@pytest.mark.parametrize(
    "material",
    [FULL, GLASS, FILM, TINTED, PANE, LEAF, OPENPBR],
    ids=["all", "glass", "film", "tinted", "pane", "leaf", "openpbr"],
)
def test_a_material_is_the_same_when_it_is_read_again(store: AssetStore, material: dict[str, Any]) -> None:
    exported = written(store, {"m": material})
    assert not list(exported.losses)
    file = again(exported)
    same(file.document["materials"]["m"], material)
    assert not file.warnings


@pytest.mark.parametrize("material", [TEXTURED, OPENPBR_TEXTURED], ids=["principled", "openpbr"])
def test_textures_keep_their_bytes_and_where_they_lie(store: AssetStore, material: dict[str, Any]) -> None:
    exported = written(store, {"m": material}, TEXTURES)
    assert not list(exported.losses) and list(exported.beside.values()) == [IMAGE]
    file = again(exported)
    names = {value["texture"] for value in file.document["materials"]["m"].values() if isinstance(value, dict)}
    by_scale = {len(file.document["textures"][name]): name for name in names}
    renamed = {"data": by_scale[2], "coat": by_scale[6]}
    wanted = json.loads(json.dumps(material))
    for value in wanted.values():
        if isinstance(value, dict):
            value["texture"] = renamed[value["texture"]]
    same(file.document["materials"]["m"], wanted)
    for name, texture in TEXTURES.items():
        same(file.document["textures"][renamed[name]], {**texture, "asset": "part:0"})


def test_each_model_has_its_own_node_and_the_rest_is_told(store: AssetStore) -> None:
    turned = {**FULL, "anisotropic_rotation": 90.0, "subsurface": 0.5}
    exported = written(store, {"brushed metal": turned, "plain": OPENPBR})
    assert b"<standard_surface" in exported.data and b"<open_pbr_surface" in exported.data
    assert {pointer for pointer, _ in exported.losses} == {
        "/materials/brushed metal", "/materials/brushed metal/subsurface",
    }  # fmt: skip
    wanted = {name: value for name, value in turned.items() if name != "subsurface"}
    same(again(exported).document["materials"]["brushed_metal"], wanted)
    gold = {"type": "principled", "metallic": 1, "conductor_eta": [0.2, 0.4, 1.4], "conductor_k": [3.4, 2.4, 1.8]}
    lost = {pointer for pointer, _ in written(store, {"m": gold}).losses}
    assert lost == {"/materials/m/conductor_eta", "/materials/m/conductor_k"}
    other = written(store, {"m": {"type": "diffuse", "albedo": 0.5}})
    assert "/materials/m/type" in {pointer for pointer, _ in other.losses}


def test_an_image_by_box_comes_back(store: AssetStore) -> None:
    """It is a projection along the axes; what that cannot say is told, and what is by sphere is by coordinates."""
    by_box = {"color_space": "srgb", "mapping": "box", "scale": [3.0, 3.0]}
    material = {"type": "openpbr", "base_color": {"texture": "t"}}
    exported = written(store, {"m": material}, {"t": by_box})
    assert [pointer for pointer, _ in exported.losses] == ["/materials/m/base_color"]
    (texture,) = again(exported).document["textures"].values()
    same(texture, {**by_box, "asset": "part:0"})
    odd = written(store, {"m": material}, {"t": {**by_box, "scale": [3.0, 1.0], "wrap": "clamp"}})
    assert len(list(odd.losses)) == 3
    ((_, detail),) = written(store, {"m": material}, {"t": {**by_box, "mapping": "sphere"}}).losses
    assert "by sphere" in detail


def test_it_is_served_and_written_by_the_command(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    server.http.put("/v1/documents/materials/full", json=FULL)
    plain = server.http.get("/v1/documents/materials/full?format=mtlx")
    assert plain.headers["content-type"] == "application/mtlx+xml" and plain.headers["sunbox-lost"] == "[]"
    assert b'<surfacematerial name="full"' in plain.content
    asset = server.http.post("/v1/assets", content=IMAGE).json()["id"]
    textures = {name: {**each, "asset": asset} for name, each in TEXTURES.items()}
    scene = {**LOOK, "materials": {"m": TEXTURED}, "textures": textures}
    scene["shapes"] = [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}]
    answer = server.http.post("/v1/export", json={"scene": scene, "format": "mtlx"})
    assert answer.headers["content-type"] == "application/zip"
    assert [loss["pointer"] for loss in json.loads(answer.headers["sunbox-lost"])] == ["/scene/shapes/0"]
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        assert archive.namelist() == ["scene.mtlx", "textures/coat.png"]
    taken = server.http.post("/v1/assets", content=answer.content).json()
    assert taken["kind"] == "materials" and not taken["warnings"]

    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    (tmp_path / "a.png").write_bytes(IMAGE)
    scene["textures"] = {name: {**each, "asset": "a.png"} for name, each in TEXTURES.items()}
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    assert main(["export", str(tmp_path / "scene.json"), "-o", str(tmp_path / "out.mtlx")]) == 0
    assert "lost: /shapes/0: MaterialX has materials only" in capsys.readouterr().err
    assert (tmp_path / "textures" / "coat.png").read_bytes() == IMAGE
    assert main(["import", str(tmp_path / "out.mtlx"), "-o", str(tmp_path / "again.json")]) == 0


@pytest.mark.parametrize("mapping", ["uv", "box"])
def test_a_layer_of_an_image_is_written_and_read_again(mapping: str, store: AssetStore) -> None:
    """The file goes along as it is."""
    texels = np.full((4, 4, 6), 0.25, np.float32)
    layers = layered(texels, [f"{layer}.{channel}" for layer in ("A&O", "beauty") for channel in "RGB"])
    textures = {"t": {"asset": store.add(layers).id, "layer": "A&O", "mapping": mapping}}
    material = {"type": "openpbr", "base_color": {"texture": "t"}}
    exported = FORMATS["mtlx"].material_writer(
        parse_scene({**LOOK, "materials": {"m": material}, "textures": textures}), store, Config()
    )
    assert list(exported.beside.values()) == [layers]
    assert not exported.losses or mapping == "box"
    files = {"a.mtlx": exported.data, **exported.beside}
    again = read_materialx(["a.mtlx"], Finder(files), files.__getitem__, AssetLimits())
    (found,) = again.document["textures"].values()
    assert found["layer"] == "A&O" and found.get("mapping", "uv") == mapping
