"""`sunbox warm` compiles what a server would, and no kernel twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from gpu import RenderSettings
from gpu.precompile import kernel_keys
from service.cli import program as cli
from service.cli import warm
from service.config import load_config
from service.worker import foreseen as kernels_ahead
from service.worker.helpers.compile_client import records
from tests.supervisors import arrays_of

FEW = kernel_keys.common_keys()[:2]


@pytest.fixture(autouse=True)
def _cold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))


def test_kernels_are_compiled_once(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(kernels_ahead, "wanted", lambda foreseen: FEW)
    assert cli.main(["warm", "--jobs", "1"]) == 0
    said = capsys.readouterr()
    assert [line.partition(",")[0] for line in said.err.splitlines()] == [f"{n} of 2 kernels" for n in range(3)]
    assert said.out.startswith("2 kernels are compiled for ")
    assert len(list(records().iterdir())) == 2, "a server finds them there"
    assert cli.main(["warm", "--jobs", "1"]) == 0
    assert capsys.readouterr().err.startswith("2 of 2 kernels, ")


def test_without_a_cache_it_says_so(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("MESA_SHADER_CACHE_DISABLE", "true")
    monkeypatch.setattr(kernels_ahead, "wanted", lambda foreseen: FEW)
    assert cli.main(["warm", "--jobs", "1"]) == 1
    assert "its disk cache is off" in capsys.readouterr().err


def test_it_wants_what_a_server_foresees_and_the_scenes_that_are_named() -> None:
    named = arrays_of("rich")
    with_it, without = (kernels_ahead.wanted(list(warm.foreseen(scenes, load_config()))) for scenes in ([named], []))
    assert set(kernel_keys.common_keys()) | set(kernel_keys.bsdf_keys()) <= set(without) <= set(with_it)
    began = kernel_keys.kernel_key(named, RenderSettings(**warm.SETTINGS), kernel_keys.flags(named, True))
    assert began in with_it and began not in without and len(set(with_it)) == len(with_it)


@pytest.mark.parametrize("jobs", ["0", "-1", "two", "1000"])
def test_other_numbers_of_processes_are_refused(jobs: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["warm", "--jobs", jobs])
    assert ended.value.code == 2 and "whole number from 1" in capsys.readouterr().err


def test_a_scene_with_a_mistake_is_refused_before_anything_is_compiled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.json").write_text("{}")
    assert cli.main(["warm", str(tmp_path / "scene.json")]) == 2
    assert "error: " in capsys.readouterr().err and not records().exists()
