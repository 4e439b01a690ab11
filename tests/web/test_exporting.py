"""The menu Export: files for other programs with what they lose, and programs that make the same picture."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.serving import Server
from tests.web.editor import Editor

pytestmark = pytest.mark.browser


def test_a_program_makes_the_same_picture_and_glb_says_what_it_loses(
    editor: Editor, server: Server, tmp_path: Path
) -> None:
    page, shown = editor.page, editor.shot("#download")
    page.click("#export")
    page.click("#copy-python")
    editor.wait("the program", lambda: "Client" in page.input_value(".command"))
    program = page.input_value(".command")
    path = tmp_path / "program.py"
    path.write_text(program)
    subprocess.run([sys.executable, path], cwd=tmp_path, check=True, timeout=120)
    with Image.open(tmp_path / "sunbox.png") as picture, Image.open(io.BytesIO(shown)) as own:
        assert picture.size == own.size
    page.keyboard.press("Escape")

    made = editor.shot("#download-glb")
    told = page.locator("#messages .export")
    editor.wait("the losses", told.is_visible)
    assert "cannot hold" in editor.told() and "environment" in editor.told().lower()
    assert "/scene" not in editor.told(), "places are in words"
    answer = server.http.post("/v1/assets", content=made)
    assert made[:4] == b"glTF" and answer.json()["kind"] == "scene"
