"""The scene's materials: new ones, copies, names, and what happens to things whose material goes."""

from __future__ import annotations

from tests.web.editing import TRIANGLE, document
from tests.web.editor import Editor


def test_what_is_new_shares_no_material(editor: Editor) -> None:
    page, users = editor.page, "#material-users"
    editor.settled()
    editor.tab("scene")
    page.select_option("#add", label="Sphere")
    editor.tab("material")
    assert editor.text(users) == "On Sphere 2"
    page.click("#library [data-value=copper]")
    editor.wait("copper", lambda: page.get_attribute("#library [data-value=copper]", "aria-selected") == "true")
    editor.drop("#stage", {"wing.obj": TRIANGLE})
    editor.wait("the mesh", lambda: editor.text(users) == "On wing")
    page.click("#library [data-value=chalk]")

    page.click("#thing-acts >> text=Duplicate")
    editor.tab("material")
    assert editor.text(users) == "On wing 2 and wing", "sharing is told"
    editor.act("own-material")
    assert editor.text(users) == "On wing 2" and page.is_hidden("#own-material")
    page.click("#new-material")
    scene = document(editor)
    assert [shape["material"] for shape in scene["shapes"]] == ["Red paint", "Floor", "Copper", "Chalk", "Material"]
    made = scene["materials"]
    assert list(made) == ["Red paint", "Floor", "Copper", "Chalk", "Chalk 2", "Material"]
    assert made["Red paint"] != made["Copper"] != made["Chalk"]
    assert made["Chalk 2"] == made["Chalk"] and made["Material"] == {"type": "principled"}
    editor.settled()
    assert editor.text("#messages") == ""


def test_a_material_is_renamed(editor: Editor) -> None:
    page, name = editor.page, ".naming input"
    editor.settled()
    page.click("#rename-material")
    page.fill(name, "Floor")
    page.keyboard.press("Enter")
    assert editor.text(".naming .trouble") == "There already is a material named Floor."
    page.fill(name, "type")  # in patches the word means something
    page.keyboard.press("Enter")
    assert page.locator(".naming").count() == 0
    assert page.evaluate("document.activeElement.dataset.value") == "type", "the keyboard goes on there"
    page.click("#material-name", click_count=2)
    page.fill(name, "no")
    page.keyboard.press("Escape")
    editor.wait("the new name", lambda: editor.chosen("materials") == "type")
    before = editor.settled()
    page.click("#library [data-value=gold]")
    editor.wait_for_change(before)
    assert editor.text("#messages") == ""
    scene = document(editor)
    assert list(scene["materials"]) == ["Gold", "Floor"] and scene["shapes"][0]["material"] == "Gold"

    # Over there the new name came last: layers number the materials so.
    editor.tab("view")
    page.select_option("#layer", "material_id")
    editor.wait("the legend", lambda: page.is_visible("#legend"))
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    editor.wait("the first name", lambda: "Red paint" in editor.text("#legend"))
    script = (
        """([x, y]) => [...picture.getContext("2d").getImageData(x * picture.width, y * picture.height, 1, 1).data]"""
    )
    ball, floor = (page.evaluate(script, place)[:3] for place in ((0.5, 0.5), (0.5, 0.95)))
    keys = page.eval_on_selector_all(
        "#legend .key", "all => all.map((key) => [key.innerText, getComputedStyle(key.firstChild).backgroundColor])"
    )
    shown = {text: [int(x) for x in color[4:-1].split(",")] for text, color in keys}
    assert shown == {"Red paint": ball, "Floor": floor}


def test_a_material_in_use_is_deleted_for_another(editor: Editor) -> None:
    page = editor.page
    before = editor.settled()
    page.click("#delete-material")
    assert "It is on one thing." in editor.text("dialog[open]")  # waits for it
    page.keyboard.press("Escape")
    assert page.is_disabled("#undo"), "nothing was changed"
    page.click("#delete-material")
    page.click("dialog[open] .primary")
    editor.wait_for_change(before)
    assert editor.chosen("materials") == "Floor" and page.is_disabled("#delete-material")
    assert editor.text("#material-users") == "On Sphere and Quad"
    page.click("#duplicate-material")
    editor.pick("materials", "Floor 2")
    page.select_option("#thing-material", label="Floor")
    editor.tab("material")
    editor.pick("materials", "Floor 2")
    assert editor.text("#material-users") == "On nothing yet"
    page.click("#delete-material")  # nobody has to be asked
    editor.wait("its end", lambda: editor.chosen("materials") == "Floor")
    assert page.locator("dialog[open]").count() == 0
    for _ in range(4):
        page.keyboard.press("Control+z")
    editor.wait("the ball's material", lambda: not editor.differs(before, 8))
