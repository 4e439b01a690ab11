"""The list of faults is sound: each can be put in, and is looked for where there are tests."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.bench import fault_list, faults
from tests.bench.fault_list import ROOMS, Fault
from tests.bench.fault_plugin import is_chosen
from tests.bench.faults import UnknownFault, named, parts, suffices, table

ROOT = Path(__file__).parents[2]
FAULTS = fault_list.faults()
PRODUCT = ("shaders/", "gpu/", "service/", "client/src/", "web/")


def test_there_are_forty_in_all_rooms() -> None:
    names = [fault.name for fault in FAULTS]
    assert len(names) == len(set(names)) >= 40
    assert {fault.room for fault in FAULTS} == set(ROOMS)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_it_can_be_put_in(fault: Fault) -> None:
    assert fault.file.startswith(PRODUCT)
    before = (ROOT / fault.file).read_text()
    after = fault.patched(before)  # raises where the line is another by now: write the fault anew
    assert after != before and len(fault.old.splitlines()) <= 2
    if fault.file.endswith(".py"):
        ast.parse(after)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_tests_near_it_exist(fault: Fault) -> None:
    assert fault.near and fault.harm.endswith(".")
    for test in fault.near:
        file, _, function = test.partition("::")
        text = (ROOT / file).read_text()
        assert not function or f"def {function.partition('[')[0]}(" in text, f"{test} has another name by now"


def test_tests_are_chosen_by_file_function_and_parameters() -> None:
    test = "tests/a/test_b.py::test_c[1-2]"
    for part in ("tests/a/test_b.py", "tests/a/test_b.py::test_c", test):
        assert is_chosen(test, [part])
    for other in ("tests/a/test_b.py::test_", "tests/a/test_b.py::test_c[1]", "tests/a/test"):
        assert not is_chosen(test, [other])


def test_names_choose_and_most_must_be_found() -> None:
    assert named([]) == FAULTS
    assert named([FAULTS[3].name]) == [FAULTS[3]]
    assert {fault.room for fault in named(["web", "http"])} == {"web", "http"}
    with pytest.raises(UnknownFault, match="no cosine"):
        named(["no such fault"])
    rows = [{"room": "web", "name": f"{i}", "seconds": 1, "found_by": "x", "why": ""} for i in range(40)]
    assert suffices(rows)
    rows[7]["found_by"] = rows[9]["found_by"] = None
    assert suffices(rows) and "38 of 40" in table(rows)
    rows[0]["found_by"] = None
    assert not suffices(rows)


def test_who_stays_after_a_failure_has_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faults, "LEAVING_S", 0.0)
    report = tmp_path / "report"
    report.write_text('["tests/test_a.py::test_b", "failed", "why"]\n')
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    try:
        assert faults._ends(process, report, 600.0, at_failure=True)
        assert not faults._ends(process, report, 0.1, at_failure=False)
    finally:
        process.kill()
        process.wait()


def test_the_parts_are_those_of_make_test() -> None:
    assert [arguments[-1] for arguments in parts().values()] == [
        "not browser and not calm and not bench and not slow",
        "browser and not slow",
        "calm",
    ]
