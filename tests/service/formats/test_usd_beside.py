"""USD layers whose parts lie beside them: on disk as the command line takes them, and in a zip of their folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.formats.formats import CRATE
from service.formats.read.usd_names import names_in_layer
from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.usd_files import material, mesh, texture, usda, usdc, usdz

pytestmark = [pytest.mark.usd, pytest.mark.slow]

OAK = make.png(np.full((2, 2, 3), (200, 100, 50), np.uint8))
UVS = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")'
LOOK = material("M", "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>", texture("M", "../tex/oak.png"))
PART = 'metersPerUnit = 1\n    defaultPrim = "Q"'
QUAD = usda(mesh("Q", f"rel material:binding = </M>\n{UVS}"), f"{PART}\n    subLayers = [@./looks/look.usda@]")
ROOT = """
def "A" (
    references = @./parts/box.usda@
    variants = { string size = "small" }
    prepend variantSets = "size"
)
{
    variantSet "size" = {
        "small" { }
        "large" ( payload = @large.usda@ ) { }
    }
}
"""


def written(folder: Path, files: Mapping[str, bytes]) -> None:
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def folder_of_layers(scratch: Path) -> dict[str, bytes]:
    """A text that names a binary layer, which names a text, which names an image; and one of another variant."""
    inner = QUAD.replace(b"./looks", b"../looks")
    return {
        "root.usda": usda(ROOT, "metersPerUnit = 1\n    subLayers = [@parts/quad.usdc@]"), "tex/oak.png": OAK,
        "parts/quad.usdc": usdc(inner, scratch), "parts/box.usda": usda('def Cube "B" { }', 'defaultPrim = "B"'),
        "looks/look.usda": usda(LOOK), "large.usda": usda(""), "other.usda": usda(mesh("Other")),
    }  # fmt: skip


@pytest.fixture(autouse=True)
def data_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))


def brought(file: Path, folder: Path) -> dict[str, Any]:
    assert main(["import", str(file), "-o", str(folder / "s.json")]) == 0
    return dict(json.loads((folder / "s.json").read_text()))


def test_a_layer_on_disk_brings_what_it_names_and_what_that_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path / "in", folder_of_layers(tmp_path))
    document = brought(tmp_path / "in/root.usda", tmp_path)
    assert "warning" not in capsys.readouterr().err
    assert [shape["name"] for shape in document["shapes"]] == ["Q", "A"]
    (shown,) = document["textures"].values()
    assert (tmp_path / shown["asset"]).read_bytes() == OAK


def test_a_file_outside_of_the_folder_is_told_and_may_be_allowed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = {"quad.usda": usda(mesh("Q"), PART), "in/root.usda": usda('def "A" (references = @../quad.usda@) { }')}
    written(tmp_path, {**files, "in/shown.usda": files["in/root.usda"] + mesh("B").encode()})
    brought(tmp_path / "in/shown.usda", tmp_path)
    said = capsys.readouterr().err
    assert "'../quad.usda' leaves the scene's folder; --asset-root DIR allows another one" in said
    assert "../quad.usda: it refers to another file" in said
    target = ["-o", str(tmp_path / "s.json")]
    assert main(["import", str(tmp_path / "in/root.usda"), *target]) == 2
    assert "no triangles: it refers to another file, '../quad.usda'" in capsys.readouterr().err
    assert main(["import", str(tmp_path / "in/root.usda"), *target, "--asset-root", str(tmp_path)]) == 0
    assert "warning" not in capsys.readouterr().err


def test_a_layer_that_others_name_without_composing_it_is_no_model_of_its_own(store: AssetStore) -> None:
    """An origin, a clip, a package, which stays closed."""
    origin = usda(mesh("Q", api="assetInfo = { asset identifier = @root.usda@ }"), PART)
    root = usda('def "A" (references = @quad.usda@)\n{\nasset made = @source.usda@\n}')
    files = {"root.usda": root, "quad.usda": origin, "source.usda": usda(mesh("S"))}
    info = store.add(usdz(files))
    assert info.warnings is None and len(store.scene(info.id).document["shapes"]) == 1
    several = usdz({**files, "b.usda": usda('def "A" (references = @c.usdz@) { }'), "c.usdz": usdz({"c.usda": QUAD})})
    with pytest.raises(AssetError, match=r"the zip holds 2 models, root.usda and b.usda"):
        store.add(several)


@pytest.mark.parametrize("form", ["text", "binary"])
def test_all_ways_of_naming_a_file_are_seen(form: str, tmp_path: Path) -> None:
    layer = usda(
        """
        # @comment.usda@
        def "A" (
            doc = "in words @word.png@; \\"@quoted.png@\\""
            references = [@a.usd@, @@@b@2.usda@@@</P>]
        )
        {
            asset one = "c.png"
            asset[] more = [@d.exr@, @../e f.jpg@]
            string said = '''@many.png@'''
        }
        """
    )
    found = names_in_layer(usdc(layer, tmp_path) if form == "binary" else layer)
    assert {"a.usd", "b@2.usda", "c.png", "d.exr", "../e f.jpg"} <= set(found)
    assert not {"comment.usda", "word.png", "quoted.png", "many.png"} & set(found)


def test_a_broken_binary_layer_names_nothing(tmp_path: Path) -> None:
    layer = usdc(usda(mesh("Q")), tmp_path)
    assert len(layer) > 500 and names_in_layer(usdc(usda(ROOT), tmp_path))
    for cut in range(0, len(layer), 97):
        names_in_layer(layer[:cut])
        names_in_layer(layer[:cut] + b"\xff" * 64 + layer[cut + 64 :])
    assert names_in_layer(CRATE) == names_in_layer(b"PK\x03\x04") == []
