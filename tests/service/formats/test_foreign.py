"""FBX, COLLADA, 3DS, X3D, 3MF and STEP: what a library makes of them comes in by the one glTF reader."""

from __future__ import annotations

import io
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.cli.program import main
from service.config import Config
from service.formats.errors import ParseError
from service.formats.formats import FOREIGN, advice, sniff
from service.formats.read.archive import zipped
from service.formats.read.foreign.glb import Glb
from service.formats.sandbox.sandbox import Sandbox
from service.formats.types import SceneFile
from service.server.assets.store import asset_limits
from tests.service.formats.foreign_files import FILES, STEP, dae, fbx, package_3mf, three_ds, x3d
from tests.serving import Server


@pytest.fixture(scope="module")
def sandbox() -> Iterator[Sandbox]:
    with Sandbox(asset_limits(Config())) as found:
        yield found


def bounds(scene: SceneFile) -> np.ndarray:
    assert scene.bounds is not None
    return np.array(scene.bounds)


def details(scene: SceneFile) -> str:
    return "; ".join(each["detail"] for each in scene.warnings)


def material(scene: SceneFile, name: str) -> dict[str, Any]:
    found: dict[str, Any] = scene.document["materials"][name]
    return found


@pytest.mark.parametrize("format", FILES)
def test_it_is_known_by_its_bytes(format: str) -> None:
    assert sniff(FILES[format]) == format and format in FOREIGN


@pytest.mark.models
@pytest.mark.parametrize(("unit", "metres"), [(100.0, 1.0), (1.0, 0.01), (2.54, 0.0254)])
def test_fbx_is_in_metres(sandbox: Sandbox, unit: float, metres: float) -> None:
    scene = sandbox.parse_scene("fbx", fbx(unit))
    assert scene.triangles == 12
    assert bounds(scene) == pytest.approx(np.array([[-1] * 3, [1] * 3]) * metres, rel=1e-5)
    assert material(scene, "Red")["base_color"] == pytest.approx([0.8, 0.1, 0.1], abs=1e-6)
    (light,) = scene.document["lights"]
    assert light["type"] == "point" and light["position"] == pytest.approx([0, 5 * metres, 0], abs=1e-6)
    # So bright that white paper at the model's middle is white.
    assert max(light["intensity"]) == pytest.approx(math.pi * (5 * metres) ** 2, rel=1e-4)
    assert light["intensity"][2] == pytest.approx(0.25 * light["intensity"][0]) and "units" in details(scene)


@pytest.mark.models
def test_collada_has_its_unit_its_axis_its_camera_and_its_lights(sandbox: Sandbox) -> None:
    scene = sandbox.parse_scene("dae", dae())
    assert bounds(scene) == pytest.approx(np.array([[-0.01, 0, -0.01], [0.01, 0, 0.01]]), abs=1e-8)
    camera = scene.document["camera"]
    assert camera["position"] == pytest.approx([0, 0.05, 0], abs=1e-7), "5 cm up"
    assert camera["vfov"] == pytest.approx(math.degrees(2 * math.atan(math.tan(math.radians(30)) / 1.5)), abs=1e-3)
    (light,) = scene.document["lights"]
    assert light["type"] == "spot" and light["direction"] == pytest.approx([0, -1, 0], abs=1e-6)
    assert light["outer_angle"] == pytest.approx(20, abs=0.1) and "ambient" in details(scene)
    paint = material(scene, "Blue paint")
    assert paint["base_color"] == pytest.approx([0.2, 0.4, 0.6], abs=1e-6)
    assert "ior" not in paint, "1 is what exporters write where they have none"
    metre = sandbox.parse_scene("dae", dae(1.0, "Y_UP"))
    assert bounds(metre) == pytest.approx(np.array([[-1, -1, 0], [1, 1, 0]]), abs=1e-7)


@pytest.mark.models
@pytest.mark.parametrize(
    ("unit", "metres"), [(None, 1e-3), ("millimeter", 1e-3), ("micron", 1e-6), ("inch", 0.0254), ("meter", 1.0)]
)
def test_3mf_is_in_metres_with_z_up_and_in_srgb(sandbox: Sandbox, unit: str | None, metres: float) -> None:
    scene = sandbox.parse_scene("3mf", package_3mf(unit))
    assert scene.triangles == 4
    assert bounds(scene) == pytest.approx(np.array([[0, 0, -10], [10, 20, 0]]) * metres, rel=1e-5, abs=1e-12)
    (found,) = scene.document["materials"].values()
    assert found["base_color"] == pytest.approx([0.5029, 0, 0], abs=2e-3)


@pytest.mark.models
def test_a_scene_without_meshes_is_refused(sandbox: Sandbox) -> None:
    """Assimp makes a mesh of the nodes' places then."""
    data = re.sub(rb"<library_geometries>.*</library_geometries>", b"", dae(), flags=re.DOTALL)
    data = re.sub(rb"<instance_geometry.*</instance_geometry>", b"", data, flags=re.DOTALL)
    with pytest.raises(ParseError, match="the scene has no triangles"):
        sandbox.parse_scene("dae", data)


@pytest.mark.models
def test_x3d_and_3ds(sandbox: Sandbox) -> None:
    scene = sandbox.parse_scene("x3d", x3d())
    assert bounds(scene) == pytest.approx(np.array([[-1] * 3, [1] * 3])) and scene.triangles == 12
    (green,) = scene.document["materials"].values()
    assert green["base_color"] == pytest.approx([0.1, 0.7, 0.1], abs=1e-6)
    scene = sandbox.parse_scene("3ds", three_ds())
    assert bounds(scene) == pytest.approx(np.array([[-1] * 3, [1] * 3])) and scene.triangles == 12
    assert material(scene, "Green")["base_color"] == pytest.approx([25 / 255, 178 / 255, 25 / 255], abs=1e-6)


@pytest.mark.models
@pytest.mark.parametrize("format", FILES)
def test_what_is_broken_is_refused_and_the_next_file_is_read(sandbox: Sandbox, format: str) -> None:
    whole = FILES[format]
    for data in (whole[: len(whole) // 2], whole[:64], whole[: len(whole) // 2] + bytes(500)):
        try:
            sandbox.parse_scene(format, data)
        except ParseError as error:
            assert error.detail
    assert sandbox.parse_scene(format, whole).triangles


def square(color: tuple[int, int, int], format: str) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (4, 4), color).save(file, format)
    return file.getvalue()


def test_images_are_put_into_the_file() -> None:
    """Those that glTF has as they are, others as PNG; what is not there goes with its textures, and is told."""
    files = {"a.png": square((9, 8, 7), "PNG"), "b.tga": square((1, 2, 3), "TGA"), "c.png": b"nonsense"}
    names = [*files, "d.jpg"]
    slots = ["baseColorTexture", "metallicRoughnessTexture"]
    values = [{"pbrMetallicRoughness": {slots[0]: {"index": k}}, "emissiveTexture": {"index": 3}} for k in range(4)]
    root = {
        "images": [{"uri": name} for name in names],
        "textures": [{"source": k} for k in range(4)],
        "materials": values,
    }
    file = Glb(root, bytearray())
    file.embed(files.get)
    kept = [material["pbrMetallicRoughness"].keys() for material in root["materials"]]
    assert [list(each) for each in kept] == [[slots[0]], [slots[0]], [], []]
    assert not any("emissiveTexture" in material for material in root["materials"])
    assert "'c.png' is no image" in file.warnings[0] and "'d.jpg' is not there" in file.warnings[1]
    pictures = [Image.open(io.BytesIO(file._view(root["images"][k]["bufferView"]))) for k in (0, 1)]
    assert [each.format for each in pictures] == ["PNG", "PNG"]
    assert [each.convert("RGB").getpixel((0, 0)) for each in pictures] == [(9, 8, 7), (1, 2, 3)]
    again = Glb.read(file.written())
    assert again.root == file.root and bytes(again.data).startswith(bytes(file.data))


@pytest.mark.models
@pytest.mark.parametrize("format", FILES)
def test_over_rest_and_on_the_command_line(server: Server, tmp_path: Path, format: str) -> None:
    answer = server.http.post("/v1/assets", content=FILES[format], params={"filename": f"a.{format}"})
    assert answer.status_code == 201 and answer.json()["kind"] == "scene" and answer.json()["format"] == format
    document = server.http.get(f"/v1/assets/{answer.json()['id']}/scene").json()
    assert document["shapes"] and document["materials"]
    (tmp_path / f"a.{format}").write_bytes(FILES[format])
    assert main(["import", str(tmp_path / f"a.{format}"), "-o", str(tmp_path / "a.json")]) == 0
    assert json.loads((tmp_path / "a.json").read_text())["shapes"]


@pytest.mark.models
def test_a_texture_in_a_zip_stands_in_the_place_of_the_colour(sandbox: Sandbox) -> None:
    """Of 3DS, whose material is green: where the image is there that counts, and where it is not the colour."""
    textured = three_ds("wood.png")
    scene = sandbox.parse_scene("zip", zipped({"m/a.3ds": textured, "tex/Wood.PNG": square((9, 9, 9), "PNG")}))
    assert material(scene, "Green")["base_color"] == {
        "texture": next(iter(scene.document["textures"])),
        "factor": 1.0,
    }
    assert "the only file of that name" in details(scene)
    scene = sandbox.parse_scene("zip", zipped({"m/a.3ds": textured}))
    assert material(scene, "Green")["base_color"] == pytest.approx([25 / 255, 178 / 255, 25 / 255], abs=1e-6)
    assert "is not there" in details(scene)


@pytest.mark.parametrize(
    ("name", "head", "said"),
    [
        ("a.blend", b"BLENDER-v402", "Blender"),
        ("a.bin", b"BLENDER-v402", "Blender"),
        ("scene.max", b"\xd0\xcf\x11\xe0", "3ds Max"),
        ("a.C4D", b"QC4DC4D6", "Cinema 4D"),
        ("a.mb", b"FOR8", "Maya"),
        ("a.skp", b"\xff\xfe\xff\x0eS\0k\0", "SketchUp"),
        ("part.sldprt", b"\xd0\xcf\x11\xe0", "STEP"),
    ],
)
def test_what_stays_unreadable_is_refused_by_name(server: Server, name: str, head: bytes, said: str) -> None:
    answer = server.http.post("/v1/assets", content=head + bytes(200), params={"filename": name})
    assert answer.status_code == 415 and said in answer.json()["detail"] and "export" in answer.json()["detail"]
    assert advice(b"\x89PNG", "a.png") is None


@pytest.mark.cad
def test_step(sandbox: Sandbox) -> None:
    """The size in metres, z up. A file of millimetres: a box of 10, 20 and 30."""
    scene = sandbox.parse_scene("step", STEP)
    assert scene.triangles == 12
    assert bounds(scene) == pytest.approx(np.array([[0, 0, -0.02], [0.01, 0.03, 0]]), abs=1e-8)
    with pytest.raises(ParseError, match="no shapes"):
        sandbox.parse_scene("step", STEP[: len(STEP) // 2])
    assert sandbox.parse_scene("step", STEP).triangles == 12


def test_step_is_known_by_its_bytes() -> None:
    assert sniff(STEP) == "step"
