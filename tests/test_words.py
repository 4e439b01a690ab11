"""Docstrings are sentences with a subject, or noun phrases, that say what comes back."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("service", "gpu", "client/src")
GENERATED = ROOT / "client/src/sunbox/document.py"
MOST = 40
NO_SUBJECT = {"What", "Which", "Whose", "Of", "Whether"}
ROUTES = ROOT / "service/server/routes"  # whose docstrings are read in OpenAPI
DOCUMENT = ROOT / "service/document"  # whose classes' docstrings are read in the schema
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def _docstrings(path: Path) -> Iterator[tuple[str, str]]:
    """The place and the text of each docstring of a file that only programmers read."""
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, DOCUMENTED) or (isinstance(node, ast.ClassDef) and path.is_relative_to(DOCUMENT)):
            continue
        if text := ast.get_docstring(node):
            yield f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 1)}", text


def _without_subject(text: str) -> bool:
    return text.split(maxsplit=1)[0] in NO_SUBJECT


def test_few_docstrings_begin_without_a_subject() -> None:
    paths = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
    read = [path for path in paths if not path.is_relative_to(ROUTES) and path != GENERATED]
    texts = [each for path in read for each in _docstrings(path)]
    assert len(texts) > 1000  # the search itself finds them
    found = [f"{place}: {text.splitlines()[0]}" for place, text in texts if _without_subject(text)]
    assert len(found) <= MOST, "\n".join(found)


def test_fragments_are_found() -> None:
    assert _without_subject("Of the mean.") and _without_subject("Whether it waits.")
    assert not _without_subject("Variance of the mean, per pixel.")
