"""Materials are carried from the shelf to things, which are pointed out before they get them."""

from __future__ import annotations

from tests.web.editing import document, point
from tests.web.editor import Editor

FLOOR = (0.1, 0.75)
SENT = """() => {
    window.sent = [];
    const { send } = WebSocket.prototype;
    WebSocket.prototype.send = function (message) {
        window.sent.push(String(message));
        send.call(this, message);
    };
}"""


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
        return bool(document(editor)["materials"].get("Brass", {}).get("metallic") == 1)

    def is_shared() -> bool:
        carry("#materials [data-value='Red paint']")
        return bool(document(editor)["shapes"][1]["material"] == "Red paint")

    editor.wait("brass on the floor", is_brass)
    assert document(editor)["materials"]["Red paint"].get("metallic", 0) == 0
    editor.wait("the other", is_shared)
    # Both are made of one material now: only what was aimed at gets another.
    ball = document(editor)["materials"]["Red paint"]

    def is_parted() -> bool:
        carry("#library [data-value=brass]")
        return bool(document(editor)["shapes"][1]["material"] == "Brass")

    editor.wait("brass again", is_parted)
    scene = document(editor)
    assert [shape["material"] for shape in scene["shapes"]] == ["Red paint", "Brass"]
    assert list(scene["materials"]) == ["Red paint", "Brass"] and scene["materials"]["Red paint"] == ball


def test_what_hovers_over_a_thing_points_it_out_and_asks_for_nothing(editor: Editor) -> None:
    page, mouse = editor.page, editor.page.mouse
    editor.settled()
    scene = document(editor)
    page.evaluate(SENT)
    brass = page.locator("#library [data-value=brass]")
    brass.scroll_into_view_if_needed()
    tile = brass.bounding_box()
    assert tile
    start = (tile["x"] + tile["width"] / 2, tile["y"] + tile["height"] / 2)
    ball, floor = point(editor, 0.5, 0.5), point(editor, *FLOOR)
    outline = "#outline-list [data-thing='/shapes/1']"

    mouse.move(*start)
    mouse.down()
    outlines = set[str]()
    for place in (ball, floor, ball):
        mouse.move(*place, steps=4)
        editor.wait("an outline", lambda: page.locator("#outline.shown").count() == 1)
        rows = 1 if place == floor else 0
        editor.wait("the row", lambda rows=rows: page.locator(f"{outline}.under-hand").count() == rows)  # type: ignore[misc]
        outlines.add(page.evaluate("document.getElementById('outline').toDataURL()"))
    assert len(outlines) == 2
    mouse.move(*start, steps=4)
    editor.wait("no outline", lambda: page.locator("#outline.shown, .under-hand").count() == 0)
    mouse.up()
    assert page.is_disabled("#undo") and document(editor) == scene, "nothing was let go over a thing"
    assert not any('"update"' in each for each in page.evaluate("window.sent")), "nothing had to be prepared"

    # The same over the outline.
    editor.outline(shown=True)
    row = page.locator(outline).bounding_box()
    assert row
    mouse.move(*start)
    mouse.down()
    mouse.move(row["x"] + 20, row["y"] + row["height"] / 2, steps=4)
    mouse.move(row["x"] + 24, row["y"] + row["height"] / 2, steps=4)
    editor.wait("the row", lambda: page.locator(f"{outline}.under-hand").count() == 1)
    mouse.up()
    editor.wait("brass", lambda: document(editor)["shapes"][1]["material"] == "Brass")
    page.keyboard.press("Control+z")
    assert document(editor) == scene and page.is_disabled("#undo"), "one step"
