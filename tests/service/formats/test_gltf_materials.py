"""glTF's materials and textures as the contract's."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from service.document import parse_scene
from service.formats.scene_import import Imported
from service.pack import pack
from service.server.assets import AssetStore
from tests.gltf_files import QUAD, QUAD_UVS, Gltf
from tests.service.formats.scenes import imported, noted

PIXELS = np.arange(4 * 4 * 4, dtype=np.uint8).reshape(4, 4, 4) * 4


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


def material(store: AssetStore, description: dict[str, Any], file: Gltf | None = None) -> dict[str, Any]:
    (made,) = imported(store, (file or Gltf()).of(description)).document["materials"].values()
    assert isinstance(made, dict)
    return made


def with_extension(store: AssetStore, name: str, extension: dict[str, Any], **more: Any) -> dict[str, Any]:
    return material(store, {"extensions": {f"KHR_materials_{name}": extension}, **more})


def test_defaults_are_the_specification_s(store: AssetStore) -> None:
    white = {"type": "principled", "base_color": 1, "metallic": 1, "roughness": 1}
    assert material(store, {}) == white
    file = Gltf()
    file.node(mesh=file.mesh())
    assert list(imported(store, file).document["materials"].values()) == [white]


def test_textures_by_channel_and_space(store: AssetStore) -> None:
    file = Gltf()
    color, data = file.texture(PIXELS), file.texture(PIXELS[:, ::-1].copy())
    description = {
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": color},
            "baseColorFactor": [1, 0.5, 0.25, 0.5],
            "metallicRoughnessTexture": {"index": data},
            "roughnessFactor": 0.75,
        },
        "normalTexture": {"index": data, "scale": 0.5},
        "emissiveTexture": {"index": color},
        "emissiveFactor": [1, 1, 0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
        "occlusionTexture": {"index": data},
        "alphaMode": "BLEND",
        "doubleSided": True,
    }
    found = imported(store, file.of(description))
    (made,) = found.document["materials"].values()
    textures = found.document["textures"]
    assert made["base_color"]["factor"] == [1, 0.5, 0.25] and made["emission"]["factor"] == [4, 4, 0]
    assert made["emission_sides"] == "both" and found.document["shapes"][0]["double_sided"] is True
    assert made["alpha"] == {"texture": made["base_color"]["texture"], "channel": "a", "factor": 0.5}
    assert (made["metallic"]["channel"], made["roughness"]["channel"]) == ("b", "g")
    assert (made["metallic"]["factor"], made["roughness"]["factor"]) == (1, 0.75)
    assert made["normal_map"]["scale"] == 0.5 and "alpha_cutoff" not in made
    assert textures[made["base_color"]["texture"]]["color_space"] == "srgb"
    assert textures[made["normal_map"]["texture"]]["color_space"] == "linear" and len(textures) == 2
    assert np.array_equal(store.image(textures[made["base_color"]["texture"]]["asset"]).pixels, PIXELS)
    assert "traced" in noted(found)["/materials/0/occlusionTexture"]


def test_alpha_modes(store: AssetStore) -> None:
    half = {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}
    assert "alpha" not in material(store, half)
    masked = material(store, half | {"alphaMode": "MASK"})
    assert (masked["alpha"], masked["alpha_cutoff"]) == (0.5, 0.5)
    assert material(store, half | {"alphaMode": "MASK", "alphaCutoff": 0.2})["alpha_cutoff"] == 0.2
    assert material(store, half | {"alphaMode": "MASK", "alphaCutoff": 1.5})["alpha"] == 0
    assert material(store, half | {"alphaMode": "BLEND"})["alpha"] == 0.5


@pytest.mark.parametrize("seed", range(4))
def test_texture_transform(store: AssetStore, seed: int) -> None:
    """Where the specification's matrix reads the image, with v downwards, ours reads it with v upwards."""
    rng = np.random.default_rng(seed)
    offset, scale, turn = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2), float(rng.uniform(-4, 4))
    transform = {"offset": offset.tolist(), "scale": scale.tolist(), "rotation": turn}
    file = Gltf()
    file.of(
        {
            "pbrMetallicRoughness": {
                "baseColorTexture": {
                    "index": file.texture(PIXELS, sampler=file.add("samplers", {"wrapS": 33071, "wrapT": 33071})),
                    "extensions": {"KHR_texture_transform": transform},
                }
            }
        }
    )
    (texture,) = imported(store, file).document["textures"].values()
    assert texture["wrap"] == "clamp"
    u, v = rng.random((2, 10))
    c, s = math.cos(turn), math.sin(turn)
    x, y = scale[0] * u, scale[1] * v
    expected = np.stack([c * x + s * y + offset[0], 1 - (-s * x + c * y + offset[1])])
    a = math.radians(texture["rotation"])
    x, y = texture["scale"][0] * u, texture["scale"][1] * (1 - v)
    ours = [math.cos(a) * x - math.sin(a) * y, math.sin(a) * x + math.cos(a) * y]
    assert np.allclose(ours + np.array(texture["offset"])[:, None], expected)


def test_a_texture_without_its_coordinates_is_left_out_and_told(store: AssetStore) -> None:
    """There only: a mesh that has them keeps it."""
    file = Gltf()
    number = file.add(
        "materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": file.texture(PIXELS), "texCoord": 1}}}
    )
    both = {"POSITION": QUAD, "TEXCOORD_0": QUAD[:, :2].copy(), "TEXCOORD_1": QUAD[:, :2].copy()}
    file.node(mesh=file.mesh(file.primitive(material=number), file.primitive(both, material=number)))
    found = imported(store, file)
    bare, full = (found.document["materials"][shape["material"]] for shape in found.document["shapes"])
    assert bare["base_color"] == 1 and found.document["textures"][full["base_color"]["texture"]]["uv"] == 1
    assert "no TEXCOORD_1" in noted(found)["/materials/0/pbrMetallicRoughness/baseColorTexture"]


def test_unlit_is_seen_as_it_is(store: AssetStore) -> None:
    made = with_extension(store, "unlit", {}, pbrMetallicRoughness={"baseColorFactor": [0.2, 0.4, 0.6, 1]})
    assert made == {"type": "diffuse", "albedo": 0, "emission": [0.2, 0.4, 0.6]}


def test_clearcoat_and_sheen(store: AssetStore) -> None:
    coat = with_extension(store, "clearcoat", {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.2})
    assert (coat["clearcoat"], coat["clearcoat_roughness"]) == (0.5, 0.2)
    file = Gltf()
    texture = {"index": file.texture(PIXELS)}
    extension = {
        "clearcoatFactor": 1,
        "clearcoatTexture": texture,
        "clearcoatRoughnessTexture": texture,
        "clearcoatRoughnessFactor": 1,
        "clearcoatNormalTexture": texture,
    }
    coat = material(store, {"extensions": {"KHR_materials_clearcoat": extension}}, file)
    assert (coat["clearcoat"]["channel"], coat["clearcoat_roughness"]["channel"]) == ("r", "g")
    assert "texture" in coat["clearcoat_normal_map"] and "normal_map" not in coat
    sheen = with_extension(store, "sheen", {"sheenColorFactor": [1, 0, 0], "sheenRoughnessFactor": 0.3})
    assert (sheen["sheen"], sheen["sheen_color"], sheen["sheen_roughness"]) == (1, [1, 0, 0], 0.3)


def test_glass_with_a_volume_refracts(store: AssetStore) -> None:
    made = material(
        store,
        {
            "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_ior": {"ior": 1.33},
                "KHR_materials_volume": {
                    **{"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.5, 1, 1]},
                },
            },
        },
    )
    assert (made["transmission"], made["ior"], made["attenuation_distance"]) == (1, 1.33, 2)
    assert made["attenuation_color"] == [0.5, 1, 1] and "clearcoat" not in made


def test_transmission_without_a_volume_is_a_thin_wall(store: AssetStore) -> None:
    made = with_extension(
        store,
        "transmission",
        {"transmissionFactor": 0.9},
        pbrMetallicRoughness={"metallicFactor": 0, "roughnessFactor": 0},
    )
    assert (made["transmission"], made["thin_walled"]) == (0.9, True)
    assert not {"ior", "clearcoat"} & made.keys()


def test_the_abbe_number_is_20_over_the_dispersion(store: AssetStore) -> None:
    body = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}}
    for dispersion, abbe in ((0.5, 40), (0, None)):
        given = {"extensions": {**body, "KHR_materials_dispersion": {"dispersion": dispersion}}}
        assert material(store, given).get("abbe") == abbe


def test_leaves_pass_diffuse_light(store: AssetStore) -> None:
    name = "diffuse_transmission"
    made = with_extension(store, name, {"diffuseTransmissionFactor": 0.4})
    assert made["thin_walled"] is True and made["diffuse_transmission"] == 0.4
    assert made["diffuse_transmission_color"] == 1, "the extension's own default, whatever the base colour is"
    made = with_extension(
        store, name, {"diffuseTransmissionFactor": 1, "diffuseTransmissionColorFactor": [0.5, 1, 0]}
    )
    assert made["diffuse_transmission_color"] == [0.5, 1, 0]
    assert "thin_walled" not in with_extension(store, name, {"diffuseTransmissionColorFactor": [0.5, 1, 0]})


def test_specular_sets_the_reflectance_head_on(store: AssetStore) -> None:
    """F0 = ((ior - 1) / (ior + 1))^2 weight colour."""
    made = with_extension(store, "specular", {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 0]})
    f0 = ((made["ior"] - 1) / (made["ior"] + 1)) ** 2
    assert f0 == pytest.approx(0.02) and made["specular_color"] == [1, 0.5, 0]
    assert with_extension(store, "specular", {"specularFactor": 0})["ior"] == 1
    bright = with_extension(store, "specular", {"specularColorFactor": [4, 2, 0]})
    assert ((bright["ior"] - 1) / (bright["ior"] + 1)) ** 2 == pytest.approx(0.16)
    assert bright["specular_color"] == [1, 0.5, 0]


def test_anisotropy_has_the_specification_s_widths(store: AssetStore) -> None:
    """alpha along = mix(r^2, 1, strength^2), across = r^2."""
    strength, roughness = 0.6, 0.4
    made = with_extension(
        store,
        "anisotropy",
        {"anisotropyStrength": strength, "anisotropyRotation": 0.5},
        pbrMetallicRoughness={"roughnessFactor": roughness},
    )
    aspect = math.sqrt(1 - 0.9 * made["anisotropic"])
    along, across = made["roughness"] ** 2 / aspect, made["roughness"] ** 2 * aspect
    assert along == pytest.approx(roughness**2 + (1 - roughness**2) * strength**2)
    assert across == pytest.approx(roughness**2)
    assert made["anisotropic_rotation"] == pytest.approx(math.degrees(0.5))


def test_specular_glossiness(store: AssetStore) -> None:
    """A black dielectric's 4 % are no metal; a colour that only reflects is one."""
    name = "pbrSpecularGlossiness"
    dull = {"diffuseFactor": [0.5, 0.2, 0.1, 1], "specularFactor": [0.04] * 3, "glossinessFactor": 0.25}
    made = with_extension(store, name, dull)
    assert made["metallic"] == pytest.approx(0, abs=1e-6) and made["roughness"] == 0.75
    assert made["base_color"] == pytest.approx([0.5, 0.2, 0.1], abs=1e-6)
    gold = with_extension(store, name, {"diffuseFactor": [0, 0, 0, 1], "specularFactor": [1, 0.77, 0.34]})
    assert gold["metallic"] == pytest.approx(1) and gold["base_color"] == pytest.approx([1, 0.77, 0.34], abs=1e-6)


def test_specular_glossiness_textures_are_converted(store: AssetStore) -> None:
    """Left a dielectric, right gold, in one image each."""
    file = Gltf()
    diffuse, shiny = np.zeros((1, 2, 4), np.uint8), np.zeros((1, 2, 4), np.uint8)
    diffuse[0, :] = [[200, 100, 50, 90], [0, 0, 0, 255]]
    shiny[0, :] = [[56, 56, 56, 64], [255, 226, 158, 255]]  # sRGB of 0.04 and of gold; glossiness in alpha
    extension = {
        "diffuseTexture": {"index": file.texture(diffuse)},
        "specularGlossinessTexture": {"index": file.texture(shiny)},
    }
    file.of({"extensions": {"KHR_materials_pbrSpecularGlossiness": extension}, "alphaMode": "BLEND"})
    document = imported(store, file).document
    (made,) = document["materials"].values()
    color = store.image(document["textures"][made["base_color"]["texture"]]["asset"]).pixels[0]
    rough = store.image(document["textures"][made["roughness"]["texture"]]["asset"]).pixels[0]
    assert np.abs(color[0].astype(int) - [200, 100, 50, 90]).max() <= 1
    assert np.abs(color[1].astype(int) - [255, 226, 158, 255]).max() <= 1
    assert rough[:, 1].tolist() == [191, 0] and rough[0, 2] <= 1 and rough[1, 2] == 255
    assert (made["roughness"]["channel"], made["metallic"]["channel"], made["alpha"]["channel"]) == ("g", "b", "a")


def test_factors_beyond_their_range_are_lowered_with_a_word(store: AssetStore) -> None:
    rough = {"pbrMetallicRoughness": {"baseColorFactor": [2, 0.5, 0.5, 3]}, "alphaMode": "BLEND"}
    found = imported(store, Gltf().of(rough))
    (document,) = found.document["materials"].values()
    assert document["base_color"] == [1, 0.5, 0.5] and "alpha" not in document
    assert list(noted(found)) == ["/materials/0/pbrMetallicRoughness/baseColorFactor"]


def test_an_image_without_alpha_is_opaque(store: AssetStore) -> None:
    """Most pictures of faded materials are JPEGs; alphas of the extensions likewise."""
    shown = (("BLEND", 1), ("BLEND", 0.25), ("MASK", 0.25))
    for channels, textured in ((1, False), (3, False), (4, True)):
        for mode, alpha in shown:
            file = Gltf()
            texture = {"index": file.texture(PIXELS[..., :channels])}
            rough = {"baseColorTexture": texture, "baseColorFactor": [1, 1, 1, alpha]}
            sheen = {"sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": texture}
            made = material(store, {"pbrMetallicRoughness": rough, "alphaMode": mode,
                                    "extensions": {"KHR_materials_sheen": sheen}}, file)  # fmt: skip
            if textured:
                assert made["alpha"]["channel"] == "a" and made["sheen_roughness"]["channel"] == "a"
            else:
                assert made.get("alpha", 1) == alpha and made["sheen_roughness"] == 0.5
            pack(parse_scene(store.scene(store.add(file.glb()).id).document), store)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_grey_normal_map_is_left_out_with_a_word(store: AssetStore, dtype: Any) -> None:
    file = Gltf()
    found = imported(store, file.of({"normalTexture": {"index": file.texture(PIXELS[..., :1].astype(dtype))}}))
    assert noted(found) == {"/materials/0/normalTexture": "a grey image is not a normal map; it is left out"}


def test_what_is_brushed_needs_a_direction(store: AssetStore) -> None:
    """Texture coordinates, or tangents."""
    rows = {"POSITION": QUAD, "NORMAL": np.tile(np.array([[0, 0, 1]], "<f4"), (4, 1))}
    tangents = {"TANGENT": np.tile(np.array([[1, 0, 0, 1]], "<f4"), (4, 1))}
    for given, brushed in ((rows, False), (rows | tangents, True)):
        file = Gltf()
        extension = {"KHR_materials_anisotropy": {"anisotropyStrength": 0.5}}
        rough = {"roughnessFactor": 0.4}
        made = file.add("materials", {"extensions": extension, "pbrMetallicRoughness": rough})
        file.node(mesh=file.mesh(file.primitive(given, material=made)))
        found = imported(store, file)
        (document,) = found.document["materials"].values()
        assert ("anisotropic" in document) == brushed and bool(found.warnings) != brushed


@pytest.mark.parametrize(("factor", "depth", "type"), [(1, 0, "principled"), (0.25, 0, "openpbr"),
                                                       (0.25, 2, "principled")])  # fmt: skip
def test_glass_of_one_texture(store: AssetStore, factor: float, depth: float, type: str) -> None:
    """Colour and alpha of a texture stay its own on either model; openpbr has no tint beside an attenuation, which
    weighs as much as a part of a film."""
    file = Gltf()
    base = {"baseColorTexture": {"index": file.texture(PIXELS)}, "baseColorFactor": [1, 0.5, 1, 0.5]}
    volume: dict[str, Any] = {"thicknessFactor": 1}
    if depth:
        volume |= {"attenuationDistance": depth, "attenuationColor": [1, 0, 0]}
    extensions = {
        "KHR_materials_transmission": {"transmissionFactor": 0.5}, "KHR_materials_volume": volume,
        "KHR_materials_iridescence": {"iridescenceFactor": factor},
    }  # fmt: skip
    glass = {"pbrMetallicRoughness": base, "extensions": extensions, "alphaMode": "BLEND"}
    found = imported(store, file.of(glass))
    (made,) = found.document["materials"].values()
    opacity = made["geometry_opacity" if type == "openpbr" else "alpha"]
    assert (made["type"], made["base_color"]["factor"]) == (type, [1, 0.5, 1])
    assert (opacity["channel"], opacity["factor"]) == ("a", 0.5)
    if type == "openpbr":
        assert made["transmission_color"] == made["base_color"] and made["transmission_weight"] == 0.5
    film = "/materials/0/extensions/KHR_materials_iridescence"
    assert (f"{film}/iridescenceFactor" in noted(found)) == (factor < 1 and type == "principled")


@pytest.mark.parametrize("across", [10497, 33071, 33648])
@pytest.mark.parametrize("down", [10497, 33071, 33648])
def test_each_axis_wraps_as_its_sampler_says(store: AssetStore, across: int, down: int) -> None:
    file = Gltf()
    sampler = file.add("samplers", {"wrapS": across, "wrapT": down})
    texture = {"index": file.texture(PIXELS[..., :3], sampler=sampler)}
    made = file.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": texture}})
    for reach in ((1, 1), (1, 3), (3, 1)):
        uvs = QUAD_UVS * np.float32(reach)
        file.node(mesh=file.mesh(file.primitive({"POSITION": QUAD, "TEXCOORD_0": uvs}, material=made)))
    found = imported(store, file)
    words = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
    (document,) = found.document["textures"].values()
    assert document["wrap"] == (words[across] if across == down else [words[across], words[down]])
    assert parse_scene(found.document).textures and not found.warnings


def brushed(store: AssetStore, directions: np.ndarray, strength: Any = 255) -> tuple[dict[str, Any], Imported]:
    """The material of an anisotropy texture that points at these angles (h, w), in degrees."""
    texels = np.zeros((*directions.shape, 3), np.uint8)
    texels[..., 0], texels[..., 1] = (np.rint((f(np.radians(directions)) + 1) / 2 * 255) for f in (np.cos, np.sin))
    texels[..., 2] = strength
    file = Gltf()
    extension = {"anisotropyStrength": 1, "anisotropyRotation": math.radians(20),
                 "anisotropyTexture": {"index": file.texture(texels)}}  # fmt: skip
    found = imported(store, file.of({"extensions": {"KHR_materials_anisotropy": extension},
                                     "pbrMetallicRoughness": {"roughnessFactor": 0.4}}))  # fmt: skip
    (made,) = found.document["materials"].values()
    return made, found


def test_directions_of_an_anisotropy_texture_become_angles(store: AssetStore) -> None:
    directions = np.linspace(-170, 180, 64).reshape(8, 8)
    made, found = brushed(store, directions)
    turned = made["anisotropic_rotation"]
    image = store.image(found.document["textures"][turned["texture"]]["asset"]).pixels
    assert image.shape == (8, 8, 1) and found.document["textures"][turned["texture"]]["color_space"] == "linear"
    angles = image[..., 0] / 255 * turned["factor"]
    off = (angles - directions - 20 + 90) % 180 - 90  # a stretch has no sense
    assert np.abs(off).max() < 1.2
    assert any("directions are converted to angles" in detail for detail in noted(found).values())
    # All the same, or the same where there is any strength: a number.
    made, _ = brushed(store, np.full((4, 4), 30.0))
    assert made["anisotropic_rotation"] % 180 == pytest.approx(50, abs=0.5)
    strength = np.zeros((8, 8), np.uint8)
    strength[2, 3] = 200
    made, _ = brushed(store, directions, strength)
    assert made["anisotropic_rotation"] % 180 == pytest.approx((directions[2, 3] + 20) % 180, abs=0.5)
    assert brushed(store, directions, 0)[0]["anisotropic_rotation"] == pytest.approx(20)
