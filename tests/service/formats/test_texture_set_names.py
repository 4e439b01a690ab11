"""Names of several words, tiles, and the names of images that are left out."""

from __future__ import annotations

import numpy as np
import pytest

from service.formats.read.texture_sets.names import meaning, tiles_within
from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.obj_files import zipped

# What an image is of, in words; each is one name however its words are parted.
NAMES = {
    "opacity": ("Opacity Mask", "Opacity Map", "Alpha Mask", "Transparency Mask", "Cutout Opacity", "Alpha Map"),
    "occlusion": ("Ambient Occlusion", "Ambient Occlusion Map", "AO Map", "Occlusion Map"),
    "color": ("Base Color", "Base Colour", "Base Color Map", "Diffuse Color", "Diffuse Map", "Albedo Map", "Base Map",
              "Color Map", "Base Col"),
    "normal": ("Normal Map", "Normals Map", "Normal", "Normal Texture"),
    "normal gl": ("Normal GL", "Normal OpenGL", "Normal Open GL", "OpenGL Normal", "Normal Map GL", "Normal Map OGL"),
    "normal dx": ("Normal DX", "Normal DirectX", "Normal Direct X", "DirectX Normal", "Normal Map DX",
                  "DX Normal Map"),
    "metallic": ("Metal ness", "Metalness", "Metallic", "Metallic Map", "Metalness Map", "Metallic Mask"),
    "roughness": ("Roughness", "Roughness Map", "Rough ness", "Rough"),
    "height": ("Height Map", "Displacement", "Displacement Map", "Bump Map", "Disp"),
    "emission": ("Emissive", "Emissive Color", "Emission Map", "Emission Color", "Emissive Mask", "Glow Map"),
    "specular": ("Specular Color", "Specular Level", "Specular Map", "Reflection Map"),
    "gloss": ("Gloss Map", "Glossiness", "Smoothness Map"),
}  # fmt: skip
EVERY = [(role, name) for role, names in NAMES.items() for name in names]


@pytest.mark.parametrize(("said", "name"), EVERY, ids=[name for _, name in EVERY])
def test_a_name_of_several_words_is_one_however_they_are_parted(said: str, name: str) -> None:
    role, _, mark = said.partition(" ")
    words = name.split()
    for written in (
        name,
        "_".join(words),
        "-".join(words),
        "".join(words),
        name.upper(),
        name.lower().replace(" ", "_"),
    ):
        for before, after in (
            ("Old Wood ", ""),
            ("Old Wood_", "_2K"),
            ("Old-Wood_4096_", ""),
            ("old_wood_2K-JPG_", ""),
        ):
            found = meaning(f"{before}{written}{after}")
            assert found is not None and list(found.channels) == [role], (before, written, after)
            assert found.material.lower() == "old_wood", (before, written, after)
            assert found.directx is ({"gl": False, "dx": True}.get(mark)), (before, written, after)
    for written in ("".join(words).lower(), name, "_".join(words)):
        found = meaning(written)
        assert found is not None and list(found.channels) == [role] and found.material == "", written


@pytest.mark.parametrize(
    "name", ["ORM Map", "Ambient Occlusion Roughness Metallic", "Occlusion Roughness Metalness Map"]
)
def test_packed_images_have_such_names_too(name: str) -> None:
    for written in (name, name.replace(" ", "_"), name.replace(" ", "")):
        found = meaning(f"Old Wood {written}")
        assert found is not None and found.material == "Old_Wood"
        assert found.channels == {"occlusion": "r", "roughness": "g", "metallic": "b"}


def test_a_mask_beside_its_set_is_its_opacity(store: AssetStore) -> None:
    names = ("Old Wood Base Color", "old-wood_Opacity-Mask", "Old_Wood_NormalMap", "OldWood Ambient Occlusion")
    colours = {f"{name}.png": make.png(np.full((4, 4, 3), 40 * k + 20, np.uint8)) for k, name in enumerate(names)}
    imported = store.materials(store.add(zipped(colours)).id)
    ((name, material),) = imported.document["materials"].items()
    assert name == "Old_Wood" and material.keys() == {"type", "base_color", "alpha", "normal_map"}
    assert material["alpha"]["texture"] == "old-wood_Opacity-Mask"
    assert [note["pointer"] for note in imported.warnings] == ["OldWood Ambient Occlusion.png"]


@pytest.mark.parametrize(
    ("stem", "material", "tile"),
    [
        ("body_color.1001", "body", 1001),
        ("body_color_1012", "body", 1012),
        ("body_1003_color", "body", 1003),
        ("body.1003.BaseColor", "body", 1003),
        ("body_color_u1_v1", "body", 1001),
        ("body_color_u2_v3", "body", 1022),
        ("body_u0_v1_color", "body", 1011),
        ("body_color.<UDIM>", "body", 0),
        ("body_<udim>_color", "body", 0),
        ("body_color_1024", "body", None),
        ("body_color_2048", "body", None),
    ],
)
def test_tiles_by_their_names(stem: str, material: str, tile: int | None) -> None:
    found = meaning(stem, tiles_within(["body_1001_color", "body.1001.BaseColor", stem]))
    assert found is not None and list(found.channels) == ["color"]
    assert (found.material, found.tile) == (material, tile)


def test_a_number_is_no_tile_where_none_is_the_first() -> None:
    found = meaning("bricks_1050_color", tiles_within(["bricks_1050_color", "bricks_1050_rough"]))
    assert found is not None and found.tile is None and found.material == "bricks_1050"


def test_the_first_tile_is_shown_and_all_others_are_named(store: AssetStore) -> None:
    names = [f"body_{what}.{tile}.png" for what in ("color", "rough") for tile in range(1001, 1005)]
    files = {name: make.png(np.full((4, 4, 3), 10 * k + 5, np.uint8)) for k, name in enumerate(names)}
    imported = store.materials(store.add(zipped(files)).id)
    assert imported.document["materials"]["body"] == {
        "type": "principled",
        "base_color": {"texture": "body_color.1001"},
        "roughness": {"texture": "body_rough.1001"},
    }
    details = [note["detail"] for note in imported.warnings]
    assert all(detail.startswith("UDIM tiles are not supported") for detail in details)
    said = " ".join(note["pointer"] + note["detail"] for note in imported.warnings)
    assert all(name in said for name in names)
    alone = {name: data for name, data in files.items() if "1001" not in name}
    with pytest.raises(AssetError, match="UDIM tiles are not supported, and it has none that is tile 1001"):
        store.add(zipped(alone))


def test_images_that_are_left_out_are_named(store: AssetStore) -> None:
    odd = {f"IMG_{k}.png": make.png(np.full((4, 4, 3), k, np.uint8)) for k in range(30)}
    files = {"a_color.png": make.png(np.full((4, 4, 3), 99, np.uint8)), "b.txt": b"1", "c.txt": b"2"}
    for some in (3, 20, 30):
        shown = dict(list(odd.items())[:some])
        notes = {note["detail"].split(" (also")[0]: note for note in store.add(zipped(files | shown)).warnings or ()}
        note = notes["the file's name does not say what the image is of; it is left out"]
        said = note["pointer"] + note["detail"]
        assert note["count"] == some and sum(name in said for name in shown) == min(some, 20)
        assert note["detail"].endswith(" and 10 more)") == (some == 30)
        (other,) = (note for detail, note in notes.items() if "not an image" in detail)
        assert other["pointer"] == "b.txt" and other["detail"].endswith("left out (also c.txt)")
