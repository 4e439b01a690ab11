"""Networks of shaders in USD files: interfaces, colour spaces, channels, layers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.server.assets import AssetStore
from tests.asset_files import png
from tests.exr_files import written
from tests.mtlx_files import from_graph, graph, mtlx, surface, taken, value, wire
from tests.mtlx_files import node as mtlx_node
from tests.usd_files import material, mesh, texture, usda, usdz
from tests.usd_looks import CHANNELS, UV, worn

pytestmark = [pytest.mark.usd, pytest.mark.slow]

STANDARD = "ND_standard_surface_surfaceshader"
SRGB = '(\n    colorSpace = "srgb_texture"\n)'


def node(name: str, kind: str, *lines: str) -> str:
    body = "\n        ".join((f'uniform token info:id = "ND_{kind}"', *lines))
    return f'    def Shader "{name}"\n    {{\n        {body}\n    }}\n'


def image(kind: str = "color3", file: str = "asset inputs:file = @a.png@ " + SRGB) -> str:
    return node("I", f"image_{kind}", file, f"{'color3f' if kind == 'color3' else 'float'} outputs:out")


def look(inputs: str, nodes: str = "", kind: str = STANDARD) -> str:
    return material("Look", inputs, nodes, kind, "mtlx:surface")


def pointers(scene: Any) -> list[str]:
    return [warning["pointer"] for warning in scene.warnings]


def test_an_interface_that_says_nothing_is_no_input(store: AssetStore) -> None:
    """As USD flattens a MaterialX file: each input is connected to one of the material, and most have no value."""
    inputs = "\n".join(
        f"{type} inputs:{name}.connect = </Look.inputs:{name}>"
        for type, name in (("float3", "tangent"), ("float", "coat_affect_color"), ("float", "metalness"))
    )
    declared = (
        "vector3f inputs:tangent\n    float inputs:coat_affect_color\n    float inputs:metalness = 1\n    token o"
    )
    found, scene = worn(store, look(inputs).replace("token o", declared, 1).replace("vector3f", "float3"))
    assert found["metallic"] == 1 and not scene.warnings


@pytest.mark.parametrize(
    ("space", "shown"),
    [
        ("srgb_texture", [0.2140411, 0.0331048, 1]), ("lin_rec709", [0.5, 0.2, 1]), ("raw", [0.5, 0.2, 1]),
        ("acescg", [0.6449, 0.1525, 1]),
    ],
)  # fmt: skip
def test_a_colour_is_in_its_attribute_s_space(store: AssetStore, space: str, shown: list[float]) -> None:
    """Of ACEScg by the matrix that adapts its white to that of Rec.709 [Bradford]; there the blue is beyond 1."""
    own = f'color3f inputs:base_color = (0.5, 0.2, 1) (\n    colorSpace = "{space}"\n)\nfloat inputs:base = 1'
    assert worn(store, look(own))[0]["base_color"] == pytest.approx(shown, abs=1e-4)
    through = "color3f inputs:base_color.connect = </Look.inputs:tint>\nfloat inputs:base = 1"
    given = own.partition("\nfloat")[0].replace("base_color", "tint") + "\n    token outputs"
    made = look(through).replace("token outputs", given, 1)
    assert worn(store, made)[0]["base_color"] == pytest.approx(shown, abs=1e-4)


def test_an_image_s_space_is_where_its_path_is_and_numbers_have_none(store: AssetStore) -> None:
    """The path may be an input of the material; a channel of a colour is linear, too, and an image of numbers is."""
    inputs = "color3f inputs:base_color.connect = </Look/I.outputs:out>\n"
    inputs += "float inputs:specular_roughness.connect = </Look/E.outputs:out>\n"
    inputs += "float inputs:metalness.connect = </Look/F.outputs:out>"
    channel = node(
        "E", "extract_color3", "color3f inputs:in.connect = </Look/I.outputs:out>", "int inputs:index = 1",
        "float outputs:out",
    )  # fmt: skip
    plain = image("float").replace('"I"', '"F"')
    made = look(inputs, image(file="asset inputs:file.connect = </Look.inputs:file>") + channel + plain)
    made = made.replace("token outputs", f"asset inputs:file = @a.png@ {SRGB}\n    token outputs", 1)
    found, scene = worn(store, made, {"a.png": CHANNELS})
    textures = scene.document["textures"]
    assert textures[found["base_color"]["texture"]]["color_space"] == "srgb"
    assert found["specular_roughness" if found["type"] == "openpbr" else "roughness"]["channel"] == "g"
    assert textures[found["roughness"]["texture"]]["color_space"] == "srgb"
    assert textures[found["metallic"]["texture"]]["color_space"] == "linear" and not scene.warnings


@pytest.mark.parametrize(
    ("splitter", "output", "more", "channel"),
    [
        ("extract_color3", "out", "int inputs:index = 2", "b"), ("separate3_color3", "outg", "", "g"),
        ("separate3_vector3", "outy", "", "g"), ("swizzle_color3_float", "out", 'string inputs:channels = "b"', "b"),
        ("swizzle_vector3_float", "out", 'string inputs:channels = "z"', "b"),
    ],
)  # fmt: skip
def test_channels(store: AssetStore, splitter: str, output: str, more: str, channel: str) -> None:
    """Of an image times a colour, and of a constant colour."""
    inputs = f"float inputs:specular_roughness.connect = </Look/E.outputs:{output}>"
    by = node(
        "M", "multiply_color3", "color3f inputs:in1.connect = </Look/I.outputs:out>",
        "color3f inputs:in2 = (0.1, 0.6, 0.8)", "color3f outputs:out",
    )  # fmt: skip
    split = node("E", splitter, "color3f inputs:in.connect = </Look/M.outputs:out>", more, f"float outputs:{output}")
    found, scene = worn(store, look(inputs, image() + by + split), {"a.png": CHANNELS})
    factor = {"g": 0.6, "b": 0.8}[channel]
    assert found["roughness"] == {"texture": "a", "channel": channel, "factor": factor} and not scene.warnings
    constant = node("M", "constant_color3", "color3f inputs:value = (0.1, 0.6, 0.8)", "color3f outputs:out")
    found, scene = worn(store, look(inputs, constant + split))
    assert found["roughness"] == factor and not scene.warnings


def test_channels_in_another_order_are_told(store: AssetStore) -> None:
    split = node(
        "E", "swizzle_color3_color3", "color3f inputs:in.connect = </Look/I.outputs:out>",
        'string inputs:channels = "bgr"', "color3f outputs:out",
    )  # fmt: skip
    _, scene = worn(store, look("color3f inputs:base_color.connect = </Look/E.outputs:out>", image() + split))
    assert any("/Look/" in pointer for pointer in pointers(scene))


def test_the_strength_of_a_normal_map(store: AssetStore) -> None:
    bent = node(
        "N", "normalmap_float", "float3 inputs:in.connect = </Look/I.outputs:out>", "float inputs:scale = 0.5",
        "float3 outputs:out",
    )  # fmt: skip
    made = look("float3 inputs:normal.connect = </Look/N.outputs:out>", image("vector3") + bent)
    found, scene = worn(store, made, {"a.png": CHANNELS})
    assert found["normal_map"] == {"texture": "a", "scale": 0.5} and not scene.warnings


def test_the_preview_s_surface_by_its_name_in_materialx(store: AssetStore) -> None:
    made = look("color3f inputs:diffuseColor = (0.1, 0.2, 0.3)", kind="ND_UsdPreviewSurface_surfaceshader")
    found, scene = worn(store, made)
    assert found["base_color"] == [0.1, 0.2, 0.3] and not scene.warnings


@pytest.mark.parametrize(("layer", "told"), [("AO", []), ("Z", ["/Look/I.inputs:layer"])])
def test_a_layer_of_an_exr(store: AssetStore, layer: str, told: list[str]) -> None:
    texels = np.full((2, 2, 6), 0.25, np.float32)
    exr = written(texels, [f"{name}.{channel}" for name in ("AO", "beauty") for channel in "RGB"])
    reading = image(file=f'asset inputs:file = @a.exr@\n        string inputs:layer = "{layer}"')
    made = look("color3f inputs:base_color.connect = </Look/I.outputs:out>", reading)
    root = usda(made + mesh("Sign", f"rel material:binding = </Look>\n{UV}"))
    scene = store.scene(store.add(usdz({"root.usda": root, "a.exr": exr})).id)
    (texture,) = scene.document["textures"].values()
    assert texture.get("layer") == (None if told else layer) and pointers(scene) == told


PLACED = """float2 inputs:scale = (0.5, 0.25)
        float inputs:rotate = 30
        float2 inputs:offset = (0.1, 0.2)
        float2 inputs:pivot = (0.5, 0.25)
        float2 outputs:out"""


def test_place2d_is_what_a_mtlx_makes_of_it(store: AssetStore) -> None:
    """With its rotation and its pivot."""
    pytest.importorskip("MaterialX")
    at = node("P", "place2d_vector2", *PLACED.splitlines())
    file = f"asset inputs:file = @a.png@ {SRGB}\n        float2 inputs:texcoord.connect = </Look/P.outputs:out>"
    made = look("color3f inputs:base_color.connect = </Look/I.outputs:out>", image(file=file) + at)
    found, scene = worn(store, made, {"a.png": CHANNELS})
    texture = scene.document["textures"][found["base_color"]["texture"]]
    vectors = (value(name, each, "vector2") for name, each in
               (("scale", [0.5, 0.25]), ("offset", [0.1, 0.2]), ("pivot", [0.5, 0.25])))  # fmt: skip
    own = mtlx_node("texcoord", "st", "vector2")
    turned = value("rotate", 30.0, "float")
    place = own + mtlx_node("place2d", "P", "vector2", wire("texcoord", "st", "vector2"), *vectors, turned)
    named = value("file", "a.png", "filename", colorspace="srgb_texture")
    shown = mtlx_node("image", "I", "color3", named, wire("texcoord", "P", "vector2"))
    surfaced = surface("standard_surface", from_graph("base_color", "out"))
    other = taken(store, {"a.mtlx": mtlx(graph(place, shown, out="I color3"), surfaced), "a.png": png(CHANNELS)})
    (expected,) = other.document["textures"].values()
    for name in ("scale", "rotation", "offset"):
        assert texture[name] == pytest.approx(expected[name], abs=1e-5), name
    assert not scene.warnings


def test_the_real_size_of_a_tiled_image(store: AssetStore) -> None:
    size = """float2 inputs:realworldimagesize = (0.5, 0.25)
        float2 inputs:realworldtilesize = (1, 2)
        float2 inputs:uvtiling = (3, 1)
        float2 inputs:uvoffset = (0.5, 0)"""
    tiled = image(file=f"asset inputs:file = @a.png@\n        {size}").replace("ND_image", "ND_tiledimage")
    made = look("color3f inputs:base_color.connect = </Look/I.outputs:out>", tiled)
    found, scene = worn(store, made, {"a.png": CHANNELS})
    texture = scene.document["textures"][found["base_color"]["texture"]]
    assert (texture["scale"], texture["offset"]) == ([6, 8], [-1, 0]) and not scene.warnings


@pytest.mark.parametrize("output", ["mtlx:displacement", "displacement", "mtlx:volume"])
def test_what_a_material_has_beside_its_surface_is_told(store: AssetStore, output: str) -> None:
    raised = node("D", "displacement_float", "float inputs:displacement = 1", "token outputs:out")
    made = look("float inputs:metalness = 1", raised)
    connected = f"token outputs:{output}.connect = </Look/D.outputs:out>\n    token outputs:mtlx:surface"
    _, scene = worn(store, made.replace("token outputs:mtlx:surface", connected, 1))
    (warning,) = scene.warnings
    assert warning["pointer"] == "/Look/D" and output.rpartition(":")[2] in warning["detail"]


def test_a_preview_s_displacement_is_an_input(store: AssetStore) -> None:
    made = material("Look", "float inputs:displacement = 0\n        token outputs:displacement")
    connected = "token outputs:displacement.connect = </Look/S.outputs:displacement>\n    token outputs:surface"
    _, scene = worn(store, made.replace("token outputs:surface", connected, 1))
    assert not scene.warnings


@pytest.mark.parametrize(
    ("name", "type", "own", "parameter", "shown"),
    [
        ("diffuseColor", "color3f", "(1, 0, 0.5)", "base_color", [1, 0, 0.5]),
        ("roughness", "float", "0.75", "roughness", 0.75),
    ],
)  # fmt: skip
def test_an_input_s_own_value_stands_in_for_an_image_that_is_not_there(
    store: AssetStore, name: str, type: str, own: str, parameter: str, shown: Any
) -> None:
    output = "rgb" if type == "color3f" else "r"
    inputs = f"{type} inputs:{name} = {own}\n        {type} inputs:{name}.connect = </Look/T.outputs:{output}>"
    found, scene = worn(store, material("Look", inputs, texture("Look", "gone.png")))
    assert found[parameter] == shown and pointers(scene) == ["/Look/T"]
    black = texture("Look", "gone.png", "float4 inputs:fallback = (0, 0, 0, 1)")
    found, scene = worn(store, material("Look", inputs, black))
    assert found[parameter] == ([0] * 3 if type == "color3f" else 0) and pointers(scene) == ["/Look/T"]


@pytest.mark.parametrize(
    ("kind", "name"), [("geompropvalue_vector2", "geomprop"), ("UsdPrimvarReader_vector2", "varname")]
)
def test_the_coordinates_of_an_image_by_their_name(store: AssetStore, kind: str, name: str) -> None:
    """The mesh has these only: others would be told."""
    at = node("P", kind, f'string inputs:{name} = "lightmap"', "float2 outputs:out")
    file = "asset inputs:file = @a.png@\n        float2 inputs:texcoord.connect = </Look/P.outputs:out>"
    made = look("color3f inputs:base_color.connect = </Look/I.outputs:out>", image(file=file) + at)
    alone = UV.partition("texCoord2f[] primvars:lightmap")
    root = usda(made + mesh("Sign", f"rel material:binding = </Look>\n{alone[1]}{alone[2]}"))
    scene = store.scene(store.add(usdz({"root.usda": root, "a.png": png(CHANNELS)})).id)
    assert scene.document["textures"] and not scene.warnings
