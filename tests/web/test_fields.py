"""Fields follow a hand that drags their label, and take what people write."""

from __future__ import annotations

import math

import pytest

from tests.web.editing import document
from tests.web.editor import Editor


def drag(editor: Editor, label: str, right: float, *, escape: bool = False) -> None:
    place = editor.page.locator(label)
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    assert box
    x, y = box["x"] + 4, box["y"] + box["height"] / 2
    editor.page.mouse.move(x, y)
    editor.page.mouse.down()
    editor.page.mouse.move(x + right, y, steps=5)
    if escape:
        editor.page.keyboard.press("Escape")
    editor.page.mouse.up()


def test_a_label_that_is_dragged_changes_its_number(editor: Editor) -> None:
    page, label = editor.page, "#material-form [data-field=roughness] > label"
    entry = editor.field("roughness", "number")
    before = document(editor)
    drag(editor, label, 40)
    assert float(page.input_value(entry)) == pytest.approx(0.5), "twenty steps of a hundredth"
    assert page.evaluate("document.activeElement.id") != page.get_attribute(label, "for"), "it was no click"
    drag(editor, label, 400)
    assert page.input_value(entry) == "1", "it stays inside of its range"
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    assert document(editor) == before, "each drag is one step of undo"
    drag(editor, label, 40, escape=True)
    assert document(editor) == before
    page.keyboard.down("Shift")
    drag(editor, label, -4)
    page.keyboard.up("Shift")
    assert float(page.input_value(entry)) == pytest.approx(0.1), "ten steps at once"
    page.click(label)
    assert page.evaluate("document.activeElement.id") == page.get_attribute(label, "for")

    # Of three numbers each by its letter.
    center = [float(each.input_value()) for each in page.locator("#thing-form [data-field=center] input").all()]
    drag(editor, "#thing-form [data-field=center] [data-axis=Y] > i", 10)
    moved = document(editor)["shapes"][0]["center"]
    assert moved[0] == center[0] and moved[1] > center[1] and moved[2] == center[2]


def test_colours_and_lengths_are_taken_as_written(editor: Editor) -> None:
    page = editor.page
    text, swatch = editor.field("base_color", "text"), editor.field("base_color", "color")
    for written, shown in (("#0af", "#00aaff"), ("rgb(10, 20, 30)", "#0a141e"), ("hsl(120 100% 25%)", "#008000")):
        page.fill(text, written)
        page.press(text, "Enter")
        assert page.input_value(swatch) == shown
    page.fill(text, "blau")
    page.press(text, "Enter")
    assert "hsl()" in editor.text("[data-field=base_color] .trouble")
    radius = "#thing-form [data-field=radius] input.number"
    page.fill(radius, "1/2 + 25 cm")
    page.press(radius, "Enter")
    assert document(editor)["shapes"][0]["radius"] == 0.75


def test_a_camera_of_another_type_shows_as_much(editor: Editor) -> None:
    page = editor.page
    editor.tab("scene")
    page.click("#outline-list [data-thing='/camera']")
    before, was = editor.settled(), document(editor)["camera"]
    page.select_option("#camera-type", "orthographic")
    editor.wait_for_change(before)
    made = document(editor)["camera"]
    seen = 2 * math.dist(was["position"], was["target"]) * math.tan(math.radians(was["vfov"]) / 2)
    assert made["type"] == "orthographic" and made["height"] == pytest.approx(seen, rel=0.01)
    editor.tab("scene")
    page.click("#outline-list [data-thing='/camera']")
    assert page.locator("#thing-form [data-field=height]").is_visible()
    assert page.locator("#thing-form [data-field=vfov]").count() == 0
    page.hover("#stage")
    page.mouse.wheel(0, -200)
    editor.wait("fewer metres", lambda: document(editor)["camera"]["height"] < made["height"])
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    editor.wait("the lens again", lambda: document(editor)["camera"].get("type", "perspective") == "perspective")
    assert editor.complaints == []
