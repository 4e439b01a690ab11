"""Models that bring lights of their own: seen at an exposure that suits them, and under the studio on request."""

from __future__ import annotations

import json

from tests.gltf_lights import BLENDER_LAMP, start_up
from tests.web.conftest import Editor


def test_a_model_lit_by_blender(editor: Editor) -> None:
    editor.settled()
    editor.drop("#stage", {"lit.glb": start_up(BLENDER_LAMP).glb()})
    editor.page.click("dialog[open] [value=open]")
    editor.wait("what there is to know", lambda: "lit.glb: good to know" in editor.text("#messages"))
    assert "exposure is -10 stops now" in editor.text("#messages") and "no sky" in editor.text("#messages")
    editor.tab("render")
    exposure = editor.page.locator(editor.field("exposure", "number"))
    assert exposure.input_value() == "-10"
    before = editor.settled()
    assert 60 < max(before) < 235, "neither black nor white"

    editor.page.click("text=Add the studio")
    editor.wait_for_change(before)
    assert editor.text("#messages") == "" and 60 < max(editor.settled()) < 250
    editor.tab("keep")
    scene = json.loads(editor.shot("text=Scene as JSON"))
    assert scene["environment"]["scale"] == 2**10 and scene["lights"][0]["intensity"][0] > 54_000

    # The exposure was that model's: another scene is seen as ever.
    editor.tab("scene")
    editor.page.select_option("#scene", "cornell-boxes")
    editor.tab("render")
    editor.wait("the exposure of before", lambda: exposure.input_value() == "0")


def test_an_exposure_of_ones_own_stays(editor: Editor) -> None:
    editor.settled()
    editor.drop("#stage", {"lit.glb": start_up(BLENDER_LAMP).glb()})
    editor.page.click("dialog[open] [value=open]")
    editor.tab("render")
    exposure = editor.page.locator(editor.field("exposure", "number"))
    editor.wait("the exposure of the model", lambda: exposure.input_value() == "-10")
    exposure.fill("-9")
    exposure.press("Enter")
    editor.tab("scene")
    editor.page.select_option("#scene", "cornell-boxes")
    editor.wait("the scene", lambda: editor.page.input_value("#scene") == "cornell-boxes")
    editor.tab("render")
    assert exposure.input_value() == "-9"
