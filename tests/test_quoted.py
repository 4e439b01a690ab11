"""Programs that tests have in quotes import what is there: else some fail in the longest tests alone."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import pytest

from tests.conftest import TESTS

WRITTEN = {"service.document.material.matte"}  # by the test itself


def quoted(path: Path) -> Iterator[ast.ImportFrom]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and "import " in node.value:
            with suppress(SyntaxError):
                yield from (each for each in ast.walk(ast.parse(node.value)) if isinstance(each, ast.ImportFrom))


PROGRAMS = [path for path in sorted(TESTS.glob("**/*.py")) if any(quoted(path))]


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: str(path.relative_to(TESTS)))
def test_programs_in_quotes_import_what_is_there(path: Path) -> None:
    for node in quoted(path):
        if (node.module or "").partition(".")[0] in ("service", "gpu") and node.module not in WRITTEN:
            module = import_module(node.module or "")
            for alias in node.names:
                if not hasattr(module, alias.name):
                    import_module(f"{node.module}.{alias.name}")
