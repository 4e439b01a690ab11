"""MaterialX files become materials with their textures, and what is lost is listed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.formats import formats
from service.formats.cache import refused
from service.formats.errors import MissingExtra
from service.formats.formats import sniff
from service.formats.read.materialx import values
from service.formats.read.materialx.importer import read_materialx
from service.formats.read.references import Finder
from service.formats.scene_import import Imported
from service.formats.types import AssetLimits
from service.problems import AssetError, NotProvided
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.mtlx_files import from_graph, graph, losses, material, mtlx, node, surface, taken, value, wire
from tests.serving import Server

pytest.importorskip("MaterialX")

NOISY = np.random.default_rng(5).integers(0, 256, (8, 4, 3)).astype(np.uint8)


def texels(store: AssetStore, imported: Imported, reference: dict[str, Any]) -> np.ndarray:
    return store.image(imported.document["textures"][reference["texture"]]["asset"]).pixels


@pytest.mark.parametrize(
    ("model", "inputs", "expected", "lost"),
    [
        (
            "standard_surface",
            [value("base", 0.5), value("base_color", [0.8, 0.4, 0.2]), value("specular_roughness", 0.35),
             value("specular_IOR", 1.7), value("specular_anisotropy", 0.45), value("specular_rotation", 0.25),
             value("sheen", 0.3), value("sheen_color", [1, 0.5, 0]), value("coat", 0.5),
             value("coat_roughness", 0.05), value("emission", 2), value("emission_color", [1, 2, 3]),
             value("opacity", [0.5, 0.5, 0.5]),
             value("thin_film_thickness", 300), value("diffuse_roughness", 0.2)],
            {"base_color": [0.4, 0.2, 0.1], "roughness": 0.35, "ior": 1.7, "anisotropic": 0.5,
             "anisotropic_rotation": 90.0, "sheen": 0.3, "sheen_color": [1.0, 0.5, 0.0], "sheen_roughness": 0.3,
             "clearcoat": 0.5, "clearcoat_roughness": 0.05, "emission": [2.0, 4.0, 6.0], "alpha": 0.5,
             "film_thickness": 300.0, "film_ior": 1.5},
            {"SM/diffuse_roughness"},
        ),
        (
            "gltf_pbr",
            [value("base_color", [0.1, 0.2, 0.3]), value("metallic", 0), value("roughness", 0.6), value("alpha", 0.4),
             value("alpha_mode", 1, "integer"), value("alpha_cutoff", 0.3), value("sheen_color", [0.2, 0.1, 0]),
             value("sheen_roughness", 0.7), value("clearcoat", 1), value("clearcoat_roughness", 0.2),
             value("iridescence", 0.75), value("iridescence_ior", 1.6)],
            {"base_color": [0.1, 0.2, 0.3], "roughness": 0.6, "sheen": 1.0, "sheen_color": [0.2, 0.1, 0.0],
             "sheen_roughness": 0.7, "clearcoat": 1.0, "clearcoat_roughness": 0.2, "alpha": 0.4, "alpha_cutoff": 0.3,
             "film_thickness": 100.0, "film_ior": 1.6},
            {"SM/iridescence"},
        ),
        (
            "UsdPreviewSurface",
            [value("diffuseColor", [0.1, 0.2, 0.3]), value("metallic", 0.25), value("roughness", 0.6),
             value("ior", 1.33), value("clearcoat", 0.5), value("opacity", 0), value("occlusion", 0.5)],
            {"base_color": 1.0, "metallic": 0.25, "roughness": 0.6, "ior": 1.33, "clearcoat": 0.5,
             "clearcoat_roughness": 0.01, "transmission": 1.0},
            {"SM/occlusion"},
        ),
        (
            "disney_principled",
            [value("baseColor", [0.1, 0.2, 0.3]), value("metallic", 0.5), value("specular", 0.3),
             value("specularTint", 0.2), value("sheen", 0.4), value("sheenTint", 0.1), value("clearcoat", 0.6),
             value("clearcoatGloss", 0.7), value("anisotropic", 0.8), value("roughness", 0.25)],
            {"base_color": [0.1, 0.2, 0.3], "metallic": 0.5, "specular": 0.3, "specular_tint": 0.2, "sheen": 0.4,
             "sheen_tint": 0.1, "clearcoat": 0.6, "clearcoat_gloss": 0.7, "anisotropic": 0.8, "roughness": 0.25},
            set(),
        ),
    ],
)  # fmt: skip
def test_each_model_has_its_parameters(
    store: AssetStore, model: str, inputs: list[str], expected: dict[str, Any], lost: set[str]
) -> None:
    imported = taken(store, mtlx(surface(model, *inputs)))
    found = material(imported)
    assert found.pop("type") == "principled"
    assert found.keys() == expected.keys()
    for name, each in expected.items():
        assert found[name] == pytest.approx(each, rel=1e-5), name
    assert losses(imported) == lost


def test_an_image_times_a_constant_stays_as_it_is(store: AssetStore) -> None:
    """Where it lies is one matrix, whatever nodes it comes from; channels and factors likewise."""
    nodes = [
        node("texcoord", "tc", "vector2"),
        node("place2d", "turned", "vector2", wire("texcoord", "tc", "vector2"), value("scale", "0.5, 0.5", "vector2"),
             value("rotate", 30.0), value("offset", "0.25, 0", "vector2")),
        node("image", "own", "color3", value("file", "maps/a.png", "filename", colorspace="srgb_texture"),
             wire("texcoord", "turned", "vector2"), value("uaddressmode", "mirror"), value("vaddressmode", "clamp")),
        node("multiply", "dark", "color3", wire("in1", "own"), value("in2", [0.5, 0.25, 1])),
        node("tiledimage", "orm", "vector3", value("file", "maps/a.png", "filename"),
             value("uvtiling", "2, 3", "vector2"),
             value("realworldimagesize", "50, 50", "vector2", unittype="distance", unit="centimeter")),
        node("separate3", "parts", "multioutput", wire("in", "orm", "vector3")),
        node("multiply", "half", "float", wire("in1", "parts", "float", "outy"), value("in2", 0.5)),
        node("image", "bumps", "vector3", value("file", "maps/n.png", "filename")),
        node("normalmap", "bent", "vector3", wire("in", "bumps", "vector3"), value("scale", 0.75)),
    ]  # fmt: skip
    made = graph(
        *nodes, color="dark color3", rough="half float", metal="parts float outz", normal="bent vector3",
    )  # fmt: skip
    shader = surface(
        "open_pbr_surface", from_graph("base_color", "color"), from_graph("specular_roughness", "rough", "float"),
        from_graph("base_metalness", "metal", "float"), from_graph("geometry_normal", "normal", "vector3"),
    )  # fmt: skip
    files = {"a/m.mtlx": mtlx(made, shader), "a/maps/a.png": make.png(NOISY), "a/maps/n.png": make.png(NOISY // 2)}
    imported = taken(store, files)
    assert material(imported) == {
        "type": "openpbr",
        "base_color": {"texture": "a", "factor": [0.5, 0.25, 1.0]},
        "specular_roughness": {"texture": "a 2", "channel": "g", "factor": 0.5},
        "base_metalness": {"texture": "a 2", "channel": "b"},
        "geometry_normal": {"texture": "n", "scale": 0.75},
    }
    textures = imported.document["textures"]
    # place2d turns clockwise, and takes its offset last.
    assert textures["a"]["color_space"] == "srgb" and textures["a"]["wrap"] == ["mirror", "clamp"]
    placing = [textures["a"][name] for name in ("scale", "rotation", "offset")]
    assert placing == [[2, 2], pytest.approx(-30), pytest.approx([-0.25, 0])]
    assert textures["a 2"]["color_space"] == "linear"
    assert textures["a 2"]["scale"] == [4, 6], (
        "twice and thrice a metre, on which an image of half a metre fits twice"
    )
    assert store.read(textures["a"]["asset"]) == files["a/maps/a.png"]
    assert not imported.warnings


def test_a_triplanar_projection_is_an_image_by_box(store: AssetStore) -> None:
    """Its scale is that of the position; one image serves all sides, which is told."""
    nodes = [
        node("position", "p", "vector3"),
        node("multiply", "twice", "vector3", wire("in1", "p", "vector3"), value("in2", 2.0)),
        node("triplanarprojection", "own", "color3", value("filex", "a.png", "filename", colorspace="srgb_texture"),
             value("filey", "b.png", "filename"), wire("position", "twice", "vector3")),
        node("triplanarprojection", "grey", "float", *(value(f"file{k}", "a.png", "filename") for k in "xyz")),
        node("multiply", "half", "float", wire("in1", "grey", "float"), value("in2", 0.5)),
    ]  # fmt: skip
    made = graph(*nodes, color="own color3", rough="half float")
    shader = surface("open_pbr_surface", from_graph("base_color", "color"),
                     from_graph("specular_roughness", "rough", "float"))  # fmt: skip
    imported = taken(store, {"m.mtlx": mtlx(made, shader), "a.png": make.png(NOISY), "b.png": make.png(NOISY)})
    assert material(imported) == {
        "type": "openpbr",
        "base_color": {"texture": "a"},
        "specular_roughness": {"texture": "a 2", "channel": "r", "factor": 0.5},
    }
    textures = imported.document["textures"]
    assert textures["a"] == {
        "asset": textures["a"]["asset"],
        "color_space": "srgb",
        "mapping": "box",
        "scale": [2, 2],
    }
    assert textures["a 2"] == {"asset": textures["a"]["asset"], "color_space": "linear", "mapping": "box"}
    told = " ".join(each["detail"] for each in imported.warnings)
    assert "filex is used on all sides" in told and "computed as an image" not in told


def test_displacement_is_heights(store: AssetStore) -> None:
    """A texture less its middle, times a scale: the midlevel is where that is 0."""
    nodes = [
        node("tiledimage", "img", "float", value("file", "h.png", "filename"), value("uvtiling", "2, 2", "vector2")),
        node("subtract", "around", "float", wire("in1", "img", "float"), value("in2", 0.25)),
    ]
    moved = node(
        "displacement", "D", "displacementshader", from_graph("displacement", "out", "float"), value("scale", 0.04)
    )
    wired = wire("displacementshader", "D", "displacementshader")
    shader = surface("gltf_pbr").replace("</surfacematerial>", f"{wired}</surfacematerial>")
    files = {"m.mtlx": mtlx(graph(*nodes, out="around float"), moved, shader), "h.png": make.png(NOISY)}
    imported = taken(store, files)
    assert material(imported)["height"] == {"texture": "h", "channel": "r", "scale": 0.04, "midlevel": 0.25}
    assert imported.document["textures"]["h"]["scale"] == [2, 2] and not imported.warnings


def test_the_colour_space_is_the_inputs_the_documents_or_linear(store: AssetStore) -> None:
    mid = [0.5, 0.5, 0.5]
    linear = ((0.5 + 0.055) / 1.055) ** 2.4
    color = surface("standard_surface", value("base", 1), value("base_color", mid))
    assert material(taken(store, mtlx(color)))["base_color"] == 0.5
    assert material(taken(store, mtlx(color, space="srgb_texture")))["base_color"] == pytest.approx(linear, rel=1e-4)
    own = surface("standard_surface", value("base", 1), value("base_color", [0.6, 0.2, 0.1], colorspace="acescg"))
    # ACEScg's primaries in Rec.709's [ACES, Technical Bulletin 2014-004; Bradford to D65].
    matrix = np.array([[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]])
    found = material(taken(store, mtlx(own, space="srgb_texture")))["base_color"]
    assert found == pytest.approx((matrix @ [0.6, 0.2, 0.1]).tolist(), abs=2e-4)
    strange = taken(store, mtlx(surface("gltf_pbr", value("base_color", mid, colorspace="camera_log"))))
    assert material(strange)["base_color"] == 0.5 and losses(strange) == {"SM/base_color"}


def test_other_graphs_are_computed_for_each_texel(store: AssetStore) -> None:
    """On the image's own texels, placed as it is; a second use of the graph costs nothing."""
    file = value("file", "a.png", "filename", colorspace="srgb_texture")
    nodes = [
        node("tiledimage", "img", "color3", file, value("uvtiling", "2, 2", "vector2")),
        node("invert", "inv", "color3", wire("in", "img")),
        node("luminance", "lum", "color3", wire("in", "img"), value("lumacoeffs", [0.25, 0.5, 0.25])),
        node("extract", "grey", "float", wire("in", "lum"), value("index", 0, "integer")),
    ]
    made = graph(*nodes, color="inv color3", rough="grey float")
    shader = surface("gltf_pbr", from_graph("base_color", "color"), from_graph("roughness", "rough", "float"))
    imported = taken(store, {"m.mtlx": mtlx(made, shader), "a.png": make.png(NOISY)})
    found = material(imported)
    own = NOISY / 255
    linear = np.where(own <= 0.04045, own / 12.92, ((own + 0.055) / 1.055) ** 2.4)
    inverse = 1 - linear
    expected = 255 * np.where(inverse <= 0.0031308, 12.92 * inverse, 1.055 * inverse ** (1 / 2.4) - 0.055)
    assert np.abs(texels(store, imported, found["base_color"]) - expected).max() <= 0.51
    rough = texels(store, imported, found["roughness"])[..., 0]
    assert np.abs(rough - 255 * (linear @ [0.25, 0.5, 0.25])).max() <= 0.51
    assert {texture["scale"][0] for texture in imported.document["textures"].values()} == {2}
    (said,) = imported.warnings
    assert said["pointer"] == "SM/base_color" and said["count"] == 2, "that they are computed is said"


def test_patterns_are_computed_over_the_unit_square(store: AssetStore) -> None:
    ramp = node("ramplr", "ramp", "float", value("valuel", 0.25), value("valuer", 0.75))
    space = node("fractal3d", "noise", "float", value("amplitude", 0.25))
    made = graph(ramp, space, rough="ramp float", metal="noise float")
    shader = surface("gltf_pbr", from_graph("roughness", "rough", "float"), from_graph("metallic", "metal", "float"))
    imported = taken(store, mtlx(made, shader))
    row = texels(store, imported, material(imported)["roughness"])[0, :, 0]
    places = (np.arange(len(row)) + 0.5) / len(row)
    assert np.abs(row - (0.25 + 0.5 * places)).max() < 2e-5
    assert any("in space" in warning["detail"] for warning in imported.warnings)


def test_nodes_without_a_meaning_leave_their_parameter_out(store: AssetStore) -> None:
    nodes = [
        node("viewdirection", "view", "vector3"),
        node("extract", "z", "float", wire("in", "view", "vector3"), value("index", 2, "integer")),
        node("image", "gone", "float", value("file", "gone.png", "filename"), value("default", 0.625)),
        node("add", "around", "float", wire("in1", "around", "float"), value("in2", 1.0)),
    ]
    made = graph(*nodes, out_z="z float", out_gone="gone float", out_around="around float")
    shader = surface(
        "gltf_pbr", value("base_color", [0.5, 0.5, 0.5]), from_graph("metallic", "out_z", "float"),
        from_graph("roughness", "out_gone", "float"), from_graph("clearcoat", "out_around", "float"),
    )  # fmt: skip
    imported = taken(store, mtlx(made, shader, node("volumematerial", "V", "material")))
    found = material(imported)
    assert found["roughness"] == 0.625 and "metallic" not in found and "clearcoat" not in found
    assert {"SM/metallic", "SM/clearcoat", "NG/gone"} <= losses(imported)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b'<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a "b">]><materialx version="1.39"/>', "DOCTYPE"),
        (b'<?xml version="1.0"?><!DOCTYPE m SYSTEM "file:///etc/passwd"><materialx version="1.39"/>', "DOCTYPE"),
        (b'<materialx xmlns:xi="http://www.w3.org/2001/XInclude"><xi:include href="b.mtlx"/></materialx>', "include"),
        (b"<materialx version='1.39'><nodegraph name='a'>", "well-formed"),
        (b"<materialx>" + b"<nodegraph name='a'>" * 60 + b"</nodegraph>" * 60 + b"</materialx>", "levels"),
        (b"<materialx version='1.39'/>", "no material"),
        (mtlx(surface("gltf_pbr", value("roughness", "nan", "float"))), "SM/roughness"),
        (mtlx(surface("gltf_pbr", value("base_color", "1, 2", "color3"))), "3 numbers"),
        (mtlx(surface("standard_hair")), "no surface shader|not supported"),
    ],
)  # fmt: skip
def test_what_leads_out_or_is_broken_is_refused(store: AssetStore, text: bytes, said: str) -> None:
    assert sniff(text) == "mtlx"
    with pytest.raises(AssetError, match=said):
        store.add(text)


@pytest.mark.parametrize("name", ["../../a.png", "/etc/passwd", "C:\\a.png", "http://x.org/a.png", "a.<UDIM>.png"])
def test_images_outside_of_the_upload_are_not_opened(store: AssetStore, name: str) -> None:
    image = node("image", "img", "color3", value("file", name, "filename"), value("default", [0.5, 0.25, 0.125]))
    shader = surface("gltf_pbr", from_graph("base_color", "out"))
    imported = taken(store, {"a/m.mtlx": mtlx(graph(image, out="img color3"), shader), "b/c.png": make.png(NOISY)})
    assert material(imported)["base_color"] == [0.5, 0.25, 0.125]
    assert losses(imported) == {"NG/img", "b/c.png"}, "and the image that the zip has is used by nothing"


def test_a_graph_that_takes_too_long_is_made_smaller_or_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noises of a billion octaves: the octaves are bounded, and so are the texels of all images. Here less may be
    spent, as the test would take ten seconds otherwise."""
    monkeypatch.setattr(values, "MOST_COST", 1 << 26)
    monkeypatch.setattr(values, "MOST_TOTAL", 1 << 27)
    nodes = [node("fractal3d", "n0", "float", value("octaves", 10**9, "integer"))]
    for k in range(1, 6):
        tree = node("fractal3d", f"f{k}", "float", value("octaves", 10**9, "integer"), value("lacunarity", 1.0 + k))
        nodes += [
            tree,
            node("add", f"n{k}", "float", wire("in1", f"n{k - 1}", "float"), wire("in2", f"f{k}", "float")),
        ]
    made = graph(*nodes, out="n5 float")
    shaders = [surface("gltf_pbr", from_graph("roughness", "out", "float"), name=f"M{k}") for k in range(3)]
    text = mtlx(made, *shaders)
    file = read_materialx(["a.mtlx"], Finder(["a.mtlx"]), lambda name: text, AssetLimits())
    assert len(file.document["materials"]) == 3
    (part,) = file.parts
    assert make.read_png(bytes(part.data)).shape[0] < 256
    deep = [node("add", f"n{k}", "float", wire("in1", f"n{k + 1}", "float")) for k in range(400)]
    shader = surface("gltf_pbr", from_graph("roughness", "out", "float"))
    text = mtlx(graph(*deep, node("constant", "n400", "float", value("value", 0.5)), out="n0 float"), shader)
    (warning,) = read_materialx(["a.mtlx"], Finder(["a.mtlx"]), lambda name: text, AssetLimits()).warnings
    assert "within each other" in warning["detail"]


def test_a_mtlx_in_a_texture_set_wins_and_two_files_are_told_apart(store: AssetStore) -> None:
    image = node("image", "img", "color3", value("file", "Oak_Color.png", "filename", colorspace="srgb_texture"))
    made = mtlx(graph(image, out="img color3"), surface("gltf_pbr", from_graph("base_color", "out"), name="Oak"))
    other = mtlx(surface("gltf_pbr", value("occlusion", 0.5), name="Oak"))
    files = {"Oak.mtlx": made, "Oak_Color.png": make.png(NOISY), "Oak_Roughness.png": make.png(NOISY)}
    assert material(taken(store, files))["roughness"] == 1, (
        "as the file has it, though an image would fit by its name"
    )
    both = taken(store, {**files, "b/other.mtlx": other})
    assert list(both.document["materials"]) == ["Oak", "Oak 2"]
    assert losses(both) == {"b/other.mtlx/SOak/occlusion", "Oak_Roughness.png"}


def test_it_is_served_and_a_file_is_no_mesh(server: Server) -> None:
    turned = value("geometry_tangent", "1, 0, 0", "vector3")
    text = mtlx(surface("open_pbr_surface", value("base_color", [0.5, 0.25, 0.125]), turned))
    answer = server.http.post("/v1/assets", content=text, headers={"content-type": "application/octet-stream"})
    assert answer.status_code == 201 and answer.json()["kind"] == "materials" and answer.json()["format"] == "mtlx"
    id = answer.json()["id"]
    found = server.http.get(f"/v1/assets/{id}/materials").json()
    assert found["materials"]["M"]["base_color"] == [0.5, 0.25, 0.125]
    assert [note["pointer"] for note in found["warnings"]] == ["SM/geometry_tangent"]
    scene = {
        "version": 1, "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "materials": {"a": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [{"type": "mesh", "asset": id, "material": "a"}],
    }  # fmt: skip
    refused = server.http.post("/v1/renders", json={"scene": scene})
    assert refused.status_code == 422 and "holds materials" in refused.text
    assert "mtlx" in server.http.get("/v1/info").json()["formats"]["materials"]


def test_without_the_package_it_is_refused_by_its_extras_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formats, "find_spec", lambda module: None)
    formats.missing.cache_clear()
    try:
        assert formats.missing()["mtlx"] == "sunbox-server[materialx]"
        with pytest.raises(MissingExtra, match=r"sunbox-server\[materialx\]"):
            read_materialx(["a.mtlx"], Finder(["a.mtlx"]), lambda name: b"", AssetLimits())
    finally:
        monkeypatch.undo()
        formats.missing.cache_clear()
    assert isinstance(refused("the file", MissingExtra("x")), NotProvided), "which is answered 501"


def test_the_command_takes_the_images_beside_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    (tmp_path / "oak" / "maps").mkdir(parents=True)
    image = node("image", "img", "color3", value("file", "maps/a.png", "filename", colorspace="srgb_texture"))
    made = mtlx(graph(image, out="img color3"), surface("gltf_pbr", from_graph("base_color", "out")))
    (tmp_path / "oak" / "oak.mtlx").write_bytes(made)
    (tmp_path / "oak" / "maps" / "a.png").write_bytes(make.png(NOISY))
    target = tmp_path / "oak.json"
    assert main(["import", str(tmp_path / "oak" / "oak.mtlx"), "-o", str(target)]) == 0
    document = json.loads(target.read_text())
    assert document["materials"]["M"]["base_color"] == {"texture": "a"}
    assert (tmp_path / document["textures"]["a"]["asset"]).read_bytes() == make.png(NOISY)
    assert capsys.readouterr().err == ""
