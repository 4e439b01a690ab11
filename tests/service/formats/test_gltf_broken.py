"""What is said of a glTF file that is broken, or that asks for what is not supported."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.formats.errors import ParseError
from service.formats.formats import sniff
from service.formats.read.gltf.importer import read_scene
from service.formats.types import AssetLimits, SceneFile
from tests.gltf_files import QUAD, Gltf

LIMITS = AssetLimits()


def text(file: Gltf, **more: Any) -> str:
    """As a .gltf that holds its buffer."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(file.binary).decode()
    return json.dumps({**file.tree, "buffers": [{"byteLength": len(file.binary), "uri": uri}], **more}, indent=1)


def square(**node: Any) -> Gltf:
    file = Gltf()
    file.node(mesh=file.mesh(), **node)
    return file


def read(data: str | bytes) -> SceneFile:
    return read_scene(data.encode() if isinstance(data, str) else data, LIMITS)


def refusal(data: str | bytes) -> ParseError:
    with pytest.raises(ParseError) as found:
        read(data)
    return found.value


def noted(scene: SceneFile) -> dict[str, str]:
    return {warning["pointer"]: warning["detail"] for warning in scene.warnings}


def test_a_mistake_in_json_has_its_line_and_column() -> None:
    assert "nor JSON: line 2, column 5: expecting property name" in refusal('{"asset": {},\n    }').detail
    assert "nested too deeply" in refusal('{"asset":' + "[" * 100_000).detail
    assert "not UTF-8" in refusal(b'{"asset": "\xff"}').detail


@pytest.mark.parametrize("literal", ["NaN", "Infinity", "-Infinity"])
def test_numbers_that_json_lacks_are_refused(literal: str) -> None:
    file = square(translation=[1, 2, 3], name='a "NaN" in a text is none')
    found = refusal(text(file).replace('  "translation": [\n    1,', f'  "translation": [\n    {literal},'))
    assert (found.pointer, found.detail) == ("/nodes/0/translation/0", f"must be a finite number, not {literal}")


def test_a_byte_order_mark_is_skipped() -> None:
    data = b"\xef\xbb\xbf" + text(square()).encode()
    assert sniff(data) == "gltf"
    assert len(read(data).document["shapes"]) == 1


def test_points_and_lines_are_named() -> None:
    file = Gltf()
    file.node(mesh=file.mesh(*(file.primitive(indices=None, mode=mode) for mode in (0, 0, 3))))
    found = refusal(file.glb())
    assert found.pointer == "/meshes/0/primitives/0"
    assert found.detail.startswith("the scene has no triangles: POINTS have no area")
    assert "(here and in 1 more place); LINE_STRIP have no area" in found.detail
    empty = Gltf()
    empty.mesh()
    empty.node()
    assert refusal(empty.glb()).detail == "the scene has no triangles: none of its nodes has a mesh"


def test_equal_warnings_are_one_with_a_count() -> None:
    file = square()
    for k in range(5):
        file.node(mesh=0, translation=[k, 0, 0], rotation=[0, 0, 0, 0])
    (warning,) = read(file.glb()).warnings
    assert warning["pointer"] == "/nodes/1/rotation" and warning["count"] == 5
    assert warning["detail"].endswith("the node is not turned (here and in 4 more places)")


def test_a_type_of_camera_that_does_not_exist() -> None:
    file = square()
    file.node(camera=file.add("cameras", {"type": "fish"}))
    assert "must be perspective or orthographic, not 'fish'" in noted(read(file.glb()))["/cameras/0/type"]


@pytest.mark.parametrize("body", ["AAAA*AAA", "AAAAA", "%%%", "ä"])
def test_what_is_no_base64(body: str) -> None:
    file = square()
    file.tree["buffers"] = [{"byteLength": len(file.binary), "uri": f"data:;base64,{body}"}]
    found = refusal(json.dumps(file.tree))
    assert found.pointer == "/buffers/0/uri" and found.detail.startswith("is not valid base64: ")


@pytest.mark.parametrize(
    "written", [str, lambda body: body.replace("+", "%2B"), lambda body: body[:8] + "\n" + body[8:]]
)
def test_base64_as_it_may_be_written(written: Callable[[str], str]) -> None:
    file = square()
    uri = "data:application/octet-stream;base64," + written(base64.b64encode(file.binary).decode())
    file.tree["buffers"] = [{"byteLength": len(file.binary), "uri": uri}]
    assert len(read(json.dumps(file.tree)).document["shapes"]) == 1


def test_a_bad_position_names_its_item_and_accessor() -> None:
    rows = QUAD.copy()
    rows[2, 1] = np.nan
    file = Gltf()
    file.node(mesh=file.mesh(file.primitive({"POSITION": rows}, np.array([0, 2, 3], "<u2"))))
    found = refusal(file.glb())
    assert found.pointer == "/meshes/0/primitives/0/attributes/POSITION"
    assert "item 2 of /accessors/0 is not finite or lies beyond 1e9 m: [1.0, nan" in found.detail


def test_a_required_extension_that_a_still_does_not_show() -> None:
    file = square()
    file.tree["extensionsRequired"] = ["KHR_interactivity", "EXT_structural_metadata"]
    file.tree["extensions"] = {"KHR_interactivity": {"graphs": []}}
    assert noted(read(file.glb())) == {
        f"/extensionsRequired/{k}": f"{name} is ignored: it changes nothing in a still picture"
        for k, name in enumerate(file.tree["extensionsRequired"])
    }


def test_a_buffer_without_data_names_what_has_them() -> None:
    file = square()
    file.tree["buffers"] = [{"byteLength": len(file.binary), "extensions": {"EXT_packed": {}}}]
    found = refusal(json.dumps(file.tree))
    assert found.pointer == "/buffers/0/uri" and "compressed form only (EXT_packed)" in found.detail


@pytest.mark.parametrize(
    "data",
    [
        b'{"asset": {"version": "2.0"},\n    }',
        b"{",
        b'{"asset": {"version": "2.0"}, "nodes": [NaN]}',
        b"glTF\x02\0\0\0",
        b"",
        text(square(translation=[0])).encode(),
    ],
)
def test_import_and_render_say_the_same(
    data: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    model = tmp_path / "m.gltf"
    model.write_bytes(data)
    said = []
    for command, output in (("import", "o.json"), ("render", "o.png")):
        assert main([command, str(model), "-o", str(tmp_path / output)]) == 2
        said.append(capsys.readouterr().err)
    assert said[0] == said[1] and said[0].startswith("error: ")
