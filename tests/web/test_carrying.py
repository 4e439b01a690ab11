"""Materials are carried from the shelf to things, which are shown with them before they stay."""

from __future__ import annotations

from tests.web.editing import document, point
from tests.web.editor import Editor

FLOOR = (0.1, 0.75)


def test_a_material_is_dragged_onto_a_thing(editor: Editor) -> None:
    editor.settled()
    stage = editor.page.locator("#stage").bounding_box()
    assert stage
    low = {"x": stage["width"] * FLOOR[0], "y": stage["height"] * FLOOR[1]}

    def carry(option: str) -> None:
        """Once more where the picture was not yet ready to tell what lies there."""
        editor.page.drag_and_drop(option, "#stage", target_position=low)
        editor.page.wait_for_timeout(500)

    def is_brass() -> bool:
        carry("#library [data-value=brass]")
        return bool(document(editor)["materials"]["floor"].get("metallic") == 1)

    def is_shared() -> bool:
        carry("#materials [data-value=subject]")
        return bool(document(editor)["shapes"][1]["material"] == "subject")

    editor.wait("brass on the floor", is_brass)
    assert document(editor)["materials"]["subject"].get("metallic", 0) == 0
    editor.wait("the other", is_shared)
    # Both are made of one material now: only what was aimed at gets another.
    ball = document(editor)["materials"]["subject"]
    editor.wait(
        "brass again", lambda: carry("#library [data-value=brass]") or "brass" in document(editor)["materials"]
    )
    scene = document(editor)
    assert [shape["material"] for shape in scene["shapes"]] == ["subject", "brass"]
    assert scene["materials"]["subject"] == ball and scene["materials"]["brass"]["metallic"] == 1


def test_a_thing_is_shown_with_what_hovers_over_it(editor: Editor) -> None:
    page, mouse = editor.page, editor.page.mouse
    before = editor.settled()
    scene = document(editor)
    brass = page.locator("#library [data-value=brass]")
    brass.scroll_into_view_if_needed()
    tile = brass.bounding_box()
    assert tile
    start = (tile["x"] + tile["width"] / 2, tile["y"] + tile["height"] / 2)
    ball, floor = point(editor, 0.5, 0.5), point(editor, *FLOOR)
    outline = "#outline-list [data-thing='/shapes/1']"

    mouse.move(*start)
    mouse.down()
    for place in (ball, floor, ball):
        mouse.move(*place, steps=4)
        editor.wait_for_change(before, 8)
    mouse.move(*start, steps=4)
    editor.wait("the scene as it was", lambda: not editor.differs(before, 6))
    mouse.up()
    assert page.is_disabled("#undo") and document(editor) == scene, "nothing was let go over a thing"

    # The same over the outline.
    editor.outline(shown=True)
    row = page.locator(outline).bounding_box()
    assert row
    mouse.move(*start)
    mouse.down()
    mouse.move(row["x"] + 20, row["y"] + row["height"] / 2, steps=4)
    mouse.move(row["x"] + 24, row["y"] + row["height"] / 2, steps=4)
    editor.wait_for_change(before, 8)
    mouse.up()
    editor.wait("brass", lambda: document(editor)["materials"]["floor"].get("metallic") == 1)
    page.keyboard.press("Control+z")
    assert document(editor) == scene and page.is_disabled("#undo"), "one step"
