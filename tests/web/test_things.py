"""Things of the scene: moved, added beside others, given materials of their own."""

from __future__ import annotations

import numpy as np

from tests import gltf_files
from tests.web.editing import document
from tests.web.editor import Editor


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
    editor.drop("#stage", {"two.glb": file.glb()})
    editor.page.click("dialog[open] [value=open]")
    editor.tab("scene")
    things = editor.page.locator("#outline-list [data-thing^='/shapes/']")
    editor.wait("the parts", lambda: "two 2" in editor.text("#outline-list"))

    things.nth(0).click()
    assert entries(editor, "translate") == [0.5, 1, 0]
    labels = "all => all.map((each) => each.getAttribute('aria-label'))"
    for name, title in {"translate": "Move", "scale": "Scale"}.items():
        said = editor.page.eval_on_selector_all(f"#thing-form [data-field={name}] input", labels)
        assert said == [f"{title}, {axis}" for axis in "XYZ"], "axes are no colours"
    assert entries(editor, "rotate") == [0, 0, 90]
    assert entries(editor, "scale") == [2, 1, 1]
    turn = editor.page.locator("#thing-form [data-field=rotate] input").nth(1)
    turn.fill("70")
    turn.press("Tab")
    focused = editor.page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert focused == "Rotate, Z", "the form stays as it is while it is filled in"

    things.nth(1).click()
    assert entries(editor, "translate") == [0, 0, -1]
    assert editor.page.locator("#thing-form [data-field=rotate]").count() == 0
    assert "skewed in its file" in editor.text("#thing-form")
    move = editor.page.locator("#thing-form [data-field=translate] input").nth(0)
    move.fill("-0.8")
    move.press("Enter")
    editor.wait("a picture", lambda: editor.page.get_attribute("#stage", "aria-busy") == "false")
    assert editor.page.locator(".message.refusal").count() == 0

    first, second = (shape["transform"] for shape in document(editor)["shapes"][:2])
    assert first == {"translate": [0.5, 1, 0], "rotate": [0, 70, 90], "scale": [2, 1, 1]}
    assert second["matrix"][3] == -0.8 and second["matrix"][11] == -1


def test_what_is_added_or_copied_stands_beside_the_others(editor: Editor) -> None:
    page = editor.page
    editor.tab("scene")
    things = page.locator("#outline-list [role=treeitem]")
    for i, thing in enumerate(("Sphere", "Box", "Quad", "Point light", "Sun")):
        page.select_option("#add", label=thing)
        editor.wait(thing, lambda count=5 + 2 * i: things.count() == count)
        page.click("#thing-acts >> text=Duplicate")
        editor.wait("the copy", lambda count=6 + 2 * i: things.count() == count)
    assert "Point light 2" in editor.text("#outline-list")
    scene = document(editor)
    balls = [shape for shape in scene["shapes"] if shape["type"] == "sphere"]
    boxes = [shape for shape in scene["shapes"] if shape["type"] == "box"]
    assert len(balls) == 3 and len(boxes) == 2
    bodies = [([x - b["radius"] for x in b["center"]], [x + b["radius"] for x in b["center"]]) for b in balls]
    bodies += [(b["min"], b["max"]) for b in boxes]
    for i, (low, high) in enumerate(bodies):
        assert abs(low[1]) < 1e-3, "on the floor"
        for other_low, other_high in bodies[:i]:
            assert not all(low[k] < other_high[k] and other_low[k] < high[k] for k in range(3))
    floors = [tuple(shape["origin"]) for shape in scene["shapes"] if shape["type"] == "quad"]
    assert len(set(floors)) == 3
    places = [str(light.get("position") or light["direction"]) for light in scene["lights"]]
    assert len(places) == len(set(places)) == 4


def model() -> bytes:
    """A square whose material has a name that the first scene has, too, with a lamp and a camera."""
    file = gltf_files.Gltf()
    pixels = np.full((4, 4, 3), (0, 200, 0), np.uint8)
    texture = {"baseColorTexture": {"index": file.texture(pixels)}}
    file.of({"name": "Red paint", "pbrMetallicRoughness": texture})
    lamp = {"type": "point", "color": [1, 1, 1], "intensity": 10}
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": [lamp]}}
    file.tree["extensionsUsed"] = ["KHR_lights_punctual"]
    file.node(extensions={"KHR_lights_punctual": {"light": 0}}, translation=[0, 5, 0])
    camera = {"type": "perspective", "perspective": {"aspectRatio": 1.5, "yfov": 0.7, "znear": 0.1}}
    file.node(camera=file.add("cameras", camera), translation=[0, 0, 5])
    return file.glb()


def test_a_model_is_added_or_opened(editor: Editor) -> None:
    page, things = editor.page, editor.page.locator("#outline-list [data-thing^='/shapes/']")
    editor.tab("scene")
    editor.drop("#stage", {"sail.glb": model()})
    page.wait_for_selector("dialog[open]")
    page.keyboard.press("Escape")
    editor.wait("the end of the question", lambda: page.locator("dialog[open]").count() == 0)
    assert things.count() == 2 and page.is_disabled("#undo"), "nothing was done"

    editor.drop("#stage", {"sail.glb": model()})
    page.click("dialog[open] [value=add]")
    editor.wait("the square", lambda: things.count() == 3)
    said = page.text_content("#messages") or ""
    assert "Its light was left out" in said and "sky" not in said, "that concerns who opens it"
    before = document(editor)
    assert list(before["materials"]) == ["Red paint", "Floor", "Red paint 2"]
    assert before["shapes"][2]["material"] == "Red paint 2" and "lights" not in before
    low = before["shapes"][2]["transform"]["translate"]
    assert low[0] > 1.9, "beside the ball"
    editor.wait("a picture", lambda: page.get_attribute("#stage", "aria-busy") == "false")
    assert page.locator(".message.refusal").count() == 0
    page.keyboard.press("Control+z")
    assert page.is_disabled("#undo") and "textures" not in document(editor), "one step of undo"

    editor.tab("scene")
    with page.expect_file_chooser() as asked:
        editor.tab("save")
        page.click("#open-file")
    asked.value.set_files({"name": "sail.glb", "mimeType": "model/gltf-binary", "buffer": model()})
    editor.wait("the model on a ground, and nothing else", lambda: things.count() == 2)
    names = "the stage's name"
    editor.wait(names, lambda: document(editor)["shapes"][1].get("name") == "Stage")
    editor.wait("what is said of it", lambda: "sky" in (page.text_content("#messages") or ""))
    assert "wide" not in (page.text_content("#messages") or ""), "the picture is as wide as the window in any case"
    with page.expect_file_chooser() as asked:
        editor.tab("save")
        page.click("#add-file")
    asked.value.set_files({"name": "sail.glb", "mimeType": "model/gltf-binary", "buffer": model()})
    editor.wait("another one", lambda: things.count() == 3)
