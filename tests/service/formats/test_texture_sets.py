"""Zipped images whose names say what they are become materials with their textures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.document.document import check_saved_material
from service.formats.read.texture_sets.names import meaning
from service.problems import AssetError, NotFound
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.obj_files import zipped
from tests.serving import Server

GREY = np.full((4, 4, 1), 64, np.uint8)
COLOR = np.full((4, 4, 3), (200, 100, 50), np.uint8)
BLUE = np.full((4, 4, 3), (100, 30, 250), np.uint8)
MASK = np.full((4, 4, 4), (10, 20, 30, 191), np.uint8)

# Sets as they are downloaded or exported: the files, and for each role the file, and its channel, that is taken.
SETS: dict[str, tuple[str, dict[str, str]]] = {
    "ambientCG": (
        "Bricks001_1K-JPG_Color Bricks001_1K-JPG_NormalGL Bricks001_1K-JPG_NormalDX Bricks001_1K-JPG_Roughness "
        "Bricks001_1K-JPG_AmbientOcclusion Bricks001_1K-JPG_Displacement Bricks001",
        {"base_color": "Bricks001_1K-JPG_Color", "roughness": "Bricks001_1K-JPG_Roughness",
         "normal_map": "Bricks001_1K-JPG_NormalGL", "height": "Bricks001_1K-JPG_Displacement"},
    ),
    "ambientCG, a metal": (
        "Metal032_2K-PNG_Color Metal032_2K-PNG_Metalness Metal032_2K-PNG_Opacity Metal032_2K-PNG_Emission",
        {"base_color": "Metal032_2K-PNG_Color", "metallic": "Metal032_2K-PNG_Metalness",
         "alpha": "Metal032_2K-PNG_Opacity", "emission": "Metal032_2K-PNG_Emission"},
    ),
    "Poly Haven": (
        "rusty_metal_02_diff_1k rusty_metal_02_nor_gl_1k rusty_metal_02_rough_1k rusty_metal_02_arm_1k "
        "rusty_metal_02_disp_1k rusty_metal_02_ao_1k",
        {"base_color": "rusty_metal_02_diff_1k", "normal_map": "rusty_metal_02_nor_gl_1k",
         "roughness": "rusty_metal_02_rough_1k", "metallic": "rusty_metal_02_arm_1k b",
         "height": "rusty_metal_02_disp_1k"},
    ),
    "Quixel": (
        "vglkdeh_4K_Albedo vglkdeh_4K_Normal_LOD0 vglkdeh_4K_Roughness vglkdeh_4K_Specular vglkdeh_4K_Cavity",
        {"base_color": "vglkdeh_4K_Albedo", "normal_map": "vglkdeh_4K_Normal_LOD0",
         "roughness": "vglkdeh_4K_Roughness", "specular": "vglkdeh_4K_Specular"},
    ),
    "textures.com": (
        "TexturesCom_Brick_Old_1K_albedo TexturesCom_Brick_Old_1K_normal TexturesCom_Brick_Old_1K_roughness",
        {"base_color": "TexturesCom_Brick_Old_1K_albedo", "normal_map": "TexturesCom_Brick_Old_1K_normal",
         "roughness": "TexturesCom_Brick_Old_1K_roughness"},
    ),
    "FreePBR": (
        "worn-wall-albedo worn-wall-metallic worn-wall-normal-ogl worn-wall-normal-dx worn-wall-ao",
        {"base_color": "worn-wall-albedo", "metallic": "worn-wall-metallic", "normal_map": "worn-wall-normal-ogl"},
    ),
    "3dtextures": (
        "Stone_Wall_013_basecolor Stone_Wall_013_ambientOcclusion Stone_Wall_013_height Stone_Wall_013_opacity",
        {"base_color": "Stone_Wall_013_basecolor", "alpha": "Stone_Wall_013_opacity",
         "height": "Stone_Wall_013_height"},
    ),
    "Poliigon": (
        "GroundDirt_COL_3K GroundDirt_NRM_3K GroundDirt_REFL_3K GroundDirt_DISP_3K",
        {"base_color": "GroundDirt_COL_3K", "normal_map": "GroundDirt_NRM_3K", "specular": "GroundDirt_REFL_3K",
         "height": "GroundDirt_DISP_3K"},
    ),
    "Substance to Unreal Engine": (
        "Barrel_BaseColor Barrel_OcclusionRoughnessMetallic Barrel_Emissive",
        {"base_color": "Barrel_BaseColor", "roughness": "Barrel_OcclusionRoughnessMetallic g",
         "metallic": "Barrel_OcclusionRoughnessMetallic b", "emission": "Barrel_Emissive"},
    ),
    "Substance to glTF": (
        "Barrel_baseColor Barrel_metallicRoughness Barrel_normal",
        {"base_color": "Barrel_baseColor", "roughness": "Barrel_metallicRoughness g",
         "metallic": "Barrel_metallicRoughness b", "normal_map": "Barrel_normal"},
    ),
    "Unreal Engine's letters": (
        "T_Rock_D T_Rock_N T_Rock_2K_R",
        {"base_color": "T_Rock_D", "normal_map": "T_Rock_N", "roughness": "T_Rock_2K_R"},
    ),
    "packed otherwise": (
        "crate_rma crate_base_color",
        {"base_color": "crate_base_color", "roughness": "crate_rma r", "metallic": "crate_rma g"},
    ),
    "Substance to Unity": (
        "Barrel_AlbedoTransparency Barrel_Normal",
        {"base_color": "Barrel_AlbedoTransparency", "alpha": "Barrel_AlbedoTransparency a",
         "normal_map": "Barrel_Normal"},
    ),
}  # fmt: skip


def added(store: AssetStore, files: dict[str, bytes]) -> dict[str, Any]:
    info = store.add(zipped(files))
    assert info.kind == "materials"
    document = store.materials(info.id).document
    for name, material in document["materials"].items():
        shown = [each["texture"] for each in material.values() if isinstance(each, dict)]
        check_saved_material(
            {"materials": {name: material}, "textures": {each: document["textures"][each] for each in shown}}
        )
    return document


def texels(store: AssetStore, document: dict[str, Any], reference: dict[str, Any]) -> np.ndarray:
    return store.image(document["textures"][reference["texture"]]["asset"]).pixels


@pytest.mark.parametrize("naming", SETS)
def test_a_set_becomes_one_material(store: AssetStore, naming: str) -> None:
    names, expected = SETS[naming]
    document = added(store, {f"set/{name}.png": make.png(MASK + k) for k, name in enumerate(names.split())})
    (material,) = document["materials"].values()
    assert material.pop("type") == "principled"
    taken = {
        member: " ".join(filter(None, (reference["texture"], reference.get("channel"))))
        for member, reference in material.items()
    }
    assert taken == expected
    if "height" in material:  # the normal map has the same relief
        assert material["height"].get("shading", True) == ("normal_map" not in material)
    coloured = {material[member]["texture"] for member in ("base_color", "emission") if member in material}
    assert {n for n, each in document["textures"].items() if each["color_space"] == "srgb"} == coloured


@pytest.mark.parametrize(
    ("stem", "material", "roles"),
    [
        ("painted_metal_rough_2k", "painted_metal", "roughness"),
        ("gold color", "gold", "color"),
        ("normal_brick", "brick", "normal"),
        ("Wood (Oak) - Base Color", "Wood_Oak", "color"),
        ("lambert1_MaskMap", "lambert1", "metallic occlusion gloss"),
        ("lambert1_MetallicSmoothness", "lambert1", "metallic gloss"),
        ("hull_AO_Rough_Metal", "hull", "occlusion roughness metallic"),
        ("tile_albedo_1024", "tile", "color"),
    ],
)
def test_the_last_word_decides(stem: str, material: str, roles: str) -> None:
    found = meaning(stem)
    assert found is not None and found.tile is None
    assert found.material == material and " ".join(found.channels) == roles


@pytest.mark.parametrize("name", ["arm", "orm", "mra", "rma"])
def test_initials_say_what_is_in_which_channel(name: str) -> None:
    initials = {"a": "occlusion", "o": "occlusion", "r": "roughness", "m": "metallic"}
    found = meaning(f"crate_{name}_2k")
    assert found is not None
    assert found.channels == {initials[letter]: channel for letter, channel in zip(name, "rgb", strict=True)}


@pytest.mark.parametrize("stem", ["IMG_2034", "Bricks001", "D", "photo", "1001"])
def test_a_name_without_such_a_word_says_nothing(stem: str) -> None:
    assert meaning(stem) is None


def test_which_way_green_points() -> None:
    for stem in ("a_nor_gl", "a_NormalGL", "a-normal-ogl", "a_Normal_OpenGL", "a_normalgl"):
        found = meaning(stem)
        assert found is not None and found.directx is False, stem
    for stem in ("a_nor_dx_2k", "a_NormalDX", "a_Normal_DirectX", "a_normal_directx", "a_nrmdx"):
        found = meaning(stem)
        assert found is not None and found.directx is True, stem
    plain = meaning("a_normal")
    assert plain is not None and plain.directx is None


def test_gloss_is_inverted_and_directx_is_turned(store: AssetStore) -> None:
    files = {
        "a_gloss.png": make.png(GREY),
        "a_normal_dx.png": make.png(BLUE),
        "b_MetallicSmoothness.png": make.png(MASK),
    }
    document = added(store, files)
    a, b = document["materials"]["a"], document["materials"]["b"]
    assert np.all(texels(store, document, a["roughness"])[..., 0] == 255 - 64)
    assert np.all(texels(store, document, a["normal_map"]) == (100, 225, 250))
    assert np.all(texels(store, document, b["roughness"])[..., 0] == 255 - 191)
    assert b["metallic"] == {"texture": "b_MetallicSmoothness", "channel": "r"}


def test_materials_are_parted_by_what_their_names_share_and_what_is_not_taken_is_listed(store: AssetStore) -> None:
    files = {
        "wood/color.png": make.png(COLOR),
        "stone/color.png": make.png(COLOR + 1),
        "oak_color.png": make.png(COLOR + 2),
        "oak_height.png": make.png(GREY),
        "oak_normal_dx.png": make.png(BLUE),
        "oak_normal_gl.png": make.png(BLUE + 1),
        "body_color.1002.png": make.png(COLOR + 3),
        "readme.txt": b"CC0",
        "cover.png": make.png(COLOR + 4),
    }
    info = store.add(zipped(files))
    imported = store.materials(info.id)
    assert list(imported.document["materials"]) == ["oak", "stone", "wood"]
    notes = {note["pointer"]: note["detail"] for note in imported.warnings}
    assert notes.keys() == {"oak_height.png", "oak_normal_dx.png", "body_color.1002.png", "readme.txt", "cover.png"}
    assert "oak_normal_gl.png" in notes["oak_normal_dx.png"] and "UDIM" in notes["body_color.1002.png"]
    assert "0.02 m from black to white are assumed" in notes["oak_height.png"]
    assert imported.document["materials"]["oak"]["height"]["scale"] == 0.02


@pytest.mark.parametrize(
    ("stem", "note", "scale"),
    [
        ("Plaster_200x250cm_2K", None, [0.5, 0.4]),
        ("Plaster_2.5x2m", None, [0.4, 0.5]),
        ("Plaster_2x2_1024x1024", None, None),
        ("Plaster_0x2m", None, None),
        ("vglkdeh_4K", {"physicalSize": "2x4"}, [0.5, 0.25]),
        ("vglkdeh_4K", {"meta": [{"key": "scanArea", "value": "2 x 4 m"}, 3]}, [0.5, 0.25]),
        ("vglkdeh_4K", {"physicalSize": "large", "meta": 3}, None),
        ("vglkdeh_4K", [["physicalSize", "2x4"]], None),
    ],
)
def test_real_sizes_become_scales(store: AssetStore, stem: str, note: Any, scale: list[float] | None) -> None:
    notes = {} if note is None else {"set/vglkdeh.json": json.dumps(note).encode()}
    files = {f"set/{stem}_Color.png": make.png(COLOR), f"set/{stem}_Roughness.png": make.png(GREY)}
    document = added(store, files | notes)
    assert len(document["textures"]) == 2
    assert all(each.get("scale") == scale for each in document["textures"].values())


def test_a_zip_without_such_images_is_refused(store: AssetStore) -> None:
    with pytest.raises(AssetError, match="no images whose names say what they are"):
        store.add(zipped({"IMG_1.png": make.png(COLOR)}))
    with pytest.raises(AssetError, match=r"a_color\.png"):
        store.add(zipped({"a_color.png": make.png(COLOR)[:60], "a_rough.png": make.png(GREY)}))
    with pytest.raises(AssetError, match=r"a_gloss\.png: the file is cut off"):
        store.add(zipped({"a_color.png": make.png(COLOR), "a_gloss.png": make.png(GREY)[:60]}))
    with pytest.raises(NotFound, match="holds materials"):
        store.scene(store.add(zipped({"b_color.png": make.png(COLOR)})).id)


def test_the_materials_are_served_and_a_restart_has_them(server: Server) -> None:
    files = {"Oak_Color.png": make.png(COLOR), "Oak_Roughness.png": make.png(GREY), "Oak_AO.png": make.png(GREY + 1)}
    answer = server.http.post("/v1/assets", content=zipped(files))
    assert answer.status_code == 201 and answer.json()["kind"] == "materials"
    assert [note["pointer"] for note in answer.json()["warnings"]] == ["Oak_AO.png"]
    found = server.http.get(f"/v1/assets/{answer.json()['id']}/materials").json()
    assert found["materials"] == {
        "Oak": {
            "type": "principled",
            "base_color": {"texture": "Oak_Color"},
            "roughness": {"texture": "Oak_Roughness"},
        }
    }
    assert found["warnings"] == answer.json()["warnings"]
    saved = {name: found[name] for name in ("materials", "textures")}
    assert server.http.put("/v1/documents/materials/oak", json=saved).status_code in (200, 201, 204)
    server.http.delete("/v1/documents/materials/oak")
    image = found["textures"]["Oak_Color"]["asset"]
    assert server.http.get(f"/v1/assets/{image}/materials").status_code == 404
    assert server.http.get(f"/v1/assets/{answer.json()['id']}/scene").status_code == 404


def test_the_command_writes_the_material_of_a_zip_or_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    folder, packed = tmp_path / "oak", tmp_path / "oak.zip"
    folder.mkdir()
    for name in ("oak_color", "oak_rough", "oak_ao"):
        (folder / f"{name}.png").write_bytes(make.png(COLOR))
    (folder / "readme.txt").write_text("CC0")
    packed.write_bytes(zipped({path.name: path.read_bytes() for path in folder.iterdir()}))
    for source in (folder, packed):
        target = tmp_path / f"{source.suffix or 'folder'}.json"
        assert main(["import", str(source), "-o", str(target)]) == 0
        assert "oak_ao.png: ambient occlusion is left out" in capsys.readouterr().err
        document = json.loads(target.read_text())
        assert document.keys() == {"materials", "textures"}
        assert document["materials"]["oak"].keys() == {"type", "base_color", "roughness"}
        for texture in document["textures"].values():
            assert (tmp_path / texture["asset"]).read_bytes() == make.png(COLOR)
    assert main(["render", str(packed), "-o", str(tmp_path / "a.png")]) == 2
    assert "holds materials and no shapes" in capsys.readouterr().err
    (empty := tmp_path / "empty").mkdir()
    assert main(["import", str(empty), "-o", str(tmp_path / "e.json")]) == 2


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_images_of_more_than_8_bits_are_turned_as_well(store: AssetStore, kind: str) -> None:
    """Gloss into roughness, and DirectX's normals, in 16 bits."""
    values = np.random.default_rng(3).integers(0, 65536, (5, 7, 3), np.uint16)
    data = make.png(values) if kind == "png" else make.exr((values / 65535).astype(np.float32))
    document = store.materials(store.add(zipped({f"oak_nor_dx.{kind}": data, f"oak_gloss.{kind}": data})).id).document
    normal, rough = (
        store.image(document["textures"][document["materials"]["oak"][member]["texture"]]["asset"])
        for member in ("normal_map", "roughness")
    )
    assert not normal.is_8bit and not rough.is_8bit
    expected = values / 65535
    assert np.abs(rough.pixels[..., 0] - (1 - expected[..., 0])).max() < 2e-5
    expected[..., 1] = 1 - expected[..., 1]
    assert np.abs(normal.pixels - expected).max() < 2e-5
