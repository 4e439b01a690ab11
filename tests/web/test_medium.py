"""What fills bodies and all space, in the inspector."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import Page

from gpu.tables import half_space
from service.document.medium import Medium
from service.pack.geometry.shape_records import scattering
from tests.web.editing import document
from tests.web.editor import Editor
from tests.web.modules import call

SCENE = {"shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 2, "material": "m"}]}
FORM = "#medium-part [data-field={}]"


def looks_again(editor: Editor, before: list[float]) -> None:
    """Wait until the picture is as before: what scatters stays noisy for a while."""
    editor.settled()
    editor.wait("the picture of before", lambda: not editor.differs(before, 6))


def test_a_body_is_filled_and_emptied(editor: Editor) -> None:
    page = editor.page
    before = editor.settled()
    editor.pick("library", "water")
    editor.wait_for_change(before)
    clear = editor.settled_alone()
    editor.tab("scene")
    page.click("#outline-list [data-thing='/shapes/0']")
    page.hover("#thing-title")
    kind = page.get_by_label("Medium", exact=True)
    editor.wait("what fills it", kind.is_visible)
    assert kind.input_value() == "none" and "surface that transmits" in editor.text("#medium-part")

    kind.select_option("look")
    editor.wait_for_change(clear)
    cloudy = editor.settled_alone()
    found = document(editor)["shapes"][0]["medium"]
    assert set(found) == {"albedo", "radius"} and found["radius"][0] > 0
    shown = page.locator("#medium-part [data-field]").evaluate_all("all => all.map((each) => each.dataset.field)")
    assert shown == ["albedo", "radius", "g", "emission"]
    assert page.locator(FORM.format("albedo") + " .reset").is_hidden(), "the one is not without the other"

    kind.select_option("coefficients")
    looks_again(editor, cloudy)  # by either description
    given = document(editor)["shapes"][0]["medium"]
    total = np.add(given["absorption"], given["scattering"])
    assert total == pytest.approx(1 / np.array(found["radius"]), rel=0.01)
    assert editor.text("#messages") == ""

    page.locator(FORM.format("g") + " input.number").fill("2")
    page.keyboard.press("Enter")
    editor.wait("what is wrong", lambda: "below 1" in editor.text("#medium-part .trouble:not([hidden])"))
    page.keyboard.press("Escape")
    kind.select_option("none")
    looks_again(editor, clear)
    assert "medium" not in document(editor)["shapes"][0] and page.locator("#medium-part [data-field]").count() == 0
    page.keyboard.press("Control+z")
    editor.wait("the medium again", lambda: kind.input_value() == "coefficients")


def test_space_is_filled_and_panels_are_not(editor: Editor) -> None:
    page = editor.page
    before = editor.settled()
    editor.tab("scene")
    page.click("#outline-list [data-thing='/environment']")
    kind = page.get_by_label("Medium", exact=True)
    editor.wait("what fills all space", kind.is_visible)
    kind.select_option("look")
    editor.wait_for_change(before)
    assert document(editor)["environment"]["medium"]["radius"][0] > 0
    page.click("#outline-list [data-thing='/camera']")
    assert kind.is_hidden()


def test_the_colour_of_much_is_the_server_s(page: Page) -> None:
    for color in (0.0, 0.01, 0.3, 0.8, 0.999, 1.0):
        found = call(page, "document/medium.js", "rootOf", color)
        assert found == pytest.approx(float(half_space.root(np.array(color))), abs=1e-12)


def test_both_descriptions_agree_with_the_server(page: Page) -> None:
    for g in (-0.5, 0.0, 0.7):
        look = {"albedo": [0.9, 0.5, 0.1], "radius": [0.5, 0.25, 2.0], "g": g}
        turned = call(page, "document/medium.js", "turned", look, "coefficients", SCENE, None)
        medium = Medium.model_validate(look)
        extinction = medium.extinction()
        assert np.add(turned["absorption"], turned["scattering"]) == pytest.approx(np.array(extinction), rel=0.01)
        shares = np.divide(turned["scattering"], extinction)
        assert shares == pytest.approx(np.divide(scattering(medium), extinction), abs=0.005)
        back = call(page, "document/medium.js", "turned", turned, "look", SCENE, None)
        assert back["albedo"] == pytest.approx(look["albedo"], abs=0.003)
        assert back["radius"] == pytest.approx(look["radius"], rel=0.01)
    clear = call(page, "document/medium.js", "turned", {"absorption": [1, 0, 0]}, "look", SCENE, None)
    Medium.model_validate(clear)
    assert clear["albedo"] == [0, 0, 0] and clear["radius"] == [1, 1000, 1000]
    new = call(page, "document/medium.js", "turned", None, "look", SCENE, SCENE["shapes"][0])
    assert new["radius"] == [1, 1, 1], "a quarter of the ball's 4 metres"
    assert call(page, "document/medium.js", "turned", new, "none", SCENE, None) == "undefined"
