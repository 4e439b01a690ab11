"""Images of one set, zipped or several at once, that are dropped on a thing make its material."""

from __future__ import annotations

import numpy as np
import pytest

from tests.asset_files import png
from tests.mtlx_files import from_graph, graph, mtlx, node, surface, value
from tests.obj_files import zipped
from tests.web.editing import document, overlay
from tests.web.editor import Editor

GREEN = np.full((8, 8, 3), (0, 200, 0), np.uint8)
GREY = np.full((8, 8, 1), 90, np.uint8)
FLAT = np.full((8, 8, 3), (128, 128, 255), np.uint8)
SET = {
    "Moss_2K_Color.png": GREEN,
    "Moss_2K_Roughness.png": GREY,
    "Moss_2K_NormalDX.png": FLAT,
    "Moss_2K_AO.png": GREY,
}


def is_green(editor: Editor) -> bool:
    height, width = overlay(editor, "picture").shape[:2]
    r, g, _, _ = overlay(editor, "picture")[height // 2, width // 2]
    return bool(g > 1.5 * r)


def test_a_zipped_set_is_the_material_of_what_it_falls_on(editor: Editor) -> None:
    before = editor.settled()
    scene = document(editor)
    editor.drop("#stage", {"moss.zip": zipped({name: png(texels) for name, texels in SET.items()})})
    editor.wait("what went where", lambda: editor.text("#messages strong") == "Moss: 3 images, AO left out")
    editor.page.click("#messages summary")
    said = editor.text("#messages")
    assert "Base colour: Moss_2K_Color" in said and "Roughness: Moss_2K_Roughness" in said
    assert "Moss_2K_AO.png" in said, "what is left out is listed"
    editor.wait("a green ball", lambda: is_green(editor))
    made = document(editor)
    material = made["materials"][made["shapes"][0]["material"]]
    assert set(material) == {"type", "base_color", "roughness", "normal_map"}
    assert len(made["textures"]) == 3
    editor.page.keyboard.press("Control+z")
    editor.wait("all as before", lambda: not editor.differs(before, 8))
    assert document(editor) == scene, "one undo takes all of it back"


def test_several_images_are_a_set_by_their_names(editor: Editor) -> None:
    editor.settled()
    files = {name: png(texels) for name, texels in SET.items()}
    editor.drop("#stage", files)
    editor.wait("what went where", lambda: editor.text("#messages").startswith("Moss: 3 images, AO left out"))
    editor.wait("a green ball", lambda: is_green(editor))
    count = len(document(editor)["materials"])
    editor.drop("#stage", {"one.png": png(GREY), "two.png": png(GREEN // 2)})  # no set: each is a base colour
    editor.wait("the last of them", lambda: "two" in editor.text("[data-field=base_color] .texture"))
    assert len(document(editor)["materials"]) == count
    (refused,) = editor.complaints  # the browser's own line on the server's answer that they are no set
    assert "422" in refused
    editor.complaints.clear()


def test_materialx_makes_the_material_with_the_images_that_come_with_it(editor: Editor) -> None:
    pytest.importorskip("MaterialX")
    editor.settled()
    image = node("image", "img", "color3", value("file", "maps/moss.png", "filename", colorspace="srgb_texture"))
    made = mtlx(graph(image, out="img color3"), surface("gltf_pbr", from_graph("base_color", "out"), name="Moss"))
    editor.drop("#stage", {"moss.mtlx": made, "moss.png": png(GREEN)})
    editor.wait("what went where", lambda: editor.text("#messages").startswith("Moss: 1 image"))
    editor.wait("a green ball", lambda: is_green(editor))
    plain = mtlx(surface("gltf_pbr", value("base_color", [0.5, 0.5, 0.5]), value("occlusion", 0.5), name="Grey"))
    editor.drop("#stage", {"grey.mtlx": plain})
    editor.wait("the other", lambda: editor.text("#messages").startswith("Grey: no images"))
    assert "SGrey/occlusion" in editor.text("#messages"), "what is lost is listed"


def test_two_sets_in_a_zip_are_two_materials(editor: Editor) -> None:
    editor.settled()
    both = {"Moss_Color.png": png(GREEN), "Ash_Color.png": png(GREY), "Ash_Roughness.png": png(GREY)}
    editor.drop("#stage", {"two.zip": zipped(both)})
    editor.wait("what went where", lambda: editor.text("#messages").startswith("2 materials: 3 images"))
    names = editor.page.locator("#materials [role=option]").all_text_contents()
    assert "Moss" in names and "Ash, Roughness: Ash_Roughness" in (editor.page.text_content("#messages") or "")
