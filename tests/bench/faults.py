"""Faults of `faults.toml`, put one at a time into copies of this checkout: which of them the tests find."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.bench import fault_list
from tests.bench.fault_list import ROOMS, Fault
from tests.bench.fault_plugin import ORDER, Order, is_chosen

ROOT = Path(__file__).parents[2]
ENOUGH = 0.95  # of the faults must be found: 38 of 40
LIMIT_S = 900.0  # for the tests near one fault; where a fault hangs them, that long
WHOLE_LIMIT_S = 4 * 3600.0  # for all tests
LEAVING_S = 30.0  # for pytest to end after a failure: a thread that a failed test leaves keeps it for ever
NEAR = ["-m", "not bench and not slow"]  # `make test` leaves these out

Say = Callable[[str], None]


class UnknownFault(ValueError):
    """There is no fault of that name."""


@dataclass(frozen=True)
class Tested:
    """What became of a run's tests: (node id, what pytest says of it)."""

    passed: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    timed_out: bool = False


def named(names: Collection[str]) -> list[Fault]:
    """The faults of these names or rooms, in the list's order; all of them where none is named. Raises
    UnknownFault."""
    faults = fault_list.faults()
    known = {*ROOMS, *(fault.name for fault in faults)}
    for name in names:
        if name not in known:
            raise UnknownFault(f"{name!r} is neither a room nor a fault; there are: {', '.join(sorted(known))}")
    return [fault for fault in faults if not names or fault.name in names or fault.room in names]


def measure(faults: Sequence[Fault], whole: bool, say: Say) -> list[dict[str, Any]]:
    """A row for each fault: `found_by`, the first test that failed, or None; `why` and `seconds`.

    With `whole`, all tests of `make test` look for what those near do not find. A test that fails without any fault
    finds nothing."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="sunbox-faults-") as folder:
        bench = _Bench(Path(folder), say)
        bench.try_near(faults)
        for number, fault in enumerate(faults, 1):
            row = bench.row(fault, whole)
            say(f"{number}/{len(faults)} {line(row)}")
            rows.append(row)
    return rows


def line(row: dict[str, Any]) -> str:
    found = row["found_by"] or f"NOT FOUND ({row['why']})"
    return f"{row['room']:<8} {row['name']:<58} {row['seconds']:>6.0f} s  {found}"


def table(rows: Sequence[dict[str, Any]]) -> str:
    found = sum(row["found_by"] is not None for row in rows)
    return "\n".join([*map(line, rows), f"{found} of {len(rows)} faults are found"])


def suffices(rows: Sequence[dict[str, Any]]) -> bool:
    return sum(row["found_by"] is not None for row in rows) >= ENOUGH * len(rows)


class _Bench:
    """A copy of the checkout without a fault, and what its tests say of it."""

    def __init__(self, folder: Path, say: Say) -> None:
        self._folder, self._say = folder, say
        self._sound = folder / "sound"
        _copy_checkout(self._sound)
        self._near = Tested()
        self._all: dict[str, Tested] = {}  # by the part of `make test`

    def try_near(self, faults: Sequence[Fault]) -> None:
        """Run the tests near all faults without any of them."""
        chosen = sorted({test for fault in faults for test in fault.near})
        began = time.monotonic()
        self._near = self._run(self._sound, NEAR, Order("", chosen, []), LIMIT_S * len(faults))
        passed, failed = len(self._near.passed), len(self._near.failed)
        self._say(f"without a fault {passed} tests pass and {failed} fail, in {time.monotonic() - began:.0f} s")
        for test, why in self._near.failed:
            self._say(f"  fails without a fault: {test}: {why.splitlines()[0] if why else ''}")

    def row(self, fault: Fault, whole: bool) -> dict[str, Any]:
        began = time.monotonic()
        found, why = self._look(fault, whole)
        return {
            "room": fault.room,
            "name": fault.name,
            "harm": fault.harm,
            "found_by": found,
            "why": why,
            "seconds": round(time.monotonic() - began, 1),
        }

    def _look(self, fault: Fault, whole: bool) -> tuple[str | None, str]:
        with self._with(fault) as copy:
            why = "no test near it passes without it"
            if any(is_chosen(test, fault.near) for test in self._near.passed):
                broken = [test for test, _ in self._near.failed]
                found, why = self._first(copy, NEAR, Order("", list(fault.near), broken), LIMIT_S)
                if found or not whole:
                    return found, why
            for part, arguments in parts().items() if whole else ():
                if part not in self._all:
                    self._all[part] = self._run(self._sound, arguments, Order("", None, []), WHOLE_LIMIT_S)
                broken = [test for test, _ in self._all[part].failed]
                found, why = self._first(copy, arguments, Order("", None, broken), WHOLE_LIMIT_S)
                if found:
                    return found, why
        return None, why

    def _first(self, copy: Path, arguments: list[str], order: Order, limit_s: float) -> tuple[str | None, str]:
        """The first test that fails, and once more alone, as `make test` has it; or None. And why."""
        left_out = list(order.left_out)
        while True:
            tested = self._run(copy, [*arguments, "-x"], Order("", order.chosen, left_out), limit_s)
            if not tested.failed:
                many = f"{len(tested.passed)} tests pass"
                return None, f"nothing ended in {limit_s:.0f} s" if tested.timed_out else many
            test, _ = tested.failed[0]
            again = self._run(copy, [*arguments, "-x"], Order("", [test], []), limit_s)
            if again.failed:
                return again.failed[0]
            left_out.append(test)

    @contextmanager
    def _with(self, fault: Fault) -> Iterator[Path]:
        """A fresh copy with the fault in it."""
        copy = self._folder / "faulty"
        shutil.copytree(self._sound, copy)  # keeps times, so that modules need not be compiled again
        try:
            path = copy / fault.file
            path.write_text(fault.patched(path.read_text()))
            yield copy
        finally:
            shutil.rmtree(copy)

    def _run(self, copy: Path, arguments: list[str], order: Order, limit_s: float) -> Tested:
        """Run pytest in a copy; the order's report is filled in. Ends all that it started."""
        report, paper, log = (self._folder / name for name in ("report", "order", "log"))
        report.write_text("")
        Order(str(report), order.chosen, order.left_out).write(paper)
        files = sorted({test.partition("::")[0] for test in order.chosen}) if order.chosen is not None else []
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.bench.fault_plugin"]
        # The copy's code in child processes, too: the virtual environment leads to this checkout.
        environment = os.environ | {"PYTHONPATH": f"{copy}{os.pathsep}{copy / 'client' / 'src'}", ORDER: str(paper)}
        with log.open("wb") as out:
            process = subprocess.Popen(
                [*command, *arguments, *files],
                cwd=copy,
                env=environment,
                stdout=out,
                stderr=out,
                start_new_session=True,
            )
            try:
                timed_out = not _ends(process, report, limit_s, at_failure="-x" in arguments)
            finally:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        tested = Tested(timed_out=timed_out)
        for test, outcome, why in map(json.loads, report.read_text().splitlines()):
            if outcome == "passed":
                tested.passed.append(test)
            elif outcome == "failed":
                tested.failed.append((test, why))
        if not timed_out and process.returncode not in (0, 1, 2, 5) and not tested.failed:
            last = log.read_text(errors="replace").splitlines()[-3:]
            self._say(f"pytest ended with {process.returncode}: {' / '.join(last)}")
        return tested


def _ends(process: subprocess.Popen[bytes], report: Path, limit_s: float, at_failure: bool) -> bool:
    """Whether a process ends within so many seconds. With `at_failure`, one whose report has a failure has ended
    LEAVING_S later."""
    until, has_failed = time.monotonic() + limit_s, False
    while (left_s := until - time.monotonic()) > 0:
        with suppress(subprocess.TimeoutExpired):
            process.wait(min(1.0, left_s))
            return True
        if at_failure and not has_failed and '", "failed", ' in report.read_text():
            until, has_failed = min(until, time.monotonic() + LEAVING_S), True
    return has_failed


def parts() -> dict[str, list[str]]:
    """What `make test` runs, as arguments of pytest by their markers."""
    text = (ROOT / ".ci" / "test").read_text()
    two = shlex.split(re.findall(r"^two=\((.*)\)$", text, re.MULTILINE)[0])
    out = {}
    for name in ("main", "browser", "calm"):
        markers, *more = shlex.split(re.findall(rf"^ *part {name} tests (.*)$", text, re.MULTILINE)[0])
        out[name] = [*(two if "${two[@]}" in more else []), "-m", markers]
    return out


def _copy_checkout(target: Path) -> None:
    """Copy what git tracks, and what it does not ignore, as it is now."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    for name in filter(None, subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout.split(b"\0")):
        source = ROOT / os.fsdecode(name)
        if source.is_file():  # others are deleted, and not yet committed so
            path = target / os.fsdecode(name)
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, path)
