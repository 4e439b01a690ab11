"""`sunbox.render`: in this process, without a server."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.asset_files import png
from tests.serving import ENDLESS, LISTENS, SCENE, SMALL

PROGRAM = """
import json, sys, numpy as np, sunbox
picture = sunbox.render("scene.json", **json.loads(sys.argv[1]))
np.save("local.npy", picture.numpy())
picture.save("local.png")
print(picture.samples, picture.aov("depth").shape, picture.warnings, len(picture.exr()) > 1000)
for bad in ({"width": 0}, {"seed": "x"}):
    try:
        sunbox.render("scene.json", **bad)
    except sunbox.Refused as refused:
        print(refused.status, refused.pointer)
try:
    picture.png(tone_map="nothing")
except sunbox.Refused as refused:
    print(refused.pointer)
"""


def run(folder: Path, program: str, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "SUNBOX_DATA_DIR": str(folder / "data"), **variables}
    return subprocess.run(
        [sys.executable, "-c", program, *arguments], cwd=folder, env=environment, capture_output=True, text=True
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "t.png").write_bytes(png(np.full((2, 2, 3), 200, np.uint8)))
    materials = {**SCENE["materials"], "floor": {"type": "diffuse", "albedo": {"texture": "t"}}}
    scene = {**SCENE, "textures": {"t": {"asset": "t.png"}}, "materials": materials}
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    return tmp_path


def test_bits_are_those_of_the_command_line(folder: Path) -> None:
    made = run(folder, PROGRAM, json.dumps(SMALL))
    assert made.returncode == 0 and "Traceback" not in made.stderr, made.stderr
    assert made.stdout.splitlines() == [
        "8 (24, 32, 1) [] True",
        "422 /settings/width",
        "422 /settings/seed",
        "/tone_map",
    ]
    options = [option for name, value in SMALL.items() for option in ("--set", f"{name}={value}")]
    command = "import sys; from service.cli.program import main; sys.exit(main())"
    assert run(folder, command, "render", "scene.json", "-o", "cli.npy", *options).returncode == 0
    assert np.array_equal(np.load(folder / "local.npy"), np.load(folder / "cli.npy"))


def test_interrupt_ends_it(folder: Path) -> None:
    program = f"{LISTENS}; import sunbox; print('begins', flush=True); sunbox.render('scene.json', **{ENDLESS!r})"
    environment = {**os.environ, "SUNBOX_DATA_DIR": str(folder / "data")}
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "begins\n"
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=120)
    assert "KeyboardInterrupt" in said and process.returncode != 0


def test_without_the_server_it_says_so(folder: Path) -> None:
    program = """
import sys
sys.modules["service"] = None
import sunbox
try:
    sunbox.render({})
except RuntimeError as error:
    print(error)
"""
    assert "sunbox-server" in run(folder, program).stdout
