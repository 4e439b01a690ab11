"""What things stand on."""

from __future__ import annotations

import pytest

from tests.web.editing import document, point
from tests.web.editor import Editor


def stage(editor: Editor, kind: str) -> None:
    """Choose what things stand on."""
    if not editor.page.is_visible("#stage-menu"):
        editor.page.click("#stage-button")
    editor.page.get_by_role("radio", name=kind, exact=True).check()
    names = {"None": "", "Ground": "Stage", "Cyclorama": "Cyclorama"}
    expected = [each == names[kind] for each in ("Stage", "Cyclorama")]
    editor.wait(kind, lambda: [each in editor.text("#outline-list") for each in ("Stage", "Cyclorama")] == expected)


def test_one_switch_says_what_things_stand_on(editor: Editor) -> None:
    page = editor.page
    editor.pick("scenes", "point-lights")
    editor.wait("the scene", lambda: editor.text("#scene-title") == "Two point lights")
    editor.outline(True)
    before = document(editor)
    page.select_option("#add", label="Ground")
    editor.wait("the ground", lambda: "Stage" in editor.text("#outline-list"))
    ground = document(editor)["shapes"][-1]
    assert ground["type"] == "quad" and ground["origin"][1] == pytest.approx(0, abs=1e-5)
    page.select_option("#add", label="Ground")
    editor.wait("it again", lambda: document(editor)["shapes"][-1]["name"] == "Stage")
    assert len(document(editor)["shapes"]) == len(before["shapes"]) + 1, "there is one at most"
    assert len(document(editor)["materials"]) == len(before["materials"]) + 1
    page.click("#undo")  # once: the second ground was the first one again
    assert document(editor)["shapes"] == before["shapes"]
    assert editor.text("#messages") == ""

    page.click("#stage-button")
    editor.wait("the menu", lambda: page.get_by_role("radio", name="None", exact=True).is_checked())
    assert page.get_by_label("Backdrop colour").is_hidden()

    stage(editor, "Cyclorama")
    page.get_by_label("Backdrop colour").fill("#804020")
    page.keyboard.press("Escape")
    scene = document(editor)
    wall = scene["shapes"][-1]
    assert wall["type"] == "mesh" and wall["transform"]["translate"][1] == pytest.approx(0, abs=1e-5)
    assert scene["materials"][wall["material"]]["albedo"] == pytest.approx([0.2159, 0.0513, 0.0144], abs=1e-3)
    editor.settled()

    stage(editor, "Ground")
    page.keyboard.press("Escape")
    ground = document(editor)
    assert len(ground["shapes"]) == len(before["shapes"]) + 1 and ground["shapes"][-1]["type"] == "quad"
    assert ground["materials"] == scene["materials"], "it keeps its colour"
    stage(editor, "None")
    page.keyboard.press("Escape")
    bare = document(editor)
    assert bare["shapes"] == before["shapes"] and bare["materials"] == before["materials"]
    page.click("#undo")
    assert document(editor) == ground, "one step for one switch"


def test_a_turntable_turns_what_is_shown_alone(editor: Editor) -> None:
    page = editor.page
    page.emulate_media(reduced_motion="no-preference")
    first = editor.settled()
    before = document(editor)
    page.click("#stage-button")
    page.get_by_label("Turntable").check()
    page.keyboard.press("Escape")
    editor.wait_for_change(first)
    assert document(editor) == before, "the scene's own camera stays where it is"
    x, y = point(editor, 0.5, 0.5)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.up()
    after = document(editor)["camera"]
    assert after["position"] != before["camera"]["position"], "a hand takes over the view as it stands"
    page.click("#undo")
    assert document(editor) == before
    page.emulate_media(reduced_motion="reduce")
    page.click("#stage-button")
    assert page.get_by_label("Turntable").is_disabled()
