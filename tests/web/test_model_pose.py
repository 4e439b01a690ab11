"""A model that moves and has variants: a dialog asks how it is taken."""

from __future__ import annotations

import numpy as np
import pytest

from tests.gltf_files import Gltf
from tests.web.editing import document
from tests.web.editor import Editor


@pytest.fixture(scope="module")
def model() -> bytes:
    """A square that moves by 6 along x in 2 s, and is plain or red."""
    file = Gltf()
    file.add("materials", {"name": "plain"})
    file.add("materials", {"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}})
    mappings = {"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}}
    node = file.node(name="Square", mesh=file.mesh(file.primitive(material=0, extensions=mappings)))
    file.tree["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "Red"}]}}
    file.animation("Slide", (node, "translation", "LINEAR", [0, 2], np.array([[0, 0, 0], [6, 0, 0]])))
    return file.glb()


def test_it_is_opened_in_the_pose_that_is_chosen(editor: Editor, model: bytes) -> None:
    editor.settled()
    page, before = editor.page, document(editor)
    dialog = page.get_by_role("dialog", name="Open square.glb as")
    editor.drop("#stage", {"square.glb": model})
    page.click("dialog[open] [value=add]")
    dialog.get_by_role("button", name="Cancel").click()
    editor.settled()
    assert document(editor) == before, "who thinks better of it keeps the scene"

    editor.drop("#stage", {"square.glb": model})
    page.click("dialog[open] [value=open]")
    picture = dialog.get_by_role("img")
    editor.wait("its picture", lambda: picture.evaluate("(image) => image.naturalWidth") == 320)
    assert not dialog.get_by_role("slider").is_visible(), "at rest there is no time"
    dialog.get_by_role("combobox", name="Variant").select_option("Red")
    dialog.get_by_role("combobox", name="Animation").select_option("Slide")
    time = dialog.get_by_role("slider", name="Time")
    time.fill("0.5")
    assert time.get_attribute("aria-valuetext") == "0.50 s of 2.00 s"
    dialog.get_by_role("button", name="Open").click()
    editor.wait("the model", lambda: document(editor)["shapes"][0].get("name") == "Square")
    shape, ground = document(editor)["shapes"]
    assert shape["material"] == "red" and shape["transform"]["matrix"][3] == 1.5
    assert ground["type"] == "quad", "it stands on a ground where it is now"
    assert editor.complaints == []
