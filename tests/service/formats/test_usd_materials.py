"""Materials of USD files: UsdPreviewSurface with its textures."""

from __future__ import annotations

import numpy as np
import pytest

from service.colorimetry import decode_srgb, encode_srgb
from service.server.assets import AssetStore
from tests.usd_files import PNG, QUAD, material, mesh, texture, usda, usdz
from tests.usd_looks import CHANNELS, UV, worn

pytestmark = [pytest.mark.usd, pytest.mark.slow]


def test_constants(store: AssetStore) -> None:
    inputs = """
        color3f inputs:diffuseColor = (0.8, 0.4, 0.2)
        color3f inputs:emissiveColor = (0, 2, 0)
        float inputs:metallic = 0.25
        float inputs:roughness = 0.3
        float inputs:clearcoat = 1
        float inputs:clearcoatRoughness = 0.1
        float inputs:ior = 1.7
        float inputs:opacity = 0.5
        float inputs:opacityThreshold = 0.25
    """
    found, scene = worn(store, material("Look", inputs))
    assert found == {
        "type": "principled", "base_color": [0.8, 0.4, 0.2], "emission": [0, 2, 0], "metallic": 0.25,
        "roughness": 0.3, "clearcoat": 1, "clearcoat_roughness": 0.1, "ior": 1.7, "alpha": 0.5, "alpha_cutoff": 0.25,
    }  # fmt: skip
    assert not scene.warnings


def test_a_reflectance_of_its_own_becomes_an_index(store: AssetStore) -> None:
    inputs = "int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.09, 0.045, 0)"
    found, _ = worn(store, material("Look", inputs))
    assert ((found["ior"] - 1) / (found["ior"] + 1)) ** 2 == pytest.approx(0.09)
    assert found["specular_color"] == pytest.approx([1, 0.5, 0])


def test_textures_keep_their_channels_wraps_transforms_and_spaces(store: AssetStore) -> None:
    inputs = """
        color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>
        float inputs:roughness.connect = </Look/T.outputs:g>
        float inputs:occlusion.connect = </Look/T.outputs:r>
    """
    more = """
        token inputs:wrapS = "mirror"
        token inputs:wrapT = "repeat"
        float4 inputs:scale = (0.5, 0.25, 1, 1)
    """
    turn = """
    def Shader "X"
    {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </Look/R.outputs:result>
        float inputs:rotation = 90
        float2 inputs:scale = (2, 3)
        float2 inputs:translation = (0.5, 0)
        float2 outputs:result
    }"""
    found, scene = worn(
        store, material("Look", inputs, texture("Look", "a.png", more, "X") + turn), {"a.png": CHANNELS}
    )
    assert found["base_color"] == {"texture": "a", "factor": [0.5, 0.25, 1]}
    assert found["roughness"] == {"texture": "a", "channel": "g", "factor": 0.25}
    assert scene.document["textures"]["a"] | {"asset": ""} == {
        "asset": "", "color_space": "srgb", "wrap": ["mirror", "repeat"], "scale": [2, 3], "rotation": 90,
        "offset": [0.5, 0],
    }  # fmt: skip
    assert [warning["pointer"] for warning in scene.warnings] == ["/Look/S.inputs:occlusion"]


@pytest.mark.parametrize(("given", "reach", "wrap", "told"), [
    ('wrapS = "black"', (3, 1), ["clamp", "clamp"], ["wrapS"]),
    ('wrapT = "useMetadata"', (1, 3), ["clamp", "clamp"], ["wrapT"]),
    ('wrapT = "mirror"', (1, 3), ["clamp", "mirror"], []),
    ('wrapS = "black"', (1, 1), ["clamp", "clamp"], []),
    ("", (3, 3), ["clamp", "clamp"], ["wrapS"]),  # and wrapT: one warning of two places
    ('wrapS = "repeat"', (3, 3), ["repeat", "clamp"], ["wrapT"]),
])  # fmt: skip
def test_what_lies_beyond_an_image_is_told_where_it_is_seen(
    store: AssetStore, given: str, reach: tuple[int, int], wrap: list[str], told: list[str]
) -> None:
    """An image without a wrap is black there, as one with metadata that it does not have."""
    read = "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>"
    nodes = texture("Look", "a.png", f"token inputs:{given}" if given else "")
    chart = UV.replace("(1, 0)", f"({reach[0]}, 0)").replace("(0, 1)]", f"(0, {reach[1]})]", 1)
    root = usda(material("Look", read, nodes) + mesh("Sign", "rel material:binding = </Look>", body=QUAD + chart))
    found = store.scene(store.add(usdz({"root.usda": root, "a.png": PNG(CHANNELS)})).id)
    (document,) = found.document["textures"].values()
    assert document["wrap"] == (wrap[0] if wrap[0] == wrap[1] else wrap)
    assert [warning["pointer"] for warning in found.warnings] == [f"/Look/T.inputs:{name}" for name in told]


@pytest.mark.parametrize(("space", "pixels", "shown"), [
    ("auto", CHANNELS, "srgb"), ("raw", CHANNELS, "linear"), ("sRGB", CHANNELS, "srgb"),
    ("auto", CHANNELS[..., :1], "linear"), ("auto", CHANNELS.astype(np.uint16) * 257, "srgb"),
])  # fmt: skip
def test_colour_spaces(store: AssetStore, space: str, pixels: np.ndarray, shown: str) -> None:
    read = "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>"
    nodes = texture("Look", "a.png", f'token inputs:sourceColorSpace = "{space}"')
    _, scene = worn(store, material("Look", read, nodes), {"a.png": pixels})
    is_deep = pixels.dtype == np.uint16
    assert scene.document["textures"]["a"]["color_space"] == ("linear" if is_deep else shown)


def test_what_a_texture_cannot_say_is_baked(store: AssetStore) -> None:
    """A gloss turned into a roughness, and a colour with a bias: computed on linear values."""
    more = "float4 inputs:scale = (-1, -1, -1, 1)\nfloat4 inputs:bias = (1, 1, 1, 0)"
    read = "float inputs:roughness.connect = </Look/T.outputs:r>\n"
    read += "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>"
    nodes = texture("Look", "a.png", more)
    found, scene = worn(store, material("Look", read, nodes), {"a.png": CHANNELS})
    baked = {name: store.image(each["asset"]).pixels[0, 0] for name, each in scene.document["textures"].items()}
    expected = encode_srgb(1 - decode_srgb(np.array([200, 100, 50]) / 255)) * 255
    assert baked[found["base_color"]["texture"]] == pytest.approx(expected, abs=1)
    assert baked[found["roughness"]["texture"]][0] == pytest.approx(expected[0], abs=1)


@pytest.mark.parametrize(("green", "expected"), [(2, 200), (-2, 55)])
def test_normal_maps_of_both_conventions(store: AssetStore, green: int, expected: int) -> None:
    more = f"""
        float4 inputs:scale = (2, {green}, 2, 1)
        float4 inputs:bias = (-1, {-green // 2}, -1, 0)
        token inputs:sourceColorSpace = "raw"
    """
    map = np.dstack([np.full((2, 2), value, np.uint8) for value in (128, 200, 240)])
    read = "normal3f inputs:normal.connect = </Look/T.outputs:rgb>"
    found, scene = worn(store, material("Look", read, texture("Look", "n.png", more)), {"n.png": map})
    shown = scene.document["textures"][found["normal_map"]["texture"]]
    assert shown["color_space"] == "linear"
    assert store.image(shown["asset"]).pixels[0, 0].tolist() == [128, expected, 240]


def test_two_sets_of_texture_coordinates(store: AssetStore) -> None:
    second = texture("Look", "b.png").replace('"T"', '"U"').replace('"R"', '"Q"').replace("/R.", "/Q.")
    nodes = texture("Look", "a.png") + second.replace('varname = "st"', 'varname = "lightmap"')
    read = "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>\n"
    read += "color3f inputs:emissiveColor.connect = </Look/U.outputs:rgb>"
    _, scene = worn(store, material("Look", read, nodes), {"a.png": CHANNELS, "b.png": CHANNELS[..., ::-1]})
    assert scene.document["textures"]["b"]["uv"] == 1
    sign = store.mesh(scene.document["shapes"][0]["asset"])
    assert sign.uvs is not None and sign.uvs_1 is not None and sign.uvs_1[0].tolist() == [0.5, 0]


def test_vertex_colours_and_alpha_of_an_image_without_one(store: AssetStore) -> None:
    primvars = """
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)] (
        interpolation = "vertex"
    )"""
    found = store.scene(store.add(usda(mesh("Sign", primvars))).id)
    colors = store.mesh(found.document["shapes"][0]["asset"]).colors
    assert colors is not None and colors[:3].tolist() == np.eye(3).tolist()
    opaque, _ = worn(
        store,
        material("Look", "float inputs:opacity.connect = </Look/T.outputs:a>", texture("Look", "a.png")),
        {"a.png": CHANNELS},
    )
    assert (
        opaque["alpha"]["texture"]
        and store.image(_.document["textures"][opaque["alpha"]["texture"]]["asset"]).pixels.min() == 255
    )


def test_what_fades_is_glass_and_what_is_not_there_is_alpha(store: AssetStore) -> None:
    """UsdPreviewSurface's opacity: transparent, present in part, or cut off."""
    found, scene = worn(
        store, material("Look", "float inputs:opacity = 0.25\ncolor3f inputs:diffuseColor = (0, 0, 1)")
    )
    assert (found["type"], found["transmission_weight"], found["base_color"]) == ("openpbr", 0.75, [0, 0, 1])
    assert not scene.warnings
    found, _ = worn(store, material("Look", 'float inputs:opacity = 0.25\ntoken inputs:opacityMode = "presence"'))
    assert found["alpha"] == 0.25 and "transmission" not in found
