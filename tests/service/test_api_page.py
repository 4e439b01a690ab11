"""The tasks of docs/api.md with curl and in Python, as a reader would paste them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.api_page import LANGUAGES, tasks
from tests.asset_files import read_exr
from tests.serving import Server


@pytest.mark.parametrize("language", LANGUAGES)
def test_there_are_ten(language: str) -> None:
    assert sorted(tasks(language)) == list(range(11))


@pytest.mark.slow
def test_curl(server: Server, tmp_path: Path) -> None:
    assert shutil.which("curl")
    script = "set -euo pipefail\n" + "\n".join(code for _, code in sorted(tasks("sh").items()))
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=tmp_path,
        env=os.environ | {"SUNBOX_URL": server.url},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    check_pictures(tmp_path)
    assert Image.open(tmp_path / "so-far.png").size == (160, 120)
    assert np.load(tmp_path / "depth.npy").shape == (120, 160, 1)
    assert [info.filename[-4:] for info in zipfile.ZipFile(tmp_path / "patched.zip").infolist()] == [".png"]
    events = (tmp_path / "events.txt").read_text()
    assert '"state":"done"' in events and events.count("event: done") == 1
    bsdf = json.loads((tmp_path / "bsdf.json").read_text())
    assert np.shape(bsdf["f"]) == (1, 2, 3)
    assert json.loads((tmp_path / "again.json").read_text()) == json.loads((tmp_path / "scene.json").read_text())


def test_python(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_URL", server.url)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "page"}
    told = {}
    for number, code in sorted(tasks("python").items()):
        exec(compile(code, f"task {number}", "exec"), names)
        told[number] = capsys.readouterr().out
    check_pictures(tmp_path)
    assert Image.open("patched.png").size == (160, 120) and Image.open("variation-5.png").size == (96, 72)
    assert np.shape(names["depth"]) == (120, 160, 1) and np.shape(names["albedo"]) == (2, 3)
    assert told[6].splitlines()[-1].startswith("done 64 ")
    assert told[7] == "1 64 max_samples\n" and told[9] == "(1, 2, 3) (1, 2)\n"
    assert names["again"] == names["scene"]


def check_pictures(folder: Path) -> None:
    """What both languages leave behind."""
    sizes = {"picture.png": (512, 512), "bright.jpg": (160, 120), "tetra.png": (160, 120), "poster.png": (160, 120)}
    assert {name: Image.open(folder / name).size for name in sizes} == sizes
    assert Image.open(folder / "sheet.png").width > 3 * 96
    assert {"R", "albedo.R", "depth.Z"} <= set(read_exr((folder / "layers.exr").read_bytes()))
