"""No test fails because the machine is busy: none asserts that something took less than some seconds."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
CLOCKS = {"monotonic", "perf_counter", "process_time", "thread_time", "monotonic_ns", "perf_counter_ns", "time"}
WHAT_ELSE = (
    "asserts that something took less than some seconds, which fails on a busy machine and hides the fault on a quick"
    " one. Count the work, or simulate the time (tests/counting.py); a wait that is bounded against hanging is "
    "wait_until (tests/serving.py); speed belongs to the benchmarks"
)


def is_duration(node: ast.expr, names: set[str]) -> bool:
    """Whether it is `clock() - began`, or a name for that."""
    if isinstance(node, ast.Name):
        return node.id in names
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, ast.Sub) or not isinstance(node.left, ast.Call):
        return False
    called = node.left.func
    return (called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")) in CLOCKS


def bounded_durations(source: str) -> Iterator[int]:
    """The lines of assertions in which a duration is the smaller side of a comparison."""
    tree = ast.parse(source)
    assigned = [node for node in ast.walk(tree) if isinstance(node, ast.Assign) and is_duration(node.value, set())]
    names = {target.id for node in assigned for target in node.targets if isinstance(target, ast.Name)}
    for claim in (node for node in ast.walk(tree) if isinstance(node, ast.Assert)):
        for compared in (node for node in ast.walk(claim.test) if isinstance(node, ast.Compare)):
            sides = [compared.left, *compared.comparators]
            for left, operator, right in zip(sides, compared.ops, sides[1:], strict=False):
                smaller = {ast.Lt: left, ast.LtE: left, ast.Gt: right, ast.GtE: right}.get(type(operator))
                if smaller is not None and is_duration(smaller, names):
                    yield claim.lineno


def test_no_duration_has_a_bound() -> None:
    files = {path.relative_to(TESTS.parent): path.read_text("utf-8") for path in TESTS.glob("**/*.py")}
    lines = [f"{path}:{line}" for path, source in files.items() for line in bounded_durations(source)]
    assert not lines, f"{', '.join(lines)} {WHAT_ELSE}"


@pytest.mark.parametrize(
    ("claim", "is_bounded"),
    [
        ("assert time.monotonic() - began < 0.5", True),
        ("assert found and 5 >= perf_counter() - began", True),
        ("took_s = time.process_time() - began\nassert took_s <= 3", True),
        ("assert time.monotonic() < until", False),  # against hanging
        ("assert time.monotonic() - began >= HOLD_S", False),  # true however busy the machine is
        ("assert 0.2 <= stopped.elapsed_s <= time.monotonic() - began", False),
    ],
)
def test_the_rule_is_what_it_says(claim: str, is_bounded: bool) -> None:
    assert bool(list(bounded_durations(claim))) is is_bounded
