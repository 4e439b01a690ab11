"""A plugin of pytest for `faults`: it runs the tests that it is told to, and writes down what became of each."""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from dataclasses import asdict, dataclass
from pathlib import Path

import pytest

ORDER = "FAULT_ORDER"  # the environment variable with the path of an `Order` as JSON


@dataclass(frozen=True)
class Order:
    """What to run, and where to write it down."""

    report: str  # a path; a line of JSON for each test that has ended: [node id, outcome, why]
    chosen: list[str] | None  # files, functions, or functions with parameters; None: all
    left_out: list[str]  # node ids

    def write(self, path: Path) -> None:
        path.write_text(json.dumps(asdict(self)))


def is_chosen(node_id: str, chosen: Collection[str]) -> bool:
    """Whether a test is one of these, or belongs to one of them."""
    return any(node_id == each or node_id.startswith((f"{each}[", f"{each}::")) for each in chosen)


class Plugin:
    def __init__(self, order: Order, is_worker: bool) -> None:
        self._order, self._is_worker = order, is_worker

    @pytest.hookimpl(trylast=True)  # after markers chose
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        chosen, left_out = self._order.chosen, set(self._order.left_out)
        runs, rest = list[pytest.Item](), list[pytest.Item]()
        for item in items:
            is_wanted = item.nodeid not in left_out and (chosen is None or is_chosen(item.nodeid, chosen))
            (runs if is_wanted else rest).append(item)
        items[:] = runs
        if rest:
            config.hook.pytest_deselected(items=rest)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" or not report.passed:
            self._note(report.nodeid, report.outcome, report.longrepr)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self._note(report.nodeid, report.outcome, report.longrepr)

    def _note(self, node_id: str, outcome: str, why: object) -> None:
        if self._is_worker:  # the process that started it hears of each test
            return
        crash = getattr(why, "reprcrash", None)
        message = str(crash.message if crash is not None else why or "").strip()
        with open(self._order.report, "a") as file:
            file.write(json.dumps([node_id, outcome, message[:300]]) + "\n")


def pytest_configure(config: pytest.Config) -> None:
    order = Order(**json.loads(Path(os.environ[ORDER]).read_text()))
    config.pluginmanager.register(Plugin(order, hasattr(config, "workerinput")))
