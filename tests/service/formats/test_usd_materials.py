"""Materials of USD files: UsdPreviewSurface with its textures, and MaterialX."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.colorimetry import decode_srgb, encode_srgb
from service.document import parse_scene
from service.document.material import OpenpbrMaterial
from service.formats.scene_import import Imported
from service.server.assets import AssetStore
from tests.mtlx_files import mtlx, surface, taken, value
from tests.usd_files import PNG, QUAD, material, mesh, texture, usda, usdz

pytestmark = [pytest.mark.usd, pytest.mark.slow]

UV = """
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
        interpolation = "vertex"
    )
    texCoord2f[] primvars:lightmap = [(0.5, 0), (0.5, 0), (0.5, 1), (0, 1)] (
        interpolation = "vertex"
    )
"""


def worn(
    store: AssetStore, look: str, images: dict[str, np.ndarray] | None = None, unit: float = 1
) -> tuple[dict[str, Any], Imported]:
    """The material "Look" in the document, on a square; `unit` is how many metres a unit of the stage has."""
    root = usda(look + mesh("Sign", "rel material:binding = </Look>", body=QUAD + UV), f"metersPerUnit = {unit:g}")
    data = usdz({"root.usda": root} | {name: PNG(pixels) for name, pixels in (images or {}).items()})
    found = store.scene(store.add(data).id)
    parse_scene(found.scene({"type": "constant", "radiance": 1}))
    return found.document["materials"][found.document["shapes"][0]["material"]], found


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


CHANNELS = np.dstack([np.full((2, 2), value, np.uint8) for value in (200, 100, 50)])


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


STANDARD = """
        float inputs:base = 0.5
        color3f inputs:base_color = (0.8, 0.4, 0.2)
        float inputs:specular_roughness = 0.35
        float inputs:metalness = 1
        float inputs:coat = 0.5
        float inputs:coat_roughness = 0.2
        float inputs:emission = 3
        color3f inputs:emission_color = (1, 0.5, 0)
        float inputs:thin_film_thickness = 400
        float inputs:diffuse_roughness = 0.25
"""
OPEN_PBR = """
        float inputs:base_weight = 1
        color3f inputs:base_color = (0.8, 0.4, 0.2)
        float inputs:specular_ior = 1.33
        float inputs:transmission_weight = 1
        color3f inputs:transmission_color = (0.2, 0.9, 0.4)
        float inputs:transmission_depth = 0.5
"""
IMAGE = """
    def Shader "I"
    {
        uniform token info:id = "ND_image_color3"
        asset inputs:file = @a.png@ (
            colorSpace = "srgb_texture"
        )
        color3f outputs:out
    }
    def Shader "M"
    {
        uniform token info:id = "ND_multiply_color3FA"
        color3f inputs:in1.connect = </Look/I.outputs:out>
        float inputs:in2 = 0.5
        color3f outputs:out
    }
"""


def test_standard_surface_and_openpbr(store: AssetStore) -> None:
    standard = material("Look", STANDARD, kind="ND_standard_surface_surfaceshader", output="mtlx:surface")
    found, scene = worn(store, standard)
    assert found["base_color"] == pytest.approx([0.4, 0.2, 0.1]) and found["metallic"] == 1
    assert found["roughness"] == 0.35 and found["clearcoat"] == 0.5 and found["clearcoat_roughness"] == 0.2
    assert found["emission"] == [3, 1.5, 0]
    assert (found["film_thickness"], found["film_ior"]) == (400, 1.5)
    assert [warning["pointer"] for warning in scene.warnings] == ["/Look/S.inputs:diffuse_roughness"]
    glass = material("Look", OPEN_PBR, kind="ND_open_pbr_surface_surfaceshader", output="mtlx:surface")
    found, scene = worn(store, glass)
    assert found["type"] == "openpbr" and not scene.warnings
    assert (found["transmission_weight"], found["transmission_depth"], found["specular_ior"]) == (1, 0.5, 1.33)
    assert found["transmission_color"] == [0.2, 0.9, 0.4] and found["base_color"] == [0.8, 0.4, 0.2]


def test_openpbr_has_the_numbers_that_a_mtlx_has(store: AssetStore) -> None:
    pytest.importorskip("MaterialX")
    given: dict[str, Any] = {
        "base_weight": 0.9, "base_color": [0.5, 0.25, 0.75], "base_metalness": 0.5, "specular_weight": 1.5,
        "specular_ior": 0.75, "specular_roughness_anisotropy": 0.6, "transmission_weight": 0.25,
        "transmission_depth": 2.0, "transmission_scatter": [0.25, 0.5, 0.75], "coat_weight": 0.5, "coat_ior": 1.7,
        "transmission_dispersion_scale": 0.5, "fuzz_weight": 0.2, "fuzz_color": [0.5, 0.5, 0.5],
        "thin_film_weight": 0.25, "thin_film_thickness": 0.35, "subsurface_weight": 0.5, "subsurface_radius": 0.125,
        "subsurface_radius_scale": [1.0, 0.25, 0.125], "subsurface_scatter_anisotropy": -0.5,
        "emission_luminance": 500.0, "emission_color": [0.5, 2.0, 1.0], "geometry_opacity": 0.8,
    }  # fmt: skip
    lines = [f"{'color3f' if isinstance(each, list) else 'float'} inputs:{name} = "
             f"{tuple(each) if isinstance(each, list) else each}" for name, each in given.items()]  # fmt: skip
    kind = "ND_open_pbr_surface_surfaceshader"
    found, scene = worn(store, material("Look", "\n".join(lines), kind=kind, output="mtlx:surface"))
    text = mtlx(surface("open_pbr_surface", *(value(name, each) for name, each in given.items())))
    (other,) = taken(store, text).document["materials"].values()
    assert OpenpbrMaterial.model_validate(found) == OpenpbrMaterial.model_validate(other) and not scene.warnings


def test_films_dispersion_and_thin_walls_of_materialx(store: AssetStore) -> None:
    def read(inputs: str, kind: str) -> tuple[dict[str, Any], list[str]]:
        lines = "\n".join(f"        {line.strip()}" for line in inputs.split(";"))
        shader = material("Look", lines, kind=f"ND_{kind}_surfaceshader", output="mtlx:surface")
        found, scene = worn(store, shader)
        return found, [warning["pointer"] for warning in scene.warnings]

    film = (
        "float inputs:thin_film_weight = {}; float inputs:thin_film_thickness = 0.35; float inputs:thin_film_ior = 2"
    )
    found, told = read(film.format(0.25), "open_pbr_surface")
    assert [found[f"thin_film_{name}"] for name in ("weight", "thickness", "ior")] == [0.25, 0.35, 2] and not told
    glass = "float inputs:transmission_weight = 1; float inputs:transmission_dispersion_scale = 0.5"
    found, told = read(glass, "open_pbr_surface")
    names = ("transmission_dispersion_scale", "transmission_dispersion_abbe_number")
    assert ([found[name] for name in names], told) == ([0.5, 20], [])
    found, told = read("float inputs:transmission = 1; float inputs:transmission_dispersion = 33", "standard_surface")
    assert (found["abbe"], told) == (33, [])
    pane = "float inputs:transmission = 1; bool inputs:thin_walled = 1; float inputs:transmission_depth = 2"
    found, told = read(pane, "standard_surface")
    assert (found["thin_walled"], found["transmission"], told) == (True, 1, [])
    assert "attenuation_distance" not in found and found["base_color"] == [1, 1, 1]
    leaf = "bool inputs:thin_walled = 1; float inputs:subsurface = 0.4; color3f inputs:subsurface_color = (0.5, 1, 0)"
    found, told = read(leaf, "standard_surface")
    assert (found["diffuse_transmission"], found["diffuse_transmission_color"], told) == (0.4, [0.5, 1, 0], [])
    paper = (
        "bool inputs:geometry_thin_walled = 1; float inputs:subsurface_weight = 0.5;"
        "color3f inputs:subsurface_color = (1, 1, 0); color3f inputs:base_color = (0, 0.2, 0.4)"
    )
    found, told = read(paper, "open_pbr_surface")
    assert (found["geometry_thin_walled"], found["subsurface_weight"], told) == (True, 0.5, [])
    assert found["subsurface_color"] == [1, 1, 0] and found["base_color"] == [0, 0.2, 0.4]


def test_light_below_the_surface_of_materialx(store: AssetStore) -> None:
    """Radii and depths are in the stage's units."""
    skin = """        float inputs:subsurface = 0.5
        color3f inputs:subsurface_color = (0.8, 0.4, 0.2)
        color3f inputs:base_color = (0.4, 0.4, 0.4)
        color3f inputs:subsurface_radius = (1, 0.5, 0.25)
        float inputs:subsurface_scale = 0.2"""
    kind = "ND_standard_surface_surfaceshader"
    found, scene = worn(store, material("Look", skin, kind=kind, output="mtlx:surface"), unit=0.5)
    assert (found["type"], found["subsurface_weight"], found["subsurface_radius"]) == ("openpbr", 0.5, 0.1)
    assert "subsurface_radius_scale" not in found, "it is what openpbr has by itself"
    assert found["subsurface_color"] == [0.8, 0.4, 0.2] and found["base_color"] == [0.4] * 3 and not scene.warnings
    wax = """        float inputs:subsurface_weight = 1
        color3f inputs:subsurface_color = (0.9, 0.8, 0.7)
        float inputs:transmission_weight = 0.5
        float inputs:transmission_depth = 4
        float inputs:subsurface_radius = 3"""
    kind = "ND_open_pbr_surface_surfaceshader"
    found, scene = worn(store, material("Look", wax, kind=kind, output="mtlx:surface"), unit=0.5)
    assert (found["subsurface_radius"], found["transmission_depth"]) == (1.5, 2) and not scene.warnings
    assert found["subsurface_color"] == [0.9, 0.8, 0.7]


def test_what_fades_is_glass_and_what_is_not_there_is_alpha(store: AssetStore) -> None:
    """UsdPreviewSurface's opacity: transparent, present in part, or cut off."""
    found, scene = worn(
        store, material("Look", "float inputs:opacity = 0.25\ncolor3f inputs:diffuseColor = (0, 0, 1)")
    )
    assert found["transmission"] == 0.75 and found["base_color"] == [0.75, 0.75, 1] and "alpha" not in found
    assert not scene.warnings
    found, _ = worn(store, material("Look", 'float inputs:opacity = 0.25\ntoken inputs:opacityMode = "presence"'))
    assert found["alpha"] == 0.25 and "transmission" not in found


def test_the_rest_of_standard_surface(store: AssetStore) -> None:
    """Opacity is a colour, whose mean counts, or a mask; anisotropy is turned and is ten to one at most."""
    kind = "ND_standard_surface_surfaceshader"
    inputs = """        color3f inputs:opacity = (0.25, 0.5, 0.75)
        float inputs:specular_anisotropy = 0.45
        float inputs:specular_rotation = 0.25"""
    found, _ = worn(store, material("Look", inputs, kind=kind, output="mtlx:surface"))
    assert (found["alpha"], found["anisotropic"], found["anisotropic_rotation"]) == (0.5, pytest.approx(0.5), 90)
    inputs = "color3f inputs:opacity.connect = </Look/M.outputs:out>\n"
    inputs += "float inputs:specular_roughness.connect = </Look/G.outputs:out>"
    grey = IMAGE.replace('"I"', '"G"').replace("color3", "float").partition('    def Shader "M"')[0]
    found, scene = worn(store, material("Look", inputs, IMAGE + grey, kind, "mtlx:surface"), {"a.png": CHANNELS})
    assert found["alpha"] == {"texture": "a 2", "factor": 0.5} and found["roughness"] == {"texture": "a"}
    assert not scene.warnings


def test_gltf_s_model_in_usd(store: AssetStore) -> None:
    inputs = "float inputs:metallic = 0.5\nfloat inputs:clearcoat = 1\nfloat inputs:iridescence = 0.25"
    kind = "ND_gltf_pbr_surfaceshader"
    found, scene = worn(store, material("Look", inputs, kind=kind, output="mtlx:surface"))
    assert (found["metallic"], found["roughness"], found["clearcoat"]) == (0.5, 1, 1)
    assert [warning["pointer"] for warning in scene.warnings] == ["/Look/S.inputs:iridescence"]


def test_images_of_materialx_and_losses_that_the_preview_does_not_have(store: AssetStore) -> None:
    inputs = "color3f inputs:base_color.connect = </Look/M.outputs:out>"
    kind = "ND_standard_surface_surfaceshader"
    found, scene = worn(store, material("Look", inputs, IMAGE, kind, "mtlx:surface"), {"a.png": CHANNELS})
    assert found["base_color"] == {"texture": "a", "factor": 0.5}
    assert scene.document["textures"]["a"]["color_space"] == "srgb" and not scene.warnings
    noise = IMAGE.replace("ND_image_color3", "ND_noise3d_color3")
    found, scene = worn(store, material("Look", inputs, noise, kind, "mtlx:surface"))
    assert scene.warnings[0]["pointer"] == "/Look/I" and found["base_color"] == pytest.approx([0.8] * 3)
    preview = """
    token outputs:surface.connect = </Look/P.outputs:surface>
    def Shader "P"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.1, 0.2, 0.3)
        token outputs:surface
    }"""
    found, scene = worn(store, material("Look", inputs, noise + preview, kind, "mtlx:surface"))
    assert found["base_color"] == [0.1, 0.2, 0.3] and "UsdPreviewSurface is shown" in scene.warnings[0]["detail"]
