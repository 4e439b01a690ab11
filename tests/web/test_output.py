"""The picture that is taken along: its size and shape, and its render as a job of the server's."""

from __future__ import annotations

import io
import re

import pytest
from PIL import Image

from service.images import read_metadata
from tests.web.conftest import Editor
from tests.web.editing import finish

OUTPUT = "#output"


def write(editor: Editor, side: str, value: int) -> None:
    entry = editor.page.locator(editor.field(side, "number", OUTPUT))
    entry.fill(str(value))
    entry.press("Enter")


def side(editor: Editor, name: str) -> int:
    return int(editor.page.input_value(editor.field(name, "number", OUTPUT)))


def test_a_picture_of_any_size_is_rendered_and_saved(editor: Editor) -> None:
    page = editor.page
    finish(editor, 4)
    screen = page.evaluate("[picture.width, picture.height]")
    assert [side(editor, "width"), side(editor, "height")] == screen, "unless told it is the window's"
    assert f"{screen[0]}\u202f×\u202f{screen[1]}" in editor.text(OUTPUT)
    page.select_option(f"{OUTPUT} select", "2:3")
    write(editor, "width", 64)
    assert side(editor, "height") == 96, "the shape stays"
    editor.wait(
        "the shape on screen", lambda: page.evaluate("picture.width / picture.height") == pytest.approx(2 / 3, 0.02)
    )
    page.select_option(f"{OUTPUT} select", "free")
    write(editor, "height", 48)
    assert (side(editor, "width"), side(editor, "height")) == (64, 48)
    page.click(f"{OUTPUT} >> text=Render picture")
    editor.wait("the picture", lambda: page.is_visible(f"{OUTPUT} .result img"))
    saved = editor.shot(f"{OUTPUT} >> text=Save as PNG")
    made = read_metadata(saved)
    assert Image.open(io.BytesIO(saved)).size == (64, 48) and made is not None and made["samples"] == 4
    assert "Done: 64\u202f×\u202f48, 4 samples" in editor.text(OUTPUT)


def test_a_render_can_be_refused_and_cancelled(editor: Editor) -> None:
    page = editor.page
    editor.tab("render")
    samples = page.locator("#settings-form [data-field=max_samples] input")
    samples.fill("100000")
    samples.press("Enter")
    write(editor, "width", 10**8)
    page.click(f"{OUTPUT} button.primary")
    editor.wait("the refusal", lambda: page.locator(f"{OUTPUT} .trouble:visible").count() > 0)
    assert editor.text("#messages") == "", "said once"
    write(editor, "width", 90)
    page.click(f"{OUTPUT} button.primary")
    running = re.compile(r"\d %, \d+ samples")
    editor.wait("samples", lambda: running.search(editor.text(OUTPUT)))
    page.reload()
    editor.tab("render")
    editor.wait("the job that went on", lambda: running.search(editor.text(OUTPUT)))
    page.click(f"{OUTPUT} >> text=Cancel")
    editor.wait("the end", lambda: "Cancelled" in editor.text(OUTPUT))
    assert page.is_enabled(f"{OUTPUT} button.primary")
