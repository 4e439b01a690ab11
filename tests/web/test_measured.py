"""Measured reflection in the editor: picked with its file, replaced by another one, dropped onto the page."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests import measured_files
from tests.measured_files import Facets
from tests.web.editing import document
from tests.web.editor import Editor


@pytest.fixture(scope="module")
def rough() -> bytes:
    arrays = measured_files.adaptive(Facets(diffuse=(0.8, 0.1, 0.05), alpha=(0.5, 0.5)), thetas=4, side=8, fine=16)
    return measured_files.tensor_file(arrays)


def chosen(editor: Editor) -> dict[str, str]:
    """The only measured material."""
    (found,) = (m for m in document(editor)["materials"].values() if m["type"] == "measured")
    return dict(found)


def test_the_model_asks_for_its_file(editor: Editor, rough: bytes, tmp_path: Path) -> None:
    page = editor.page
    before, model = editor.settled(), page.input_value("#model")
    with page.expect_file_chooser():
        page.select_option("#model", "measured")
    page.locator("input[type=file]").last.dispatch_event("cancel")
    editor.wait("the model as it was, where somebody has no file", lambda: page.input_value("#model") == model)
    with page.expect_file_chooser() as asked:
        page.select_option("#model", "measured")
    path = tmp_path / "red.bsdf"
    path.write_bytes(rough)
    assert ".bsdf" in (asked.value.element.get_attribute("accept") or "")
    asked.value.set_files(path)
    editor.wait("the model", lambda: page.input_value("#model") == "measured")
    editor.wait_for_change(before)
    red = chosen(editor)
    assert red["type"] == "measured" and red["asset"].startswith("sha256:")
    if "SHOTS" in os.environ:
        page.screenshot(path=os.environ["SHOTS"])
    # Another file in its place.
    (tmp_path / "plastic.binary").write_bytes(measured_files.merl(Facets()))
    with page.expect_file_chooser() as asked:
        page.locator("[data-field=asset] button:not(.reset)").click()
    asked.value.set_files(tmp_path / "plastic.binary")
    editor.wait("the other file", lambda: chosen(editor)["asset"] != red["asset"])
    page.keyboard.press("Control+z")
    editor.wait("the first file again", lambda: chosen(editor)["asset"] == red["asset"])


def test_a_dropped_measurement_is_what_the_material_becomes(editor: Editor, rough: bytes) -> None:
    before = editor.settled()
    editor.drop("#stage", {"red.bsdf": rough})
    editor.wait("the model", lambda: editor.page.input_value("#model") == "measured")
    editor.wait_for_change(before)
