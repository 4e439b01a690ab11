"""The wheel: shaders and the editor travel in it and are found there, away from the checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder holding the built wheel's contents, as an installation would."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=120)
    (wheel,) = folder.glob("sunbox_server-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def run_from(site: Path, *command: str) -> subprocess.CompletedProcess[str]:
    # PYTHONPATH comes before the checkout's own entry in site-packages.
    environment = {**os.environ, "PYTHONPATH": str(site)}
    return subprocess.run(
        [sys.executable, *command], cwd=site.parent, env=environment, capture_output=True, text=True, timeout=120
    )


def test_wheel_holds_every_file(site: Path) -> None:
    files = [p for room in ("service", "gpu", "shaders", "web") for p in (ROOT / room).rglob("*") if p.is_file()]
    names = [str(p.relative_to(ROOT)) for p in files if "__pycache__" not in p.parts]
    assert len(names) > 50 and [name for name in names if not (site / name).exists()] == []


def test_wheel_holds_nothing_else(site: Path) -> None:
    tops = {path.name for path in site.iterdir()}
    assert {name for name in tops if not name.endswith(".dist-info")} == {"service", "gpu", "shaders", "web"}


def test_editor_is_found(site: Path) -> None:
    program = """
from fastapi.testclient import TestClient
import service.server.app, sys
from service.config import Config
client = TestClient(service.server.app.create_app(Config()), base_url="http://127.0.0.1")
sys.stdout.write(service.server.app.__file__ + "\\n" + client.get("/").text)
"""
    answer = run_from(site, "-c", program)
    assert answer.returncode == 0, answer.stderr
    origin, page = answer.stdout.split("\n", 1)
    assert origin.startswith(str(site)) and "<canvas" in page


def test_shaders_are_found(site: Path, gpu: Any, tmp_path: Path) -> None:
    scene = {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "environment": {"type": "constant", "radiance": 1},
        "materials": {"a": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "a"}],
    }
    source, picture = tmp_path / "scene.json", tmp_path / "out.png"
    source.write_text(json.dumps(scene))
    size = ["--set", "width=8", "--set", "height=8"]
    answer = run_from(site, "-m", "service.cli", "render", str(source), "-o", str(picture), "--spp", "1", *size)
    assert answer.returncode == 0, answer.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
