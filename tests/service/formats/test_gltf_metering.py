"""The exposure that import proposes for a file's own lights, beside what the renderer makes of them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.cli.program import main
from service.formats.images import read_metadata
from service.formats.read.gltf.importer import read_scene
from service.formats.read.scenes import looks
from service.formats.types import AssetLimits, SceneFile
from tests.gltf_files import QUAD, Gltf
from tests.gltf_lights import BLENDER_LAMP, LIGHTS, SUN, looking, plastered, room, start_up, wall
from tests.serving import Server

LIMITS = AssetLimits()


def read(file: Gltf) -> SceneFile:
    return read_scene(file.glb(), LIMITS)


def said(scene: SceneFile) -> str:
    return " ".join(warning["detail"] for warning in scene.warnings if LIGHTS in warning["pointer"])


@pytest.fixture
def data_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    return tmp_path / "data"


@pytest.mark.parametrize(("light", "least", "most"), [(BLENDER_LAMP, -10.5, -9), (SUN, -13, -11.5)])
def test_lights_from_blender(light: dict[str, Any], least: float, most: float) -> None:
    scene = read(start_up(light))
    assert scene.exposure is not None and least <= scene.exposure <= most
    assert f"an exposure of {scene.exposure:g} suits them" in said(scene) and "there is no sky" in said(scene)
    (kept,) = scene.document["lights"]
    assert max(kept.get("intensity", kept.get("irradiance"))) == pytest.approx(light["intensity"])


@pytest.mark.parametrize("intensity", [0.7, 3, 12])
def test_lights_as_realtime_programs_write_them_are_left_alone(intensity: float) -> None:
    scene = read(start_up({"type": "directional", "intensity": intensity}))
    assert scene.exposure is None and "exposure" not in said(scene) and "there is no sky" in said(scene)


def test_lights_too_dim_to_see_by() -> None:
    assert (read(start_up({"type": "point", "intensity": 0.5})).exposure or 0) > 5


def test_a_file_without_lights_has_no_exposure() -> None:
    file = plastered()
    wall(file, [0, 0, 0], [1, 0, 0], [0, 1, 0])
    scene = read(file)
    assert scene.exposure is None and not scene.warnings


def test_light_that_reaches_nothing_says_nothing() -> None:
    assert read(start_up({"type": "point", "intensity": 0})).exposure is None
    behind = start_up(SUN)
    behind.tree["nodes"][-2]["matrix"] = looking([-7, -5, -7], [0, 0, 0])  # lights the sides that are not seen
    assert read(behind).exposure is None


def test_unlit_and_clear_materials_do_not_count() -> None:
    file = start_up(SUN)
    expected = read(file).exposure
    glass = {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}
    faded = {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.2]}}
    for material in (glass, faded):
        clear = file.mesh(file.primitive({"POSITION": QUAD * 20}, material=file.add("materials", material)))
        file.node(mesh=clear, matrix=looking([5, 4, 3], [0, 0, 0]))  # before the camera and the light
    unlit = {"doubleSided": True, "extensions": {"KHR_materials_unlit": {}}}
    backdrop = file.mesh(file.primitive({"POSITION": QUAD * 9}, material=file.add("materials", unlit)))
    file.node(mesh=backdrop, matrix=looking([-4, -3, -4], [7, 5, 7]))
    assert read(file).exposure == expected


def test_materials_look_alike_from_far_whatever_their_model() -> None:
    for own, other in (
        ({"emission": [1.0, 2.0, 0.5], "base_color": [0.5, 0.25, 0.1]},
         {"emission_luminance": 683.0, "emission_color": [1.0, 2.0, 0.5], "base_color": [0.5, 0.25, 0.1]}),
        ({"transmission": 0.5}, {"transmission_weight": 0.5}),
        ({"alpha": 0.5}, {"geometry_opacity": 0.5}),
        ({}, {"base_color": 1.0}),
    ):  # fmt: skip
        pair = {"type": "principled", **own}, {"type": "openpbr", **other}
        for look in (looks.albedo, looks.emission, looks.is_clear):
            assert look(pair[0]) == pytest.approx(look(pair[1]))


@pytest.mark.parametrize("file", [start_up(BLENDER_LAMP), room()], ids=["start-up", "room"])
def test_it_agrees_with_the_renderer(gpu: Any, file: Gltf, tmp_path: Path, data_dir: Path) -> None:
    """In the room, where most is lit by reflections, shadows make 4 stops of difference."""
    model, picture = tmp_path / "m.glb", tmp_path / "p.npy"
    model.write_bytes(file.glb())
    small = ["--spp", "64", "--set", "width=48", "--set", "height=36"]
    assert main(["render", str(model), "-o", str(picture), *small]) == 0
    luminance = np.load(picture)[..., :3] @ [0.2126, 0.7152, 0.0722]
    lit_pixels = luminance[luminance > luminance.max() / 1000]  # not the edges of pixels that a filter smears
    wanted = math.log2(0.18) - np.log2(lit_pixels).mean()
    assert read(file).exposure == pytest.approx(wanted, abs=1)


def test_render_takes_exposure_and_size_from_the_model(
    gpu: Any, tmp_path: Path, data_dir: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.glb"
    model.write_bytes(start_up(BLENDER_LAMP).glb())

    def rendered(*more: str) -> tuple[tuple[int, int], float, float, str]:
        path = tmp_path / "p.png"
        assert main(["render", str(model), "-o", str(path), "--spp", "1", *more]) == 0
        image = Image.open(path)
        pixels = np.asarray(image.convert("RGBA"))
        metadata = read_metadata(path.read_bytes())
        assert metadata is not None
        brightest = float(pixels[pixels[..., 3] > 250][:, :3].max())
        return image.size, metadata["view"]["exposure"], brightest, capsys.readouterr().err

    size, exposure, brightest, told = rendered("--set", "resolution_scale=0.1")
    assert size == (63, 42) and abs(63 / 42 - 1.5) < 0.01  # a tenth of 627 x 418, as many pixels as 512 x 512
    assert exposure == -10 and 100 < brightest < 245
    assert "note: exposure -10, which suits the file's lights" in told and "note: 627 x 418 pixels" in told
    size, exposure, brightest, told = rendered("--exposure", "0", "--set", "width=60")
    assert size == (60, 40) and exposure == 0 and brightest > 250 and "note: exposure" not in told
    size, *_, told = rendered("--set", "width=20", "--set", "height=20")
    assert size == (20, 20) and "pixels" not in told


def test_import_says_it(tmp_path: Path, data_dir: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "m.glb"
    model.write_bytes(start_up(SUN).glb())
    assert main(["import", str(model), "-o", str(tmp_path / "s.json")]) == 0
    told = capsys.readouterr().err
    assert "an exposure of -12" in told and "there is no sky" in told
    assert "1.5 times as wide as high: --set width=627 --set height=418 renders it" in told
    assert json.loads((tmp_path / "s.json").read_text())["lights"][0]["irradiance"] == [6830] * 3


def test_over_rest(server: Server) -> None:
    info = server.http.post("/v1/assets", content=start_up(SUN, 1.6).glb()).json()
    assert info["exposure"] <= -11 and info["aspect_ratio"] == 1.6
    assert any("suits them" in warning["detail"] for warning in info["warnings"])
    answer = server.http.get(f"/v1/assets/{info['id']}/scene")
    assert float(answer.headers["sunbox-exposure"]) == info["exposure"]
    assert "environment" not in answer.json()
    described = server.http.get("/openapi.json").json()["components"]["schemas"]["Asset"]["properties"]
    assert {"exposure", "aspect_ratio", "warnings"} <= described.keys()
