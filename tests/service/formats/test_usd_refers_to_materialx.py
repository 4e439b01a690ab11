"""MaterialX files to which a layer of USD refers: in a zip of their folder, and beside the layer on disk."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.formats.scene_import import Imported
from service.server.assets import AssetStore
from tests.mtlx_files import graph, mtlx, node, surface, taken, value, wire
from tests.usd_files import PNG, QUAD, mesh, usda, usdz
from tests.usd_looks import UV

pytest.importorskip("MaterialX")
pytestmark = [pytest.mark.usd, pytest.mark.slow]

OAK = PNG(np.full((2, 2, 3), (200, 100, 50), np.uint8))
BOUND = QUAD + UV + "rel material:binding = {}\n"
PLAIN = surface(
    "standard_surface", value("base", 1), value("base_color", [0.8, 0.4, 0.2]), value("metalness", 0.5),
    value("specular_roughness", 0.3), value("thin_walled", "false", "boolean"), name="Plain",
)  # fmt: skip
IMAGE = node(
    "tiledimage", "img", "color3", value("file", "oak.png", "filename", colorspace="srgb_texture"),
    value("uvtiling", "2 3", "vector2"), wire("texcoord", "uv", "vector2"),
)  # fmt: skip
OAKEN = graph(
    '<input name="by" type="float" value="0.5"/>', node("texcoord", "uv", "vector2"), IMAGE,
    node("multiply", "tinted", "color3", wire("in1", "img"), '<input name="in2" type="float" interfacename="by"/>'),
    out="tinted color3",
) + surface(
    "open_pbr_surface", '<input name="base_color" type="color3" nodegraph="NG" output="out"/>',
    value("specular_roughness", 0.25), name="Oak",
)  # fmt: skip
LOOKS = mtlx(PLAIN, OAKEN).replace(b"<nodegraph", b'<nodegraph fileprefix="../tex/"')


def scene(look: str, path: str = "/Look") -> bytes:
    """A square in a material."""
    return usda(f"{look}\n" + mesh("Sign", body=BOUND.format(f"<{path}>")))


def worn(store: AssetStore, root: bytes, **files: bytes) -> tuple[dict[str, Any], Imported]:
    parts = {"looks/looks.mtlx": LOOKS, "tex/oak.png": OAK} | files
    found = store.scene(store.add(usdz({"root.usda": root, **parts})).id)
    return found.document["materials"][found.document["shapes"][0]["material"]], found


@pytest.mark.parametrize(
    ("name", "root"),
    [
        ("Plain", scene('def "Look" (references = @looks/looks.mtlx@</MaterialX/Materials/Plain>) { }')),
        ("Oak", scene('def "Look" (references = @./looks/looks.mtlx@</MaterialX/Materials/Oak>) { }')),
        ("Oak", scene('def "L" (payload = @looks/looks.mtlx@</MaterialX/Materials>) { }', "/L/Oak")),
        ("Oak", scene('def "L" (references = @looks/looks.mtlx@) { }', "/L/Materials/Oak")),
        ("Plain", usda(mesh("Sign", body=BOUND.format("</MaterialX/Materials/Plain>")),
                       "metersPerUnit = 1\n    subLayers = [@looks/looks.mtlx@]")),
    ],
)  # fmt: skip
def test_a_material_is_what_its_file_alone_makes(store: AssetStore, name: str, root: bytes) -> None:
    material, found = worn(store, root)
    assert not found.warnings
    alone = taken(store, {"looks/looks.mtlx": LOOKS, "tex/oak.png": OAK})
    expected = dict(alone.document["materials"][name])
    textures = found.document.get("textures", {})
    if name == "Oak":
        shown, other = (textures[material["base_color"]["texture"]],
                        alone.document["textures"][expected["base_color"]["texture"]])  # fmt: skip
        assert store.read(shown["asset"]) == store.read(other["asset"]) == OAK
        for key in ("color_space", "wrap", "scale"):
            assert shown.get(key) == other.get(key), key
        assert (material.pop("base_color")["factor"], expected.pop("base_color")["factor"]) == (0.5, 0.5)
    assert material == expected


def test_a_layer_says_more_of_a_material_than_its_file(store: AssetStore) -> None:
    stronger = 'over "SPlain" {\nfloat inputs:specular_roughness = 0.75\n}\n'
    look = f'def "Look" (references = @looks/looks.mtlx@</MaterialX/Materials/Plain>) {{ {stronger} }}'
    material, found = worn(store, scene(look))
    assert (material["roughness"], material["metallic"], found.warnings) == (0.75, 0.5, [])


def test_files_that_a_file_includes_are_read(store: AssetStore) -> None:
    whole = mtlx('<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="looks/looks.mtlx"/>')
    look = 'def "Look" (references = @all.mtlx@</MaterialX/Materials/Plain>) { }'
    material, found = worn(store, scene(look), **{"all.mtlx": whole, "looks/looks.mtlx": mtlx(PLAIN)})
    assert material["metallic"] == 0.5
    assert [each["pointer"] for each in found.warnings] == ["tex/oak.png"], "which nothing uses"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"<materialx", "it is not well-formed XML"),
        (b'<!DOCTYPE materialx [<!ENTITY a "b">]>' + LOOKS[21:], "a DOCTYPE and entities are refused"),
        (b"", "is not read|no element"),
    ],
)
def test_a_broken_file_is_left_out(store: AssetStore, text: bytes, said: str) -> None:
    look = 'def "Look" (references = @looks/looks.mtlx@</MaterialX/Materials/Plain>) { }'
    material, found = worn(store, scene(look), **{"looks/looks.mtlx": text})
    assert material["base_color"] == [0.8] * 3
    (first, *_) = [each["detail"] for each in found.warnings if "left out" in each["detail"]]
    assert any(each in first for each in said.split("|")), first


def test_a_value_that_is_none_is_told(store: AssetStore) -> None:
    text = LOOKS.replace(b'"0.3"', b'"rough"')
    look = 'def "Look" (references = @looks/looks.mtlx@</MaterialX/Materials/Plain>) { }'
    material, found = worn(store, scene(look), **{"looks/looks.mtlx": text})
    assert material["metallic"] == 0.5
    (told,) = [each for each in found.warnings if each["pointer"] != "tex/oak.png"]  # which nothing uses
    assert told["pointer"] == "looks/looks.mtlx"
    assert "SPlain/specular_roughness is no float, 'rough'" in told["detail"]


def test_nodes_that_read_each_other_end(store: AssetStore) -> None:
    circle = node("multiply", "a", "color3", wire("in1", "b")) + node("multiply", "b", "color3", wire("in1", "a"))
    text = mtlx(circle, surface("standard_surface", wire("base_color", "a"), name="Plain"))
    look = 'def "Look" (references = @l.mtlx@</MaterialX/Materials/Plain>) { }'
    _, found = worn(store, scene(look), **{"l.mtlx": text})
    assert any("not supported" in each["detail"] for each in found.warnings)


def test_the_nodes_of_all_materials_are_bounded(store: AssetStore) -> None:
    many = graph(*(node("constant", f"c{k}", "float") for k in range(60)),
                 *(node("add", f"a{k}", "float", wire("in1", f"a{k - 1}" if k else "c0", "float"),
                        wire("in2", f"c{k % 60}", "float")) for k in range(500)), out="a499 float")  # fmt: skip
    rough = '<input name="specular_roughness" type="float" nodegraph="NG" output="out"/>'
    text = mtlx(many, *(surface("standard_surface", rough, name=f"M{k}") for k in range(25)))
    look = 'def "Look" (references = @looks/looks.mtlx@</MaterialX/Materials/M0>) { }'
    _, found = worn(store, scene(look), **{"looks/looks.mtlx": text})
    assert any("more than the 10000 nodes allowed" in each["detail"] for each in found.warnings)


def test_the_command_line_takes_them_and_their_images_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    root = scene('def "Look" (references = @looks/looks.mtlx@</MaterialX/Materials/Oak>) { }')
    for name, data in {"in/root.usda": root, "in/looks/looks.mtlx": LOOKS, "in/tex/oak.png": OAK}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(data)
    assert main(["import", str(tmp_path / "in/root.usda"), "-o", str(tmp_path / "s.json")]) == 0
    assert "warning" not in capsys.readouterr().err
    (shown,) = json.loads((tmp_path / "s.json").read_text())["textures"].values()
    assert (tmp_path / shown["asset"]).read_bytes() == OAK
