"""Things of the scene: moved, added beside others, given materials of their own."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from tests import gltf_files
from tests.web.conftest import Editor


def document(editor: Editor) -> Any:
    """The scene as the page would save it."""
    editor.tab("keep")
    return json.loads(editor.shot("text=Scene as JSON"))


def entries(editor: Editor, name: str) -> list[float]:
    rows = editor.page.locator(f"#thing-form [data-field={name}] input")
    return [float(rows.nth(i).input_value()) for i in range(rows.count())]


def test_imported_parts_are_moved_turned_and_scaled(editor: Editor) -> None:
    file = gltf_files.Gltf()
    mesh = file.mesh()
    file.node(mesh=mesh, translation=[0.5, 1, 0], rotation=[0, 0, np.sqrt(0.5), np.sqrt(0.5)], scale=[2, 1, 1])
    # A turned part of a parent that is stretched: a matrix without a form as move, turn and scale.
    inner = file.node(False, mesh=mesh, rotation=[0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8)])
    file.node(scale=[1, 2, 1], translation=[0, 0, -1], children=[inner])
    editor.settled()
    editor.drop("#stage", {"two.glb": file.glb()})
    editor.tab("scene")
    things = editor.page.locator("#outline-list [data-thing^='/shapes/']")
    editor.wait("the parts", lambda: things.count() == 2)
    before = editor.settled()

    things.nth(0).click()
    assert entries(editor, "translate") == [0.5, 1, 0]
    assert entries(editor, "rotate") == [0, 0, 90]
    assert entries(editor, "scale") == [2, 1, 1]
    turn = editor.page.locator("#thing-form [data-field=rotate] input").nth(1)
    turn.fill("70")
    turn.press("Tab")
    editor.wait_for_change(before)
    focused = editor.page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert focused == "Rotate, Z", "the form stays as it is while it is filled in"
    before = editor.settled()

    things.nth(1).click()
    assert entries(editor, "translate") == [0, 0, -1]
    assert editor.page.locator("#thing-form [data-field=rotate]").count() == 0
    assert "skewed in its file" in editor.text("#thing-form")
    move = editor.page.locator("#thing-form [data-field=translate] input").nth(0)
    move.fill("-0.8")
    move.press("Enter")
    editor.wait_for_change(before)
    assert editor.text("#messages") == ""

    first, second = (shape["transform"] for shape in document(editor)["shapes"])
    assert first == {"translate": [0.5, 1, 0], "rotate": [0, 70, 90], "scale": [2, 1, 1]}
    assert second["matrix"][3] == -0.8 and second["matrix"][11] == -1
