"""Materials of USD files that are MaterialX networks."""

from __future__ import annotations

from typing import Any

import pytest

from service.document.material import OpenpbrMaterial
from service.server.assets import AssetStore
from tests.mtlx_files import mtlx, surface, taken, value
from tests.usd_files import material, texture
from tests.usd_looks import CHANNELS, worn

pytestmark = [pytest.mark.usd, pytest.mark.slow]

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


def test_standard_surface_loses_as_little_as_from_a_mtlx(store: AssetStore) -> None:
    kind, half = "ND_standard_surface_surfaceshader", "color3f inputs:base_color = (0.5, 0.5, 0.5)\n"
    found, scene = worn(store, material("Look", f"{half}float inputs:transmission = 0.3", "", kind, "mtlx:surface"))
    assert (found["type"], found["base_color"], found["transmission_weight"]) == ("openpbr", [0.5] * 3, 0.3)
    assert not scene.warnings


def test_gltf_s_model_in_usd(store: AssetStore) -> None:
    inputs = "float inputs:metallic = 0.5\nfloat inputs:clearcoat = 1\ncolor3f inputs:sheen_color = (1, 1, 1)\n"
    inputs += "float inputs:iridescence = 0.25"
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
    assert len(scene.warnings) == 1, "what the other surface loses is not lost"


def test_openpbr_is_shown_beside_a_preview_though_it_loses_a_little(store: AssetStore) -> None:
    preview = """
    token outputs:surface.connect = </Look/P.outputs:surface>
    def Shader "P"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>
        token outputs:surface
    }""" + texture("Look", "a.png")
    inputs = OPEN_PBR + "        color3f inputs:coat_color = (0.9, 0.5, 0.2)\n        float inputs:coat_weight = 1\n"
    kind = "ND_open_pbr_surface_surfaceshader"
    for more, told in (("", []), ("        vector3f inputs:geometry_tangent = (0, 1, 0)\n", ["geometry_tangent"])):
        look = material("Look", inputs + more, preview, kind, "mtlx:surface")
        found, scene = worn(store, look, {"a.png": CHANNELS})
        assert found["type"] == "openpbr" and found["coat_color"] == [0.9, 0.5, 0.2]
        places = [warning["pointer"] for warning in scene.warnings if warning["pointer"] != "a.png"]  # the preview's
        assert places == [f"/Look/S.inputs:{name}" for name in told], scene.warnings
        assert not scene.document.get("textures")
