"""The benchmark measures what it says: its scenes are valid, its mesh is whole, its figures are figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from service.bench import latency, machine, scenes, speed, timing
from service.cli import bench
from service.cli.program import main
from service.document import parse_scene
from service.pack import pack


@pytest.mark.parametrize("case", scenes.cases(), ids=lambda case: f"{case.name}-{case.max_bounces}")
def test_scene_packs_without_a_warning(case: scenes.Case) -> None:
    packed = pack(parse_scene(case.scene), scenes.BenchAssets())
    assert packed.warnings == []
    assert len(packed.arrays.triangles) == (73_728 if "mesh" in case.name else 0)


def test_divided_mesh_is_the_same_surface() -> None:
    mesh = scenes.BenchAssets().mesh(scenes.MESH)
    corners = mesh.vertices[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert mesh.normals is not None and (np.einsum("ij,ij->i", across, mesh.normals[mesh.faces[:, 2]]) > 0).all()
    thirds = np.linalg.norm(across, axis=1).reshape(3, -1)
    assert thirds[0] == pytest.approx(thirds[1], rel=1e-3) and thirds[0] == pytest.approx(thirds[2], rel=1e-3)


def test_given_mesh_takes_the_place_of_the_generated_one(tmp_path: Path) -> None:
    path = tmp_path / "one.obj"
    path.write_text("v 0 5 0\nv 10 5 0\nv 0 15 0\nf 1 2 3\n")
    mesh = scenes.BenchAssets(mesh_file=path).mesh(scenes.MESH)
    assert mesh.vertices.tolist() == [[-1, 0, 0], [1, 0, 0], [-1, 2, 0]]


@pytest.mark.bench
def test_case_is_measured(gpu: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(speed, "SIZE", 32)
    monkeypatch.setattr(timing, "RUN_S", 0.05)
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", "")  # put back afterwards: measuring sets it
    row = speed._measure_case(scenes.cases()[0], speed.Options(runs=2), 2, str(tmp_path))
    assert row["mpaths_per_s"] == pytest.approx(32 * 32 / row["ms_per_sample"] / 1e3)
    assert row["mpaths_per_s"] > 0 and row["compile_ms"] > 0 and row["spread"] >= 0


@pytest.mark.bench
def test_growth_is_that_of_one_form(gpu: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    coarse, fine = (trimesh.Trimesh(m.vertices, m.faces).volume for m in map(speed.ball, (4, 5)))
    assert coarse == pytest.approx(fine, rel=0.01)
    monkeypatch.setattr(timing, "SIZE", 16)
    monkeypatch.setattr(timing, "RUN_S", 0.05)
    rows = speed.growth(lambda line: None, range(1, 3))
    assert [row["triangles"] for row in rows] == [80, 320]
    assert all(row["ms_per_sample"] > 0 and row["build_mtri_per_s"] > 0 for row in rows)
    assert len(speed._growth_table(rows).splitlines()) == 3


@pytest.mark.bench
def test_latencies_are_measured_at_a_real_server(gpu: Any, filled: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(latency, "MOVES", 5)
    figures = latency.measure()
    assert figures["server_start_warm_ms"] > figures["slider_p50_ms"] > 0
    assert figures["slider_p50_ms"] <= figures["slider_p95_ms"] <= figures["slider_worst_ms"]


@pytest.mark.bench
def test_latencies_in_rooms_are_measured(gpu: Any, filled: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(latency, "MOVES", 2)
    monkeypatch.setattr(latency.presets, "names", lambda kind: [{"name": "cornell-empty"}])
    room = latency.rooms(lambda line: None)["cornell-empty"]
    for hand in ("slider", "camera"):
        assert room[f"{hand}_p95_ms"] >= room[f"{hand}_p50_ms"] > 0


def test_command_prints_a_table_and_keeps_the_figures(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    row = {"name": "a sphere", "max_bounces": 8, "mpaths_per_s": 12.3456, "ms_per_sample": 21.2, "spread": 0.02}
    grown = {"build_s": 0.1, "build_mtri_per_s": 1.5}
    document = {
        "machine": machine.describe({"renderer": "a driver", "version": "4.5"}),
        "size": [512, 512],
        "scenes": [{**row, "compile_cold_ms": 90.0, "compile_warm_ms": 4.0}],
        "growth": [{**grown, "triangles": n, "ms_per_sample": n / 8} for n in (80, 320)],
        "latency": {"slider_p95_ms": 64.2},
        "rooms": {"a box": {"slider_p50_ms": 31, "slider_p95_ms": 41, "camera_p50_ms": 51, "camera_p95_ms": 61}},
    }
    monkeypatch.setattr(speed, "measure", lambda options, told: document)
    output = tmp_path / "new" / "bench.json"
    assert main(["bench", "speed", "-o", str(output)]) == 0
    said = capsys.readouterr().out
    assert ["a", "box", "31", "41", "51", "61"] in [line.split() for line in said.splitlines()]
    assert "12.35" in said and "+30.0" in said and "slider p95" in said and "64.2 ms" in said and "a driver" in said
    assert json.loads(output.read_text()) == document
    assert main(["bench", "--runs", "0"]) == main(["bench", "--mesh", "missing.obj"]) == 2


@pytest.mark.parametrize("what", ["tradeoff", "seeds", "scale"])
def test_what_writes_pages_of_the_source_says_that_it_needs_a_checkout(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench, "ROOT", tmp_path)
    assert main(["bench", what, "--quick"]) == 2
    assert f"bench {what}: needs a checkout" in capsys.readouterr().err
