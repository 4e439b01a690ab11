"""The tasks of the README, one after the other, as a reader would paste them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.serving import Server

README = Path(__file__).parents[2] / "client" / "README.md"
TASKS = re.findall(r"^\*\*(\d+)\. .*?^```python\n(.*?)^```", README.read_text(), re.MULTILINE | re.DOTALL)


def test_there_are_ten() -> None:
    assert [number for number, _ in TASKS] == [str(n) for n in range(1, 11)]


def test_tasks(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_URL", server.url)
    monkeypatch.chdir(tmp_path)
    told, names = {}, {"__name__": "readme"}
    for number, code in TASKS:
        exec(compile(code, f"task {number}", "exec"), names)
        told[number] = capsys.readouterr().out
    made = {path.name for path in tmp_path.iterdir()}
    assert {"sphere.png", "layers.exr", "built.exr", "poster.png"} <= made
    assert {"variation-5.png", "sheet.png", "turn.webp"} <= made
    assert told["1"].startswith("64 0.") and told["1"].rstrip().endswith("[]")
    assert names["color"].shape == (240, 320, 4) and names["depth"].shape == (240, 320, 1)
    assert told["5"].startswith("422 /scene/camera")
    assert told["6"].splitlines()[-1].startswith("done 128 ")
    assert told["7"] == "1 64 max_samples\n"
    assert told["9"].startswith("(1, 33, 3) (1, 33) [[]]\n")
