"""The founding experiment: error over samples of the hemisphere."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.bench.__main__ import main


@pytest.mark.bench
def test_uniform_directions_fall_with_the_root_of_samples(tmp_path: Path) -> None:
    """The founding experiment, short: theory's slope, and Sunbox below it at equal samples and at equal time."""
    out, drawn = tmp_path / "hemisphere.json", tmp_path / "hemisphere.svg"
    given = ["--figure", str(drawn)] if find_spec("matplotlib") else []
    assert main(["hemisphere", "--most", "64", "-o", str(out), *given]) == 0
    curves = {(c["material"], c["way"]): c for c in json.loads(out.read_text())["curves"]}
    assert len(curves) == 4
    for material in ("diffuse", "metal r=.1"):
        uniform, ours = curves[material, "uniform"], curves[material, "sunbox"]
        assert uniform["samples"] == [1, 4, 16, 64] and all(s > 0 for s in ours["seconds"])
        assert -0.7 < uniform["slope"] < (-0.4 if material == "diffuse" else -0.2)
        assert ours["slope"] < -0.45
        assert all(a > b for a, b in zip(uniform["error"], ours["error"], strict=True))
    assert not given or "equal time" in drawn.read_text() or drawn.stat().st_size > 10_000
