"""What things stand on."""

from __future__ import annotations

import pytest

from tests.web.conftest import Editor
from tests.web.editing import document


def test_things_stand_on_a_ground(editor: Editor) -> None:
    editor.pick("scenes", "point-lights")
    editor.wait("the scene", lambda: editor.text("#scene-title") == "Two point lights")
    editor.outline(True)
    before = document(editor)
    editor.page.select_option("#add", label="Ground")
    editor.wait("the ground", lambda: "Stage" in editor.text("#outline-list"))
    ground = document(editor)["shapes"][-1]
    assert ground["type"] == "quad" and ground["origin"][1] == pytest.approx(0, abs=1e-5)
    editor.page.select_option("#add", label="Ground")
    editor.wait("it again", lambda: document(editor)["shapes"][-1]["name"] == "Stage")
    assert len(document(editor)["shapes"]) == len(before["shapes"]) + 1, "there is one at most"
    assert len(document(editor)["materials"]) == len(before["materials"]) + 1
    editor.page.click("#undo")  # once: the second ground was the first one again
    assert document(editor)["shapes"] == before["shapes"]
    assert editor.text("#messages") == ""
