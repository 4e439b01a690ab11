"""The outline: a tree by names, what is renamed, hidden, locked and chosen together, by mouse and by keys."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Page

from tests.web.editing import document
from tests.web.editor import Editor
from tests.web.modules import call

BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "a"}
NAMES = ("Truck/Body", None, "Truck/Wheels/Left", "Truck/Wheels/Right")
SCENE: dict[str, Any] = {
    "materials": {"a": {}},
    "lights": [{"type": "point", "name": "Truck/Lamp"}],
    "shapes": [BALL | ({"name": name} if name else {}) for name in NAMES],
}


def tree(page: Page, scene: Any) -> list[tuple[int, str]]:
    return [(row["level"], row["title"]) for row in call(page, "document/outline.js", "rows", scene)]


def test_names_make_a_tree(page: Page) -> None:
    expected = [(1, "Camera"), (1, "Environment"), (1, "Truck"), (2, "Lamp"), (2, "Body"), (2, "Wheels"),
                (3, "Left"), (3, "Right"), (1, "Sphere")]  # fmt: skip
    assert tree(page, SCENE) == expected
    rows = {row["title"]: row for row in call(page, "document/outline.js", "rows", SCENE)}
    assert rows["Truck"]["members"] == ["/lights/0", "/shapes/0", "/shapes/2", "/shapes/3"]


def test_a_group_and_a_thing_are_renamed(page: Page) -> None:
    rows = {row["title"]: row for row in call(page, "document/outline.js", "rows", SCENE)}
    state = {"scene": SCENE, "chosen": {}}
    group = call(page, "document/outline.js", "named", state, rows["Wheels"], "Tyres/all")["scene"]
    names = [shape.get("name") for shape in group["shapes"]]
    assert names == ["Truck/Body", None, "Truck/Tyres-all/Left", "Truck/Tyres-all/Right"]
    thing = call(page, "document/outline.js", "named", state, rows["Sphere"], "Moon")["scene"]
    assert thing["shapes"][1]["name"] == "Moon" and SCENE["shapes"][1] == BALL


def test_what_is_deleted_leaves_the_others_hidden(page: Page) -> None:
    chosen = {"thing": "/shapes/1", "hidden": ["/shapes/3", "/lights/0"], "locked": ["/shapes/0"]}
    state = {"scene": SCENE, "chosen": chosen}
    left = call(page, "document/outline.js", "without", state, ["/shapes/0", "/shapes/2"])
    assert [shape.get("name") for shape in left["scene"]["shapes"]] == [None, "Truck/Wheels/Right"]
    assert left["chosen"] == {
        "thing": "/shapes/1",
        "material": "a",
        "hidden": ["/shapes/1", "/lights/0"],
        "locked": [],
    }


def test_hidden_things_keep_their_numbers(page: Page) -> None:
    shown = call(page, "document/outline.js", "visible", SCENE, ["/shapes/2", "/lights/0"])
    assert shown["lights"] == [] and len(shown["shapes"]) == 4
    hidden = shown["materials"][shown["shapes"][2]["material"]]
    assert hidden["alpha"] == 0 and shown["shapes"][3] == SCENE["shapes"][3]


def test_things_are_renamed_locked_and_deleted_together(editor: Editor) -> None:
    page = editor.page
    editor.tab("scene")
    page.click("#outline-list [data-thing='/shapes/0']")
    page.keyboard.press("F2")
    page.keyboard.type("Hero")
    page.keyboard.press("Enter")
    assert document(editor)["shapes"][0]["name"] == "Hero" and editor.text("#thing-title") == "Hero"
    page.locator("#outline-list").focus()
    page.keyboard.press("l")
    assert page.locator("[role=treeitem] [aria-label='Unlock Hero']").count() == 1
    page.keyboard.press("Control+z")
    editor.outline(True)
    page.select_option("#add", label="Box")
    editor.wait("the box", lambda: page.locator("#outline-list [data-thing^='/shapes/']").count() == 3)
    page.click("#outline-list [data-thing='/shapes/0']", modifiers=["Control"])
    assert page.locator("#outline-list [aria-selected=true]").count() == 2
    page.select_option("#outline-several select", "Floor")
    assert [shape["material"] for shape in document(editor)["shapes"]] == ["Floor"] * 3
    page.click("#outline-several >> text=Delete")
    assert len(document(editor)["shapes"]) == 1
    page.keyboard.press("Control+z")
    assert len(document(editor)["shapes"]) == 3, "one step of undo"
    assert editor.complaints == []


def test_opening_another_scene_can_be_taken_back(editor: Editor) -> None:
    editor.pick("scenes", "cornell-empty")
    editor.wait("the room", lambda: "Cornell" in editor.text("#scene-title"))
    assert "Undo" not in editor.text("#messages"), "nothing was changed"
    editor.pick("library", "gold")
    editor.wait("gold", lambda: any(m.get("metallic") == 1 for m in document(editor)["materials"].values()))
    editor.pick("scenes", "sphere-on-floor")
    editor.wait("the offer", lambda: "is not saved" in editor.text("#messages"))
    editor.page.click("#messages >> text=Undo")
    assert "Cornell" in editor.text("#scene-title") and "is not saved" not in editor.text("#messages")
