"""`sunbox bench gpu`: its report is whole and its numbers are finite, whatever fails on the way."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from gpu import Renderer
from gpu.analysis.slices import slices_of
from service.bench.device import frames, isolated, pictures, run, scenes, stage, table
from service.bench.device.report import Report
from service.cli.program import main

TINY = stage.Options(seconds=1.0, sizes=((32, 24),), scenes=("cornell-boxes",))


def _in_little(measure: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """`run.measure` with TINY's sizes and scenes."""
    return lambda options, told: measure(replace(options, sizes=TINY.sizes, scenes=TINY.scenes), told)


@pytest.mark.bench
def test_every_part_gives_figures(
    gpu: Renderer,
    filled: None,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(run, "measure", _in_little(run.measure))
    output = tmp_path / "new" / "device.json"
    assert main(["bench", "gpu", "--seconds", "1", "-o", str(output)]) == 0
    report = Report.model_validate_json(output.read_text())
    assert report.device is not None and report.device.renderer == gpu.info["renderer"]
    assert report.device.limits["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"] >= 1 << 27
    (scene,) = report.scenes
    assert scene.compile_cold_ms > scene.compile_warm_ms > 0 and [each.width for each in scene.sizes] == [32]
    assert [each.format for each in report.readouts[0].encoded] == ["jpeg", "webp", "png"]
    assert report.blocks[0].band_bytes == 32 * 24 * 48 and report.blocks[0].merge_ms > 0
    assert [row.slice_ms / 1e3 for row in report.slices] == pytest.approx(pictures.SLICES_S)
    assert [row.side for row in report.sides] == [64]
    assert [len(row.mpaths_per_s) for row in report.pairs] == [1, 2]
    assert len({row.tree for row in report.trees}) == 4 == len(report.trees)
    (moved,) = report.frames
    assert 0 < moved.material.p50_ms <= moved.material.p95_ms and moved.start_warm_ms > moved.camera.p50_ms > 0
    spoken = {"subgroup_size", "memory", "free_memory"}  # by some drivers
    assert {row.what for row in report.missing} - spoken == {*run.NOT_BUILT}
    said = capsys.readouterr().out
    for line in ("cornell-boxes", "eight orders, no treelets", "8-wide trees: Sunbox has no such tree", "webp"):
        assert line in said
    software = bool(gpu.info["software"])
    assert report.device.software == software == ("these figures say nothing of a GPU" in said)


def _starts_no_server(size: tuple[int, int], options: stage.Options) -> stage.Row:
    raise RuntimeError("it did not start")


def test_a_report_without_a_device_says_why(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The number is beyond EGL's list, so that no part has figures."""
    monkeypatch.setattr(run, "measure", _in_little(run.measure))
    monkeypatch.setattr(frames, "measure", _starts_no_server)
    for name in ("_scene", "_named", "_pair"):
        monkeypatch.setattr(run, name, lambda *given: [])
    output = tmp_path / "device.json"
    assert main(["bench", "gpu", "--device", "77", "-o", str(output)]) == 1
    report = Report.model_validate_json(output.read_text())
    why = {row.what: row.why for row in report.missing}
    assert report.device is None and "EGL device 77" in why["the device"]
    assert why["first frames of 32 x 24 pixels"] == "it did not start"
    assert {"reading and encoding", "blocks of samples"} <= why.keys()


def test_time_that_is_over_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    late = run._Run(TINY, tmp_path, lambda what: None)
    late.began -= 1000
    assert late.part("a part", time.sleep, 60) is None
    assert late.missing[-1]["what"] == "a part" and "left out" in late.missing[-1]["why"]


def _raises() -> None:
    raise KeyError("a scene")


@pytest.mark.bench
def test_a_process_is_lost_alone(tmp_path: Path) -> None:
    assert isolated.Isolated(tmp_path, os.getenv, "MESA_SHADER_CACHE_DIR").result(30) == str(tmp_path)
    for function, arguments, why in (
        (os._exit, (3,), "exit code 3"),
        (_raises, (), "KeyError: 'a scene'"),
    ):
        with pytest.raises(isolated.Lost, match=why):
            isolated.Isolated(tmp_path, function, *arguments).result(30)
    sleeper = isolated.Isolated(tmp_path, time.sleep, 600)
    with pytest.raises(isolated.Lost, match="not done after"):
        sleeper.result(0.1)
    assert not sleeper._process.is_alive()


def test_numbers_in_a_report_are_finite() -> None:
    fields: dict[str, Any] = {name: [] for name, field in Report.model_fields.items() if field.is_required()}
    fields |= {"seconds": 1.0, "took_s": 2.0, "machine": {}, "device": None}
    assert Report(**fields).version == 2
    for wrong in ({"took_s": float("nan")}, {"took_s": float("inf")}, {"more": 1}):
        with pytest.raises(ValidationError):
            Report(**fields | wrong)


def test_a_dispatch_is_as_long_as_it_is_asked_to_be(gpu: Renderer) -> None:
    scene = gpu.load(stage.arrays("cornell-boxes"))
    counts = []
    for seconds in (1e-9, 10.0):
        with slices_of(seconds):
            picture = gpu.picture(scene, stage.settings((64, 64)))
            picture.trace(0.0, 1)
            counts.append(1)
            while picture.under_way[0]:
                picture.trace(0.0, 1)
                counts[-1] += 1
            picture.release()
    assert counts == [4 * 64 // 8, 1]  # tiles of 8 x 16 pixels, and one
    scene.release()


@pytest.mark.bench
def test_trees_differ_in_their_treelets_alone() -> None:
    ways = scenes.tree_ways("generated-mesh")
    for way, arrays in ways.items():
        assert (len(arrays.nodes) > 8 * arrays.node_count) == (
            scenes.WITH_TREELETS in way and scenes.WITHOUT_TREELETS not in way
        )
    assert len({arrays.nodes.tobytes() for arrays in ways.values()}) == 4


@pytest.mark.bench
def test_one_kernel_for_everything_is_compared(monkeypatch: pytest.MonkeyPatch, gpu: Renderer) -> None:
    class Cost:
        full_compile_ms, sample_s, full_sample_s = 900.0, 2.0, 3.0

    monkeypatch.setattr(scenes, "kernel_cost", lambda renderer, arrays: Cost)
    row = scenes.full_kernel("cornell-boxes", TINY)
    assert row == {"scene": "cornell-boxes", "full_compile_ms": 900.0, "time_ratio": 1.5}
    assert "1.50" in table._kernels({"kernels": [row]})[-1]


@pytest.mark.bench
def test_caustics_of_both_ways_are_compared(gpu: Renderer) -> None:
    row = scenes.caustics("prism", replace(TINY, seconds=1e-3))
    assert row["scene"] == "prism" and all(row[way]["ms_per_sample"] > 0 for way in scenes.CAUSTIC_WAYS)
    assert table._caustics({"caustics": [row]})[-1].startswith("prism")


def test_seconds_are_above_zero(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "gpu", "--seconds", "0"]) == main(["bench", "gpu", "--seconds", "nan"]) == 2
    assert "--seconds" in capsys.readouterr().err
    assert json.dumps(Report.model_json_schema())
