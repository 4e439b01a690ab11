"""What of the image can be checked without building it: pins, packages, variables, files."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from service.config import Config

ROOT = Path(__file__).parent.parent
DOCKERFILE = (ROOT / "Dockerfile").read_text()
PIN = re.compile(r"^([a-z0-9_.-]+)==[^\\]+\\\n(?:    --hash=\S+(?: \\)?\n)+", re.MULTILINE | re.IGNORECASE)


def pins(name: str) -> dict[str, str]:
    return {match[1].lower(): match[0] for match in PIN.finditer((ROOT / name).read_text() + "\n")}


def test_the_image_has_what_was_tested() -> None:
    """requirements.serve.lock is requirements.lock without the extras: uv pip compile, with that as constraint."""
    everything, serving = pins("requirements.lock"), pins("requirements.serve.lock")
    assert len(serving) > 20 and {name: everything.get(name) for name in serving} == serving
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = {re.split(r"[<>=\[; ]", text)[0].lower() for text in project["dependencies"]}
    assert wanted <= serving.keys() and "pytest" not in serving


def test_the_image_has_the_packages_that_make_run_asks_for() -> None:
    (packages,) = re.findall(r'^MESA="(.*)"', (ROOT / ".ci/packages").read_text(), re.MULTILINE)
    for package in packages.split():
        assert f" {package}" in DOCKERFILE


@pytest.mark.parametrize("name", ["Dockerfile", "compose.yaml", ".dockerignore"])
def test_names_are_real(name: str) -> None:
    text = (ROOT / name).read_text()
    known = {f"SUNBOX_{field.upper()}" for field in Config.model_fields}
    assert set(re.findall(r"SUNBOX_[A-Z_]+", text)) <= known
    for source in re.findall(r"^COPY (?!--from)(.+) \S+$", text, re.MULTILINE):
        for file in source.split():
            assert (ROOT / file).exists()
            assert f"\n!{file}\n" in (ROOT / ".dockerignore").read_text()


def test_the_image_runs_as_nobody_in_particular_and_writes_to_one_place() -> None:
    assert re.search(r"^USER \d+$", DOCKERFILE, re.MULTILINE) and "HEALTHCHECK" in DOCKERFILE
    assert re.findall(r"^VOLUME (.*)$", DOCKERFILE, re.MULTILINE) == ["/data"]
    for variable in ("SUNBOX_DATA_DIR", "XDG_CACHE_HOME", "HOME"):
        assert re.search(rf"{variable}=/data\b", DOCKERFILE)
