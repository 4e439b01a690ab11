"""What a hand does in the editor, and what is read off the page."""

from __future__ import annotations

import base64
import io
import json
from typing import Any

import numpy as np
from PIL import Image

from tests.web.editor import Editor

TRIANGLE = b"v -1 0.2 1.2\nv 1 0.2 1.2\nv 0 1.9 1.2\nf 1 2 3\n"


def point(editor: Editor, x: float, y: float) -> tuple[float, float]:
    """A place of the picture, 0..1, on the page."""
    box = editor.page.locator("#stage").bounding_box()
    assert box is not None
    wide, tall = editor.page.evaluate("(({ width, height }) => [width, height])(document.getElementById('picture'))")
    zoom = min(box["width"] / wide, box["height"] / tall)
    return box["x"] + box["width"] / 2 + (x - 0.5) * wide * zoom, box["y"] + box["height"] / 2 + (
        y - 0.5
    ) * tall * zoom


def click(editor: Editor, x: float, y: float) -> None:
    editor.page.mouse.click(*point(editor, x, y))


def camera(editor: Editor) -> dict[str, Any]:
    """The camera's numbers, as the panel shows them."""
    editor.tab("scene")
    editor.page.click("#outline-list [data-thing='/camera']")
    script = """() => Object.fromEntries([...document.querySelectorAll("#thing-form [data-field]")].map((row) =>
        [row.dataset.field, [...row.querySelectorAll("input.number")].map((each) => Number(each.value))]))"""
    found: dict[str, Any] = editor.page.evaluate(script)
    return found


def overlay(editor: Editor, id: str) -> np.ndarray:
    """(height, width, 4) of one of the canvases."""
    script = """(id) => {
        const { width, height } = document.getElementById(id);
        const data = document.getElementById(id).getContext("2d").getImageData(0, 0, width, height).data;
        let text = ""; // a list of numbers would take seconds
        for (let i = 0; i < data.length; i += 8192) text += String.fromCharCode(...data.subarray(i, i + 8192));
        return [width, height, btoa(text)];
    }"""
    width, height, values = editor.page.evaluate(script, id)
    return np.frombuffer(base64.b64decode(values), np.uint8).reshape(height, width, 4)


def finish(editor: Editor, samples: int) -> None:
    """From the start, with another seed: by now the picture may have more samples than that."""
    editor.tab("render")
    editor.page.evaluate("document.querySelector('#more-form').closest('details').open = true")
    for place, value in (("#settings-form [data-field=max_samples]", samples), ("#more-form [data-field=seed]", 7)):
        entry = editor.page.locator(f"{place} input")
        entry.fill(str(value))
        entry.press("Enter")
    editor.wait("the end", lambda: editor.text("#state") == "Done" and editor.samples() == samples)


def keep_on(editor: Editor) -> None:
    """Give the picture no end within reach: how soon it is done, and gets no more samples, depends on the machine."""
    most = 1 << 20
    editor.tab("render")
    entry = editor.page.locator("#settings-form [data-field=max_samples] input")
    entry.fill(str(most))
    entry.press("Enter")
    editor.tab("material")
    editor.page.evaluate("document.activeElement.blur()")  # where letters would be typed
    digits = lambda: "".join(filter(str.isdigit, editor.text("#samples")))  # noqa: E731
    editor.wait("samples of so many", lambda: digits().endswith(str(most)) and editor.samples() >= 1)


def halves(left: tuple[int, int, int] = (0, 220, 0)) -> bytes:
    """Green at the left unless told, dark blue at the right."""
    image = Image.new("RGB", (16, 16), left)
    image.paste((0, 0, 40), (8, 0, 16, 16))
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def document(editor: Editor) -> Any:
    """The scene as the page would save it."""
    return json.loads(editor.shot("#download-scene"))
