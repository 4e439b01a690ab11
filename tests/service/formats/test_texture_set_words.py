"""Names of two words, initials, sizes and folders: which material an image belongs to, and which channels it has."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.formats.read.texture_sets.names import meaning
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.obj_files import zipped

RGB = np.full((4, 4, 3), (200, 100, 50), np.uint8)
RGBA = np.full((4, 4, 4), (200, 100, 50, 128), np.uint8)


def read(store: AssetStore, names: str, texels: np.ndarray = RGBA) -> tuple[dict[str, Any], list[str]]:
    """The materials of a zip of images with these names, without their types; and what is told."""
    files = {f"{name}.png": make.png(texels + np.uint8(k)) for k, name in enumerate(names.split())}
    imported = store.materials(store.add(zipped(files)).id)
    materials = {
        name: {
            member: value["texture"] + (f" {value['channel']}" if "channel" in value else "")
            for member, value in material.items()
            if member not in ("type", "height")
        }
        for name, material in imported.document["materials"].items()
    }
    return materials, [note["detail"] for note in imported.warnings]


@pytest.mark.parametrize("flow", ["METALNESS", "SPECULAR"])
def test_poliigon_says_the_workflow_after_the_size(store: AssetStore, flow: str) -> None:
    materials, warnings = read(
        store, " ".join(f"Sand002_{what}_2K_{flow}" for what in ("COL", "NRM", "ROUGHNESS", flow)), RGB
    )
    assert materials == {
        "Sand002": {
            "base_color": f"Sand002_COL_2K_{flow}",
            "normal_map": f"Sand002_NRM_2K_{flow}",
            "roughness": f"Sand002_ROUGHNESS_2K_{flow}",
            "metallic" if flow == "METALNESS" else "specular": f"Sand002_{flow}_2K_{flow}",
        }
    }
    assert not warnings
    found = meaning("Sand002_2K_METALNESS")
    assert found is not None and list(found.channels) == ["metallic"], "no other word says what it is of"


@pytest.mark.parametrize(
    ("name", "channels"),
    [
        ("ORM", "occlusion r, roughness g, metallic b"), ("AORM", "occlusion r, roughness g, metallic b"),
        ("MRAO", "metallic r, roughness g, occlusion b"), ("RAM", "roughness r, occlusion g, metallic b"),
        ("Metallic_Roughness_AO", "metallic r, roughness g, occlusion b"),
        ("AO_Metallic_Roughness", "occlusion r, metallic g, roughness b"),
        ("MetallicRoughness", "roughness g, metallic b"), ("Metallic Gloss", "metallic r, gloss a"),
        ("SpecularSmoothness", "specular , gloss a"), ("SpecularGlossiness", "specular , gloss a"),
        ("BaseColor_Alpha", "color , opacity a"), ("DiffuseOpacity", "color , opacity a"),
        ("TransmissionColor", "other "), ("NormalWS", "other "), ("World Space Normal", "other "),
        ("normal_object", "other "),
        ("Mixed_AO", "occlusion "), ("Dif", "color "), ("SPC", "specular "), ("Glossy", "gloss "),
    ],
)  # fmt: skip
def test_words_and_initials(name: str, channels: str) -> None:
    found = meaning(f"Old_Wood_{name}")
    assert found is not None and found.material == "Old_Wood"
    assert ", ".join(f"{role} {channel}" for role, channel in found.channels.items()) == channels


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ("Helmet_albedo Helmet_metalRoughness",
         {"Helmet": {"base_color": "Helmet_albedo", "roughness": "Helmet_metalRoughness g",
                     "metallic": "Helmet_metalRoughness b"}}),
        ("Rusty_Metal_Color Rusty_Metal_Roughness",
         {"Rusty_Metal": {"base_color": "Rusty_Metal_Color", "roughness": "Rusty_Metal_Roughness"}}),
        ("Rusty_Color Rusty_Metal_Color Rusty_Metal_Roughness",
         {"Rusty": {"base_color": "Rusty_Color"},
          "Rusty_Metal": {"base_color": "Rusty_Metal_Color", "roughness": "Rusty_Metal_Roughness"}}),
        ("wood_baseColor wood_specularRoughness",
         {"wood": {"base_color": "wood_baseColor", "roughness": "wood_specularRoughness"}}),
        ("wood_diffuse wood_diffuse_normal wood_diffuse_rough",
         {"wood": {"base_color": "wood_diffuse", "normal_map": "wood_diffuse_normal",
                   "roughness": "wood_diffuse_rough"}}),
        ("Wood_041_basecolor Wood_042_basecolor Wood_042_2048_rough",
         {"Wood_041": {"base_color": "Wood_041_basecolor"},
          "Wood_042": {"base_color": "Wood_042_basecolor", "roughness": "Wood_042_2048_rough"}}),
        ("Oak/textures/color Oak/2K/normal Pine/Maps/color",
         {"Oak": {"base_color": "color", "normal_map": "normal"}, "Pine": {"base_color": "color 2"}}),
    ],
)  # fmt: skip
def test_images_come_to_the_material_of_their_set(
    store: AssetStore, names: str, expected: dict[str, dict[str, str]]
) -> None:
    assert read(store, names)[0] == expected


def test_alpha_is_read_where_there_is_one(store: AssetStore) -> None:
    names = "a_AlbedoTransparency a_MetallicSmoothness"
    full, none = (read(store, names, texels) for texels in (RGBA, RGB))
    colour = {"base_color": "a_AlbedoTransparency"}
    metal = {"metallic": "a_MetallicSmoothness r"}
    rough = {"roughness": "a_MetallicSmoothness as roughness"}
    assert full == ({"a": colour | {"alpha": "a_AlbedoTransparency a"} | metal | rough}, [])
    assert none[0] == {"a": colour | metal}
    assert none[1] == [
        f"it has no alpha channel, from which its {what} would be read" for what in ("opacity", "gloss")
    ]


def test_alpha_that_no_name_explains_is_told(store: AssetStore) -> None:
    said = ["its alpha is left out: no image's name says that it is the opacity"]
    assert read(store, "leaf_color leaf_rough")[1] == said
    assert read(store, "leaf_color leaf_opacity")[1] == []
    assert read(store, "leaf_color leaf_rough", RGB)[1] == []
    opaque = np.concatenate([RGB, np.full((4, 4, 1), 255, np.uint8)], axis=2)
    assert read(store, "leaf_color", opaque)[1] == []
