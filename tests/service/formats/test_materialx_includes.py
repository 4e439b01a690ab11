"""MaterialX files that include others, which are parts of the upload or of the file's folder."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from service.cli.program import main
from service.problems import AssetError
from service.server.assets import AssetStore
from tests.asset_files import png
from tests.mtlx_files import from_graph, graph, material, mtlx, node, surface, taken, value

BLUE = png(np.full((2, 2, 3), (50, 100, 200), np.uint8))


def whole(*names: str, elements: str = "", space: str = "") -> bytes:
    head = b'<materialx xmlns:xi="http://www.w3.org/2001/XInclude" '
    words = "".join(f'<xi:include href="{name}"/>' for name in names)
    return mtlx(words, elements, space=space).replace(b"<materialx ", head)


IMAGE = node("image", "img", "color3", value("file", "wood.png", "filename", colorspace="srgb_texture"))
GRAPH = graph(IMAGE, out="img color3")
LOOK = surface("gltf_pbr", from_graph("base_color", "out"))
FILES = {
    "look.mtlx": whole("lib/graph.mtlx", "stdlib/stdlib_defs.mtlx", elements=LOOK),
    "lib/graph.mtlx": whole("../colors.mtlx", elements=GRAPH), "lib/wood.png": BLUE,
    "colors.mtlx": whole("look.mtlx", elements=surface("gltf_pbr", value("base_color", [1, 0.5, 0]), name="N")),
}  # fmt: skip


def test_what_a_file_includes_is_a_part_of_it(store: AssetStore) -> None:
    """In circles as well; the standard library is there without its file."""
    found = taken(store, FILES)
    assert set(found.document["materials"]) == {"M", "N"}
    assert found.document["materials"]["M"]["base_color"] == {"texture": "wood"}
    (warning,) = found.warnings
    assert "'lib/wood.png', the only file of that name, is used" in warning["detail"]


def test_what_is_included_and_not_there_is_told(store: AssetStore) -> None:
    found = taken(store, whole("gone.mtlx", elements=surface("gltf_pbr", value("roughness", 0.25))))
    (warning,) = found.warnings
    assert material(found)["roughness"] == 0.25 and "it includes 'gone.mtlx', which is not" in warning["detail"]
    with pytest.raises(AssetError, match=r"it includes 'gone.mtlx'"):
        store.add(whole("gone.mtlx"))


def test_a_colour_space_is_that_of_the_file_that_says_it(store: AssetStore) -> None:
    said = surface("gltf_pbr", value("base_color", [0.5, 0.5, 0.5]))
    files = {"a.mtlx": whole("b.mtlx", space="lin_rec709"), "b.mtlx": whole(elements=said, space="srgb_texture")}
    assert material(taken(store, files))["base_color"] == pytest.approx(0.2140411)


def test_an_included_file_that_is_broken_is_named(store: AssetStore) -> None:
    with pytest.raises(AssetError, match=r"b.mtlx:1: it is not well-formed XML"):
        taken(store, {"a.mtlx": whole("b.mtlx", elements=LOOK), "b.mtlx": b"<materialx>"})
    many = {f"{k}.mtlx": whole(f"{k + 1}.mtlx") for k in range(150)}
    with pytest.raises(AssetError, match=r"it has 150 MaterialX files|includes more than the 100 files allowed"):
        taken(store, many)


def test_the_command_line_takes_what_is_included_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    for name, data in FILES.items():
        (tmp_path / "in" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "in" / name).write_bytes(data)
    target = tmp_path / "s.json"
    assert main(["import", str(tmp_path / "in/look.mtlx"), "-o", str(target)]) == 0
    assert set(json.loads(target.read_text())["materials"]) == {"M", "N"}
    assert "is not in the upload" not in capsys.readouterr().err
