"""The comparison with other renderers compares like with like: same camera, same places, same light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.bench.scenes import SOFT_SUN
from service.document import parse_scene
from service.pack import pack
from tests.bench import peer_blender, peer_scenes, peers
from tests.bench.__main__ import main


@pytest.mark.parametrize("case", peer_scenes.cases(), ids=lambda case: case.name)
def test_every_scene_is_described_for_both(case: peer_scenes.PeerCase) -> None:
    assert pack(parse_scene(case.scene), peer_scenes.BenchAssets()).warnings == []
    scene, arrays = peer_scenes.for_mitsuba(case, 64)
    assert sum(key.startswith("shape") for key in scene) == len(case.scene["shapes"])
    assert scene["integrator"]["max_depth"] == case.max_bounces + 1
    assert ("environment" in scene) == ("environment" in case.scene) == ("environment" in arrays)


def test_a_parallelogram_stands_where_ours_does() -> None:
    quad = {"type": "quad", "origin": [1, 2, 3], "u": [2, 0, 0], "v": [0, 0, -4], "material": "m"}
    matrix = np.reshape(peer_scenes._shape(quad, {})["to_world"]["matrix"], (4, 4))
    corners = [matrix @ [x, y, 0, 1] for x, y in ((-1, -1), (1, -1), (-1, 1))]
    assert np.allclose([c[:3] for c in corners], [[1, 2, 3], [3, 2, 3], [1, 2, -1]])
    assert np.allclose(matrix[:3, 2], [0, 1, 0])  # the outward side is the one that shines


def test_a_checker_has_as_many_fields_as_ours() -> None:
    checker = peer_scenes._checker({"type": "checker", "a": 0.75, "b": 0.1, "scale": [20, 10]})
    assert np.diag(np.reshape(checker["to_uv"]["matrix"], (4, 4))).tolist() == [10, 5, 1, 1]
    assert (checker["color0"]["value"], checker["color1"]["value"]) == ([0.75] * 3, [0.1] * 3)


def test_the_soft_sun_stands_where_the_scene_says() -> None:
    pixels = peer_scenes.BenchAssets().image(SOFT_SUN).pixels
    row, column = np.unravel_index(pixels[..., 0].argmax(), pixels.shape[:2])
    elevation, azimuth = 90 - (row + 0.5) * 180 / 256, (column + 0.5) * 360 / 512 - 180
    assert elevation == pytest.approx(np.degrees(np.arcsin(0.7 / 0.99**0.5)), abs=1)
    assert azimuth == pytest.approx(135, abs=1)  # from -Z towards +X, past it: towards +Z
    assert pixels.max() == pytest.approx(40.25, rel=0.01)


PLAIN = [case for case in peer_scenes.cases() if not case.is_textured]


@pytest.mark.parametrize("case", PLAIN, ids=lambda case: case.name)
def test_every_scene_is_described_in_triangles(case: peer_scenes.PeerCase) -> None:
    scene, arrays = peer_blender.for_cycles(case, 64)
    assert scene["shapes"] == [shape["material"] for shape in case.scene["shapes"]]
    assert set(scene["shapes"]) <= set(scene["materials"])
    assert scene["bounces"] == case.max_bounces - 1  # the first scattering is no bounce of theirs
    assert ("environment" in case.scene) == ("environment" in arrays)
    for i, shape in enumerate(case.scene["shapes"]):
        assert (f"normals{i}" in arrays) == (shape["type"] in ("sphere", "mesh"))
        assert arrays[f"faces{i}"].max() < len(arrays[f"vertices{i}"])


def test_triangles_face_outward_and_fill_what_they_stand_for() -> None:
    glass, box = (peer_blender.for_cycles(peer_scenes.cases()[i], 64)[1] for i in (4, 2))
    assert len(glass["faces0"]) == 64_000
    assert _volume(glass, 0) == pytest.approx(4 / 3 * np.pi, rel=5e-4)
    outward = np.einsum("ij,ij->i", glass["normals0"], glass["vertices0"] - [0, 0, 1])
    assert outward == pytest.approx(1, abs=1e-6)
    assert _volume(box, 6) == pytest.approx(0.594 * 0.594 * 0.595, rel=1e-5)
    lamp = box["vertices5"][box["faces5"]]
    across = np.cross(lamp[:, 1] - lamp[:, 0], lamp[:, 2] - lamp[:, 0])
    assert across.sum(axis=0) / 2 == pytest.approx([0, 0, -0.47 * 0.38], abs=1e-6)  # it shines downward
    assert np.allclose(lamp[..., 2], 1.995)


def _volume(arrays: dict[str, np.ndarray], i: int) -> float:
    corners = arrays[f"vertices{i}"][arrays[f"faces{i}"]].astype(np.float64)
    return float(np.linalg.det(corners).sum() / 6)


def test_the_sky_stands_as_ours_in_their_axes() -> None:
    ours = np.random.default_rng(5).normal(size=(50, 3))
    x, y, z = peer_blender.BLENDER_FROM_OURS @ ours.T
    theirs = 0.5 - np.arctan2(y, x) / (2 * np.pi)  # their equirectangular mapping, whose up is Z
    assert theirs == pytest.approx(0.5 + np.arctan2(ours[:, 0], -ours[:, 2]) / (2 * np.pi))
    assert z == pytest.approx(ours[:, 1])


def test_their_camera_looks_from_where_ours_does() -> None:
    document = {"position": [1, 2, 3], "target": [1, 2, 1], "vfov": 90}
    camera = peer_blender._camera(document)
    seen = [[1, 2, 1], [2, 2, 1], [1, 3, 1]]  # ahead, to the right, above
    world = np.c_[np.array(seen) @ peer_blender.BLENDER_FROM_OURS.T, np.ones(3)]
    local = world @ np.linalg.inv(camera["matrix"]).T
    assert np.allclose(local[:, :3], [[0, 0, -2], [1, 0, -2], [0, 1, -2]])
    assert camera["vfov"] == pytest.approx(np.pi / 2)


def test_the_table_has_a_line_for_each_renderer_that_ran() -> None:
    def side(speed: float, error: float) -> dict[str, Any]:
        return {"mpaths_per_s": speed, "samples": [4, 40], "rel_mse": [error, error / 10], "brightness": 0.5}

    row: dict[str, Any] = {"name": "box", "sunbox": side(6, 1e-3), "cycles": side(2, 4e-3)}
    row["ratios"] = {"cycles": peers._ratios(row["sunbox"], row["cycles"])}
    _, ours, theirs = peers.table([row]).splitlines()
    assert ours.split() == ["box", "Sunbox", "6.00", "4", "40", "1.0e-03", "1.0e-04"]
    assert theirs.split() == ["Cycles", "2.00", "3.00", "4", "40", "4.0e-03", "0.25", "4.0e-04", "0.25", "1.0000"]


def test_a_renderer_to_stand_beside_has_to_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["peers"]) == 2
    assert "--cycles PYTHON" in capsys.readouterr().err


def test_an_interpreter_without_the_renderer_is_told_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["peers", "--cycles", "false"]) == 1
    said = capsys.readouterr().err
    assert "import bpy" in said and "reference" not in said


def test_error_is_relative_where_it_is_bright_and_absolute_where_it_is_dark() -> None:
    reference = np.array([[[0.0, 10.0, 0.1]]])
    assert peers.rel_mse(reference * 1.1, reference) == pytest.approx((1 / 100.01 + 1e-4 / 0.02) / 3)


def test_runs_are_scaled_to_the_moment() -> None:
    picture = np.full((2, 2, 3), 1.1)
    course = peers.Course(np.array([1.25, 10.5]), np.array([4, 40]), np.stack([picture, picture]))
    summary = peers._summary([course], np.ones((2, 2, 3)), 2)
    assert summary["rel_mse"] == pytest.approx([1.25 * 0.01 / 1.01, 1.05 * 0.01 / 1.01])
    assert summary["mpaths_per_s"] == pytest.approx(40 / 10.5 * 4 / 1e6)


@pytest.mark.slow
@pytest.mark.parametrize("case", peer_scenes.cases(), ids=lambda case: case.name)
def test_no_run_shares_its_samples_with_the_reference(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, case: peer_scenes.PeerCase
) -> None:
    """It would be compared with itself, in part. Cycles is not asked for textures."""
    seeds: dict[str, list[int]] = {}

    def run(command: list[str], job: dict[str, Any], folder: Path) -> peers.Course:
        seeds.setdefault(command[-1], []).append(job["seed"])
        n = len(job["moments"])
        return peers.Course(np.ones(n), np.ones(n), np.full((n, 2, 2, 3), job["seed"], np.float32))

    monkeypatch.setattr(peers, "_run", run)
    options = peers.Options(mitsuba=Path("m"), cycles=Path("c"), rounds=2)
    row = peers._row(case, options, tmp_path, lambda _: None)
    sides = ["mitsuba"] if case.is_textured else ["mitsuba", "cycles"]
    assert list(row["ratios"]) == sides and len(seeds) == 1 + len(sides)
    assert {side: len(set(given)) for side, given in seeds.items()} == dict.fromkeys(seeds, 3)
