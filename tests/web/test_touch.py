"""Fingers on the panel of a phone."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.web.editor import Editor

Swipe = Callable[[str, float, float], None]


@pytest.fixture
def phone(visit: Callable[..., Editor]) -> tuple[Editor, Swipe]:
    """The editor on a phone, and swipe(selector, right, down): a finger that begins near the right end of a thing."""
    editor = visit((390, 844), scale=1, touch=True)
    session = editor.page.context.new_cdp_session(editor.page)

    def swipe(selector: str, right: float, down: float) -> None:
        box = editor.page.locator(selector).bounding_box()
        assert box is not None
        x, y = box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2
        for step in range(11):
            at = {"x": x + right * step / 10, "y": y + down * step / 10, "id": 0}
            kind = "touchMove" if step else "touchStart"
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [at]})
            editor.page.wait_for_timeout(16)
        session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        editor.page.wait_for_timeout(200)

    return editor, swipe


def test_a_finger_that_scrolls_the_panel_moves_no_slider(phone: tuple[Editor, Swipe]) -> None:
    editor, swipe = phone
    page, slider = editor.page, editor.field("roughness")
    page.locator(slider).scroll_into_view_if_needed()
    before, at = page.input_value(slider), page.evaluate("document.querySelector('#page-properties').scrollTop")
    swipe(slider, 3, -100)
    assert page.evaluate("document.querySelector('#page-properties').scrollTop") > at + 50, "the panel scrolled"
    swipe(slider, 0, 60)
    assert page.input_value(slider) == before
    assert page.is_disabled("#undo"), "nothing was changed"

    page.locator(slider).scroll_into_view_if_needed()
    page.wait_for_timeout(200)  # until the panel rests
    swipe(slider, -40, 2)
    moved = float(page.input_value(slider))
    assert float(before) - 0.4 < moved < float(before), "by as much as the finger went, not to where it is"
    box = page.locator(slider).bounding_box()
    assert box is not None
    page.touchscreen.tap(box["x"] + 0.7 * box["width"], box["y"] + box["height"] / 2)
    editor.wait("a tap", lambda: abs(float(page.input_value(slider)) - 0.7) < 0.02)
    page.tap("#undo")
    assert float(page.input_value(slider)) == moved, "a slide is one step of undo"
    page.tap("#undo")
    assert page.input_value(slider) == before


def test_a_finger_pulls_a_material_onto_a_thing(phone: tuple[Editor, Swipe]) -> None:
    editor, swipe = phone
    page = editor.page
    ball = "#materials [data-value='Red paint']"
    editor.settled()
    second = page.locator("#library [role=option]:nth-child(2)")
    before = second.bounding_box()
    swipe("#library [role=option]:nth-child(2)", -100, 2)
    after = second.bounding_box()
    assert before and after and after["x"] < before["x"] - 50, "sideways the row scrolls"
    assert page.is_disabled("#undo")
    page.locator(ball).scroll_into_view_if_needed()
    stage, tile = page.locator("#stage").bounding_box(), page.locator(ball).bounding_box()
    assert stage and tile
    floor = stage["y"] + 0.75 * stage["height"] - tile["y"] - tile["height"] / 2

    def is_taken() -> bool:
        swipe(ball, stage["x"] + 8 - tile["x"] - 0.8 * tile["width"], floor)
        page.wait_for_timeout(500)
        return editor.text("#material-users") == "On Quad and Sphere"

    editor.wait("the floor to take it", is_taken)
    assert page.locator(".pulled").count() == 0
