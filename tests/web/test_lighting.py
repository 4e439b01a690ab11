"""Models that bring lights of their own: seen at an exposure that suits them, and under the studio on request."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests import gltf_files
from tests.gltf_lights import BLENDER_LAMP, start_up
from tests.web.editor import Editor


@pytest.mark.slow
def test_a_model_lit_by_blender(editor: Editor) -> None:
    editor.settled()
    editor.drop("#stage", {"lit.glb": start_up(BLENDER_LAMP).glb()})
    editor.page.click("dialog[open] [value=open]")
    editor.wait("what there is to know", lambda: "lit.glb: good to know" in editor.text("#messages"))
    editor.page.click("#messages summary")  # it stays while that is open
    assert "exposure was set to -10 stops" in editor.text("#messages") and "no sky" in editor.text("#messages")
    editor.tab("film")
    exposure = editor.page.locator(editor.field("exposure", "number"))
    assert exposure.input_value() == "-10"
    before = editor.settled()
    assert 60 < max(before) < 235, "neither black nor white"

    editor.page.click("text=Add the studio")
    editor.wait_for_change(before)
    assert editor.text("#messages") == "" and 60 < max(editor.settled()) < 250
    scene = json.loads(editor.shot("#download-scene"))
    assert scene["environment"]["scale"] == 2**10 and scene["lights"][0]["intensity"][0] > 54_000

    # The exposure was that model's: another scene is seen as ever.
    editor.pick("scenes", "cornell-boxes")
    editor.wait("the exposure of before", lambda: exposure.input_value() == "0")


def test_an_exposure_of_ones_own_stays(editor: Editor) -> None:
    editor.settled()
    editor.drop("#stage", {"lit.glb": start_up(BLENDER_LAMP).glb()})
    editor.page.click("dialog[open] [value=open]")
    exposure = editor.page.locator(editor.field("exposure", "number"))
    editor.wait("the exposure of the model", lambda: exposure.input_value() == "-10")
    editor.tab("film")
    exposure.fill("-9")
    exposure.press("Enter")
    editor.pick("scenes", "cornell-boxes")
    editor.wait("the scene", lambda: editor.chosen("scenes") == "cornell-boxes")
    editor.tab("render")
    assert exposure.input_value() == "-9"


def test_what_is_said_of_a_file_is_in_words(editor: Editor) -> None:
    """A client of the interface has the places as JSON pointers; here they are words, or left out."""
    file = start_up(BLENDER_LAMP)
    file.tree["animations"] = [{"channels": [], "samplers": []}]
    file.tree["materials"] = [{}, {"occlusionTexture": {"index": file.texture(np.full((2, 2, 3), 200, np.uint8))}}]
    file.tree["meshes"][0]["primitives"][0]["material"] = 1
    editor.drop("#stage", {"lit.glb": file.glb()})
    editor.page.click("dialog[open] [value=open]")
    editor.wait("what there is to know", lambda: "lit.glb: good to know" in editor.text("#messages"))
    said = editor.page.locator("#messages li").all_text_contents()
    assert any(line.startswith("The animation is left out: it ") for line in said), said
    assert "Material 2: ambient occlusion is left out: the light that reaches a corner is traced" in said, said
    assert all(line[0].isupper() for line in said), said

    plain = gltf_files.Gltf()
    plain.node(mesh=plain.mesh())
    plain.tree["animations"] = [{"channels": [], "samplers": []}]
    editor.drop("#stage", {"plain.glb": plain.glb()})
    editor.page.click("dialog[open] [value=open]")
    editor.wait("what there is to know", lambda: "plain.glb: good to know" in editor.text("#messages"))
    assert editor.page.locator("#messages button").count() == 1, "nothing to do about it but to close it"
    assert "false" not in editor.text("#messages")

    file.tree["nodes"][0]["mesh"] = 7
    editor.drop("#stage", {"bad.glb": file.glb()})
    editor.wait("the refusal", lambda: "bad.glb could not be used" in editor.text("#messages"))
    refusal = editor.page.inner_text("#messages .refusal")
    assert "Node 1, mesh refers to " in refusal, refusal
