"""An OBJ with its materials and images, as a zip that is dropped on the page."""

from __future__ import annotations

import json

from tests.asset_files import png
from tests.obj_files import GREY, TEXTURED, zipped
from tests.web.editing import document
from tests.web.editor import Editor

STL = (
    "solid b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
)
TWO = TEXTURED + "usemtl shiny\nv 0 0 1\nf 1/1 2/2 5/3\n"
MATERIALS = (
    "newmtl m\nKd 1 1 1\nmap_Kd maps/grey.png\nnewmtl shiny\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 200\nillum 9\n"
)


def test_a_zip_becomes_a_scene_with_its_materials(editor: Editor) -> None:
    before = editor.settled()
    packed = zipped({"model/quad.obj": TWO, "model/m.mtl": MATERIALS, "model/maps/grey.png": png(GREY)})
    editor.drop("#stage", {"quad.zip": packed})
    editor.page.click("dialog[open] [value=open]")
    editor.wait_for_change(before)
    shown = editor.settled()
    scene = json.loads(editor.shot("#download-scene"))
    assert [shape["type"] for shape in scene["shapes"]] == ["mesh", "mesh", "quad"], "on a ground"
    made = {shape["material"]: scene["materials"][shape["material"]] for shape in scene["shapes"][:2]}
    assert set(made) == {"m", "shiny"}
    assert made["shiny"]["base_color"] == [0.8, 0.1, 0.1]
    assert scene["textures"][made["m"]["albedo"]["texture"]]["asset"].startswith("sha256:")
    editor.tab("material")
    assert {"m", "shiny"} <= set(editor.page.locator("#materials [role=option]").all_text_contents())
    assert editor.complaints == []

    editor.drop("#stage", {"nothing.zip": zipped({"readme.txt": "hello"})})
    editor.wait("the refusal", lambda: "nothing.zip could not be used" in editor.text("#messages"))
    assert not editor.differs(shown, 8), "without a model it changes nothing"


def test_of_several_models_in_a_zip_one_is_chosen(editor: Editor) -> None:
    editor.settled()
    count = len(document(editor)["shapes"])
    packed = zipped({"kit/a.obj": TWO, "kit/parts/b.stl": STL.encode(), "kit/m.mtl": MATERIALS})
    dialog = editor.page.locator("dialog[open]")
    models = dialog.get_by_label("Model", exact=True)
    for action, names in (("Cancel", []), ("Take it", ["b"])):
        editor.drop("#stage", {"two.zip": packed})
        models.wait_for()
        assert dialog.locator("h2").inner_text() == "two.zip holds 2 models"
        assert models.locator("option").all_text_contents() == ["a.obj", "parts/b.stl"]
        models.select_option("kit/parts/b.stl")
        dialog.get_by_role("button", name=action).click()
        editor.wait("what came", lambda names=names: [s["name"] for s in document(editor)["shapes"][count:]] == names)
    (*refused,) = editor.complaints  # the browser's own lines on the answers that there are several
    assert all("422" in each for each in refused) and len(refused) == 2
    editor.complaints.clear()
