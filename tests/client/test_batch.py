"""Batches from Python, and the commands that render them."""

from __future__ import annotations

import json
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

import sunbox
from service.cli.program import main
from tests.serving import ENDLESS, SCENE, SMALL, Server, wait_until

OVER = {"/materials/ball/roughness": [0.1, 0.9]}


def test_a_batch(server: Server) -> None:
    with sunbox.Client(server.url) as client:
        batch = client.batch(SCENE, OVER, label="two", **SMALL)
        assert dict(batch.as_completed()).keys() == {0, 1}
        assert [picture.samples for picture in batch.pictures()] == [8, 8]
        assert client.batch_of(batch.id).status()["label"] == "two"
        assert Image.open(BytesIO(batch.animation("gif", width=16))).size == (16, 12)
        assert batch.sheet()[1:4] == b"PNG" and batch.zip()[:2] == b"PK"
        with pytest.raises(sunbox.Refused, match=r"must end in one of"):
            batch.save_sheet("sheet.bmp")
        batch.delete()
        with pytest.raises(sunbox.NotFound):
            batch.status()


def test_mistakes_and_cancelling(server: Server) -> None:
    with sunbox.Client(server.url) as client:
        with pytest.raises(sunbox.Refused) as refused:
            client.batch(SCENE, {"/materials/ball/roughness": [0.1, 9]}, **SMALL)
        assert refused.value.pointer == "/over/0/values/1"
        endless = client.batch(SCENE, OVER, **ENDLESS)
        endless.cancel()
        assert endless.wait()["state"] == "cancelled"
        endless.delete()


@pytest.fixture
def scene(tmp_path: Path) -> str:
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    return str(tmp_path / "scene.json")


SIZE = ["--set", "width=32", "--set", "height=24", "--spp", "4"]


def test_sweep(server: Server, scene: str, tmp_path: Path) -> None:
    over = ["--over", "/materials/ball/roughness=0.1,0.9", "--over", "/materials/ball/base_color=#aa0000,#00aa00"]
    sheet = tmp_path / "sheet.png"
    assert main(["sweep", scene, *over, *SIZE, "-o", str(sheet), "--server", server.url]) == 0
    assert Image.open(sheet).width > 64


def test_turntable_without_a_server(scene: str, tmp_path: Path) -> None:
    made = tmp_path / "turn.webp"
    assert main(["turntable", scene, "--frames", "3", *SIZE, "--width", "16", "-o", str(made)]) == 0
    shown = Image.open(made)
    assert shown.size == (16, 12) and shown.n_frames == 3  # type: ignore[attr-defined]


def test_a_killed_command_leaves_no_server_behind(scene: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "service.cli", "turntable", scene, "-o", str(tmp_path / "turn.webp")]
    process = subprocess.Popen([*command, "--spp", str(1 << 24)])
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    wait_until(lambda: children.read_text())
    (server,) = children.read_text().split()
    process.kill()
    process.wait()
    state = Path(f"/proc/{server}/status")
    wait_until(lambda: not state.exists() or "(zombie)" in state.read_text())


@pytest.mark.parametrize(
    ("over", "output", "said"),
    [
        ("roughness=1", "s.png", "write it as /materials"),
        ("/materials/ball/roughness=1", "s.bmp", ".webp"),
        ("/materials/ball/roughness=0.1,7", "s.png", "--over /materials/ball/roughness=7: "),
        ("/materials/no/roughness=0.1", "s.png", "--over /materials/no/roughness: "),
    ],
)
def test_mistakes_of_a_sweep(
    server: Server, scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], over: str, output: str, said: str
) -> None:
    arguments = ["sweep", scene, "--over", over, "-o", str(tmp_path / output), "--server", server.url]
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert said in error and "/over/" not in error


def test_mistakes_of_a_turntable(
    server: Server, scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["turntable", scene, "-o", str(tmp_path / "t.webp"), "--server", server.url]
    for option, value in (("--frames", "0"), ("--degrees", "1e9")):
        assert main([*arguments, option, value]) == 2
        error = capsys.readouterr().err
        assert f"{option}" in error and "/over/" not in error
