"""The model of a divided render agrees with its closed form in the limits; the bench measures a real server."""

from __future__ import annotations

import json
import os
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from service.cli.program import main
from service.worker.division.home import EACH
from tests.bench import scale, scale_report
from tests.bench.scale_model import BLOCK, Costs, Network, Work, limits, simulate, speedup, steady_speedup
from tests.marks import seldom

FREE = Network(1e15)
COSTS = Costs(sample_s=4e-7, write_s=0.0, merge_s=0.0, meter_pixels=0)
WORK = Work(960, 540, 32 * 64)


def gained(costs: Costs, network: Network, renderers: int, work: Work = WORK) -> float:
    return simulate(costs, network, work, 1).seconds / simulate(costs, network, work, renderers).seconds


def test_one_renderer_takes_the_time_of_its_samples_and_merges() -> None:
    costs = Costs(4e-7, write_s=1e-3, merge_s=5e-7, meter_pixels=1000)
    blocks = WORK.samples // BLOCK
    meter_s = (WORK.samples - 8) * 4e-7 * 1000
    expected = WORK.pixels * (WORK.samples * 4e-7 + blocks * 5e-7) + meter_s
    assert simulate(costs, FREE, WORK, 1).seconds == pytest.approx(expected, rel=1e-9)
    assert speedup(costs, FREE, WORK, 1) == 1.0


@pytest.mark.parametrize("renderers", seldom([2, 7, 16, 64], [16, 64]))
def test_where_nothing_else_costs_all_trace_all_the_time(renderers: int) -> None:
    """But at the very end, when the last leases are out."""
    assert steady_speedup(COSTS, FREE, WORK, renderers) == pytest.approx(renderers)
    assert 0.93 * renderers < gained(COSTS, FREE, renderers) <= renderers


LONG = pytest.mark.bench  # the model has an event for each part of each result


@pytest.mark.parametrize(
    ("part", "costs", "network"),
    [
        pytest.param("link", COSTS, Network(bytes_per_s=48 * 20 / (BLOCK * 4e-7)), marks=LONG),
        pytest.param("front door", COSTS, Network(1e15, door_byte_s=BLOCK * 4e-7 / 48 / 20), marks=LONG),
        ("home", Costs(4e-7, write_s=BLOCK * 4e-7 / 20, merge_s=0.0, meter_pixels=0), FREE),
        pytest.param("home", Costs(4e-7, write_s=0.0, merge_s=BLOCK * 4e-7 / 20, meter_pixels=0), FREE, marks=LONG),
        pytest.param("home", Costs(4e-7, write_s=0.0, merge_s=0.0, meter_pixels=WORK.pixels // 20), FREE, marks=LONG),
    ],
    ids=["link", "front door", "writing", "merging", "meter"],
)
def test_the_part_that_costs_most_is_the_limit(part: str, costs: Costs, network: Network) -> None:
    """A part that does a twentieth of a renderer's work for each result lets no more than 20 or 21 help."""
    most = limits(costs, network, WORK)
    assert min(most, key=lambda name: most[name]) == part and 19.9 < most[part] < 21.1
    assert gained(costs, network, 64) == pytest.approx(speedup(costs, network, WORK, 64), rel=0.08)
    few = gained(costs, network, 8)
    assert few == pytest.approx(speedup(costs, network, WORK, 8), rel=0.1)


def test_a_second_lease_hides_latency_up_to_its_own_length() -> None:
    """An assistant has EACH leases: it waits only where a lease takes less time than the way back and forth."""
    work = Work(960, 540, 64 * 16)
    near, far = Network(1e15, latency_s=1e-3), Network(1e15, latency_s=10.0)
    assert gained(COSTS, near, 4, work) > 0.95 * gained(COSTS, FREE, 4, work)
    # 40 s between a lease and its result's arrival: EACH results of at most half a second in that time.
    share = EACH * 0.5 / 40
    assert gained(COSTS, far, 4, work) < 1 + 3 * share + 0.2


MANY = [pytest.param(64, samples, marks=pytest.mark.slow) for samples in (1024, 256)]


@pytest.mark.parametrize(("renderers", "samples"), [(8, 1024), *MANY])
def test_the_home_s_first_block_holds_up_many_renderers(renderers: int, samples: int) -> None:
    """The others trace ahead meanwhile, but of a large picture the memory for results holds two or three blocks."""
    work = Work(1920, 1080, samples)
    expected = speedup(COSTS, FREE, work, renderers)
    assert gained(COSTS, FREE, renderers, work) == pytest.approx(expected, rel=0.06)
    assert renderers == 8 or expected < 0.8 * renderers


@pytest.mark.bench
@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="two cores are compared with one")
def test_a_real_server_is_measured_with_one_core_and_two(tmp_path: Path) -> None:
    output = tmp_path / "scale.json"
    assert main(["bench", "scale", "--quick", "--runs", "1", "--simulate", "3", "-o", str(output)]) == 0
    document = json.loads(output.read_text())
    rows: list[dict[str, Any]] = document["measured"]["rows"]
    assert [row["name"] for row in rows] == [name for name, _, _ in scale.PLACES]
    assert all(row["renders_per_s"] > 0 and row["large_s"] > 0 for row in rows)
    simulated = document["simulated"]
    assert simulated["renderers"] == [1, 2, 3] and simulated["forwarding_s"] > 0
    assert all(curve["speedup"][0] == pytest.approx(1) for curve in simulated["curves"])
    assert all(cost > 0 for cost in simulated["costs"][scale.SCENES[0]].values())
    section = scale_report.section(document["measured"], simulated)
    assert "| 2 renderers of 1 core |" in section and "None" not in section
    if find_spec("matplotlib"):
        scale_report.figure(simulated, tmp_path / "curves.png")
        assert (tmp_path / "curves.png").stat().st_size > 1000


def test_what_cannot_be_is_refused(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["bench", "scale", "--simulate", "0"]) == 2
    assert "--simulate" in capsys.readouterr().err
    assert main(["bench", "scale", "--publish"]) == 2
    assert "--simulate" in capsys.readouterr().err
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0})
    assert main(["bench", "scale"]) == 1
    assert "core" in capsys.readouterr().err


@pytest.mark.skipif(find_spec("matplotlib") is None, reason="the figure needs matplotlib")
def test_publishing_again_replaces_the_section(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scale_report, "DOCS", tmp_path)
    page = tmp_path / "scaling.md"
    page.write_text("# Many renderers\n\nOthers' text.\n")
    settings = {"width": 8, "height": 8, "max_samples": 8}
    machine = {"processor": "P", "cores": 2, "renderer": "R", "commit": "c"}
    row = {"name": "1 renderer of 1 core", "renders_per_s": 1.0, "large_s": 2.0, "runs": [{}]}
    measured = {"machine": machine, "load": 0.0, "queue": settings, "large": settings, "rows": [row]}
    network, counts = Network(1e9), [1, 2]
    curve = {"scene": "s", "faster": 1, "link": "1 Gbit/s", "speedup": [1, 2], "closed_form": [1, 2]}
    simulated = {
        "work": {"width": 64, "height": 64, "samples": 100}, "latency_s": 0.001, "forwarding_s": 0.001,
        "costs": {"s": vars(COSTS)}, "renderers": counts,
        "curves": [curve | {"limits": limits(COSTS, network, WORK)}],
    }  # fmt: skip
    scale_report.publish(measured, simulated)
    once = page.read_text()
    page.write_text(once + "\nMore of others.\n")
    scale_report.publish(measured, simulated)
    assert page.read_text() == once + "\nMore of others.\n"
    assert once.startswith("# Many renderers\n\nOthers' text.\n\n")
