"""The price list: its scenes are valid, its arithmetic is right, and one command writes all of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.program import main
from service.document import parse_scene, quality
from service.pack import pack
from tests.bench import pareto, tradeoff, tradeoff_report
from tests.bench.tradeoff_scenes import TradeoffAssets, bumps, cases, planks


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.name)
def test_scene_packs_without_a_warning(case: Any) -> None:
    assert pack(parse_scene(case.scene), TradeoffAssets()).warnings == []


def test_textures_are_pictures() -> None:
    assert planks().dtype == bumps().dtype == np.uint8 and planks().std() > 20
    normals = bumps().astype(float) / 127.5 - 1
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1, abs=0.02)


def curve(*points: tuple[float, float]) -> list[dict[str, float]]:
    return [{"samples": 4**k, "seconds": t, "relmse": e} for k, (t, e) in enumerate(points, 1)]


def test_error_at_equal_time_is_read_off_the_curve() -> None:
    plain = curve((1, 0.1), (4, 0.025), (16, 0.00625))
    assert pareto.interpolated(plain, 2) == pytest.approx(0.05)
    assert pareto.interpolated(plain, 64) == pytest.approx(0.1 / 64)  # goes on as it ended
    rows = [{"knob": "samples", "value": "balanced", "curve": plain}]
    rows += [{"knob": "a", "value": "twice as fast", "curve": curve((0.5, 0.1), (2, 0.025), (8, 0.00625))}]
    assert [row["ratio"] for row in pareto.at_equal_time(rows, 16)] == pytest.approx([1, 0.5])


def test_a_bilinear_enlargement_keeps_a_ramp() -> None:
    ramp = np.broadcast_to(np.arange(8.0)[None, :, None], (8, 8, 3))
    large = tradeoff._enlarged(ramp, 16)
    assert large[0, 1:-1, 0] == pytest.approx((np.arange(1, 15) + 0.5) / 2 - 0.5)


@pytest.mark.bench
def test_one_command_measures_it_all(tmp_path: Path, gpu: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "tradeoff", "--quick", "-o", str(tmp_path / "t.json")]) == 0
    document = json.loads((tmp_path / "t.json").read_text())
    knobs = {row["knob"] for row in document["knobs"]}
    assert knobs == {
        "samples", "max_bounces", "estimator", "sampler", "clamp", "resolution_scale", "denoise", "adaptive",
        "roulette_depth", "filter", "noise meter",
    }  # fmt: skip
    assert set(document["presets"]) == set(quality.PRESETS) and document["machine"]["commit"]
    numbers = [v for row in document["scenes"][0]["variations"] for p in row["curve"] for v in p.values()]
    assert np.isfinite([n for n in numbers if n is not None]).all()
    by_name = {(row["knob"], row["value"]): row for row in document["knobs"]}
    assert by_name["denoise", "true"]["relmse"] < 0.7 < by_name["sampler", "independent"]["relmse"]
    assert "| balanced |" in capsys.readouterr().out
    tradeoff_report.plot(document, tmp_path / "t.png")
    assert (tmp_path / "t.png").read_bytes().startswith(b"\x89PNG")


def test_figures_that_mean_nothing_are_not_published() -> None:
    assert main(["bench", "tradeoff", "--quick", "--publish"]) == 2


def test_the_published_list_is_whole() -> None:
    prices = quality.price_list()
    assert set(prices["presets"]) == set(quality.PRESETS) and prices["machine"]["processor"]
    costs = [cost["seconds"] for cost in prices["presets"].values()]
    errors = [cost["relmse"] for cost in prices["presets"].values()]
    assert costs == sorted(costs) and errors == sorted(errors, reverse=True)
    for name, preset in quality.priced().items():
        assert quality.PRESETS[name].items() <= preset.items()
        assert "noise" in preset["gives_up"] and str(preset["max_bounces"]) in preset["gives_up"]
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    assert all(quality.text(name, prices) in readme for name in quality.PRESETS), "run `make tradeoff`"


def test_forecast_measures_the_scene_at_hand() -> None:
    assert quality.forecast(15, 0.1, 1.0) is None and quality.forecast(20, None, 1.0) is None
    found = quality.forecast(64, 0.1, 2.0)
    assert found is not None and set(found) == set(quality.PRESETS)
    high = {"samples": 1024, "seconds": pytest.approx(32), "noise": pytest.approx(0.025)}
    assert found["high"] == high
