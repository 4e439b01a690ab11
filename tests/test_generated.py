"""Files that a program writes from others here: `.gitattributes` marks them, and each is what its program writes."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

from service.document.schema import schema
from tests.bench import thumbnails, tradeoff_report

ROOT = Path(__file__).parents[1]
CLIENT = ROOT / "client"
ROOMS = ("client", "docs", "gpu", "service", "shaders", "tests", "web")
SUFFIXES = {".css", ".comp", ".glsl", ".html", ".js", ".md", ".py"}
SAYS_SO = re.compile(r"^\W*Written by \S+\.py\b", re.MULTILINE)
HEAD = 1000  # characters in which a file says that it is written by a program
# JSON says nothing. Besides documents and what tests are given these are figures that were measured, which no program
# makes again.
MEASURED = {
    "docs/experiments/figures.json", "docs/hemisphere.json", "docs/scaling.json", "docs/tradeoff.json",
    "tests/bench/profile/llvmpipe.json",
}  # fmt: skip
DOCUMENTS = ("service/document/presets/", "tests/service/", "web/thumbnails/studio.json")


def program(name: str) -> ModuleType:
    """A program of client/, which is in no package."""
    spec = importlib.util.spec_from_file_location(name, CLIENT / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where dataclasses look
    spec.loader.exec_module(module)
    return module


def document() -> str:
    command = [sys.executable, "-m", "ruff", "format", "--stdin-filename", "client/src/sunbox/document.py", "-"]
    written = program("generate").module(schema())
    return subprocess.run(command, cwd=ROOT, input=written, capture_output=True, text=True, check=True).stdout


def widget_script() -> str:
    written: str = program("bundle").bundle()
    return written


def widget_style() -> str:
    return (ROOT / "web" / program("bundle").STYLE).read_text()


def measured_prices() -> dict[str, object]:
    measured: dict[str, object] = json.loads((ROOT / "docs/tradeoff.json").read_text())
    return measured


# What each file has to be, and the command that writes it.
GENERATED: dict[str, tuple[Callable[[], str], str]] = {
    "client/src/sunbox/document.py": (document, "client/generate.py and ruff format"),
    "client/src/sunbox/widget/widget.css": (widget_style, "client/bundle.py"),
    "client/src/sunbox/widget/widget.js": (widget_script, "client/bundle.py"),
    "docs/tradeoff.md": (lambda: tradeoff_report.markdown(measured_prices()), "make tradeoff"),
    "service/document/prices.json": (
        lambda: json.dumps(tradeoff_report.prices(measured_prices()), indent=1) + "\n", "make tradeoff",
    ),
    "web/thumbnails/index.json": (lambda: json.dumps(thumbnails.wanted(), indent=1) + "\n", "make thumbnails"),
}  # fmt: skip


@pytest.mark.parametrize("path", GENERATED)
def test_a_generated_file_is_what_its_program_writes(path: str) -> None:
    written, command = GENERATED[path]
    assert (ROOT / path).read_text() == written(), f"run {command}"


def test_generated_files_and_no_others_are_marked() -> None:
    marked = re.findall(r"^(\S+) linguist-generated$", (ROOT / ".gitattributes").read_text(), re.MULTILINE)
    assert marked == sorted(GENERATED)


def test_a_file_that_is_written_by_a_program_is_among_them() -> None:
    says_so = {path for path in files(SUFFIXES) if SAYS_SO.search((ROOT / path).read_text()[:HEAD])}
    says_so.remove("client/generate.py")  # in the head that it writes
    assert says_so == {path for path in GENERATED if Path(path).suffix in (".py", ".js")}
    others = {path for path in files({".json"}) if not path.startswith(DOCUMENTS)}
    assert others == MEASURED | {path for path in GENERATED if Path(path).suffix == ".json"}


def files(suffixes: set[str]) -> Iterator[str]:
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*")):
            if path.suffix in suffixes and "node_modules" not in path.parts:
                yield path.relative_to(ROOT).as_posix()
