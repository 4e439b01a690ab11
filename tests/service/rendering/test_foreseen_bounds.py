"""What is compiled for nobody who is there: in which order, how much, and when not at all."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gpu import KernelKey, RenderSettings
from gpu.kernels import features
from gpu.precompile import kernel_keys
from service.bench.scenes import BenchAssets
from service.document import parse_scene, presets
from service.ipc.messages import Foresee
from service.pack import pack
from service.worker import foreseen
from service.worker.device.loaded_scene import begin_key, slider_keys
from service.worker.foreseen import BUDGET_S, LONGEST_S, ForeseenKernels, has_power_to_spare
from service.worker.helpers.compile_client import MOST, UsedKernels
from tests.supervisors import SIZE, arrays_of

PLAIN, RICH = Foresee(1, arrays_of("plain"), SIZE), Foresee(1, arrays_of("rich"), SIZE)


class Compiler:
    """In the place of the client of the compilers: each kernel takes `seconds`, at once."""

    foresees = True

    def __init__(self, seconds: float = 1.0, used: tuple[KernelKey, ...] = ()) -> None:
        self.asked: list[KernelKey] = []
        self.spare_s = 0.0
        self._seconds, self._used = seconds, used

    def used(self) -> Iterator[KernelKey]:
        return iter(self._used)

    def is_idle(self, priority: str) -> bool:
        return priority == "spare"

    def prepare(self, keys: list[KernelKey], priority: str) -> None:
        assert priority == "spare"
        self.asked += keys
        self.spare_s += self._seconds


@pytest.fixture(autouse=True)
def _plugged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreseen, "has_power_to_spare", lambda: True)


def all_of(compiler: Compiler, *messages: Foresee, bounded: bool = True) -> list[KernelKey]:
    kernels = ForeseenKernels(compiler, bounded)  # type: ignore[arg-type]
    for message in messages:
        kernels.add(message)
    while kernels.prepare():
        pass
    return compiler.asked


def test_what_was_used_here_comes_first_and_panels_last() -> None:
    used = kernel_keys.common_keys()[0]
    asked = all_of(Compiler(0.0, (used,)), PLAIN, RICH)
    assert asked == [used, begin_key(PLAIN), begin_key(RICH), *kernel_keys.bsdf_keys()]


def test_nothing_is_compiled_before_a_scene_has_come_but_what_was_used_here() -> None:
    assert all_of(Compiler()) == []


def test_the_sliders_of_all_scenes_are_foreseen_without_a_bound() -> None:
    asked = all_of(Compiler(0.0), PLAIN, bounded=False)
    assert asked[:1] + asked[1 : 1 + len(slider_keys(PLAIN))] == [begin_key(PLAIN), *slider_keys(PLAIN)]
    assert not set(slider_keys(PLAIN)) & set(all_of(Compiler(0.0), PLAIN))


@pytest.mark.parametrize("seconds", [1.0, 7.0, LONGEST_S])
def test_the_processor_s_time_is_bounded(seconds: float) -> None:
    compiler = Compiler(seconds)
    all_of(compiler, *[PLAIN] * 100)
    assert BUDGET_S - LONGEST_S <= compiler.spare_s <= BUDGET_S
    assert len(all_of(Compiler(seconds), *[PLAIN] * 100, bounded=False)) > 100


def test_nothing_is_compiled_without_power_to_spare(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreseen, "has_power_to_spare", lambda: False)
    assert all_of(Compiler(), PLAIN) == []


@pytest.mark.parametrize(
    ("supplies", "spare"),
    [
        ({}, True),
        ({"AC": ("Mains", "1"), "BAT0": ("Battery", "")}, True),
        ({"AC": ("Mains", "0"), "BAT0": ("Battery", "")}, False),
        ({"ucsi": ("USB", "1"), "AC": ("Mains", "0"), "BAT0": ("Battery", "")}, True),
        ({"BAT0": ("Battery", "")}, False),
        ({"AC": ("Mains", "0")}, True),
    ],
)
def test_power_to_spare(supplies: Any, spare: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, (kind, online) in supplies.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "type").write_text(f"{kind}\n")
        if online:
            (tmp_path / name / "online").write_text(f"{online}\n")
    monkeypatch.setattr(foreseen, "SUPPLIES", tmp_path)
    monkeypatch.setattr(foreseen, "QUOTA", tmp_path / "none")
    assert has_power_to_spare() == spare


@pytest.mark.parametrize(("quota", "spare"), [("max 100000", True), ("150000 100000", True), ("50000 100000", False)])
def test_a_part_of_a_processor_is_nothing_to_spare(
    quota: str, spare: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cpu.max").write_text(f"{quota}\n")
    monkeypatch.setattr(foreseen, "SUPPLIES", tmp_path / "none")
    monkeypatch.setattr(foreseen, "QUOTA", tmp_path / "cpu.max")
    assert has_power_to_spare() == spare


def test_a_record_keeps_the_latest_kernels_over_a_restart(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "used.json"
    keys = [kernel_keys.kernel_key(PLAIN.scene, RenderSettings(8, 8), raised) for raised in _flags(MOST + 2)]  # type: ignore[arg-type]
    record = UsedKernels(path)
    for key in [*keys, keys[0]]:
        record.note(key)
    assert list(UsedKernels(path).latest_first()) == list(reversed(keys))[:MOST]
    again = UsedKernels(path)
    again.note(keys[-3])
    assert next(iter(UsedKernels(path).latest_first())) == keys[-3]
    assert [each.name for each in path.parent.iterdir()] == [path.name], "nothing is left beside it"


def test_a_record_of_another_version_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "used.json"
    key = kernel_keys.kernel_key(PLAIN.scene, RenderSettings(8, 8), frozenset())  # type: ignore[arg-type]
    UsedKernels(path).note(key)
    (plain,) = json.loads(path.read_text())
    del plain["defines"]["HAS_LIGHTS"]
    path.write_text(json.dumps([plain, {**plain, "entry": "gone.comp"}]))
    assert list(UsedKernels(path).latest_first()) == []
    for junk in ("", "{", "[1]", '{"a": 2}', "[{}]"):
        path.write_text(junk)
        assert list(UsedKernels(path).latest_first()) == []
        UsedKernels(path).note(key)
        assert list(UsedKernels(path).latest_first()) == [key]


def test_each_favourite_needs_a_kernel_of_its_own() -> None:
    shown, edits, others = presets.likely()
    before, *arrays = [pack(parse_scene(document), BenchAssets()).arrays for document in (shown, *edits)]
    keys = [begin_key(Foresee(1, each, SIZE, before=before)) for each in arrays]
    assert len(set(keys)) == len(edits) == len(presets.FAVOURITES)
    had = {name for name, value in begin_key(Foresee(1, before, SIZE)).defines if name.startswith("HAS_") and value}
    for key in keys:
        assert all(dict(key.defines)[name] for name in had), "an edit lowers no flag"
    assert len(others) == len([each for each in presets.names("scenes") if "group" not in each]) - 1, "no tests"


def _flags(count: int) -> list[frozenset[str]]:
    """Different sets of flags."""
    return [frozenset([name]) for name in sorted(features.everything())][:count]
