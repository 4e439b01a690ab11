"""The room that the picture has: what stands beside it, what lies on it, and for how long."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tests.web.editor import Editor

# The parts that lie on the final frame: [left, top, right, bottom] of it is that of the line around it.
ON_THE_FRAME = """() => {
    const box = (each) => each.getBoundingClientRect();
    const frame = box(document.querySelector(".framing .final"));
    const parts = [...document.querySelectorAll(".tools, .open-tools, .pill, .axis-views svg, .hint, .comparison")];
    return parts.filter((each) => each.checkVisibility({ opacityProperty: true })).filter((each) => {
        const { left, top, right, bottom } = box(each);
        return left < frame.right - 1 && right > frame.left + 1 && top < frame.bottom - 1 && bottom > frame.top + 1;
    }).map((each) => each.className);
}"""
CUT = """() => {
    const bar = document.querySelector(".compare-row").getBoundingClientRect();
    return [...document.querySelectorAll("#comparison :is(button, select)")]
        .filter((each) => each.checkVisibility())
        .filter((each) => {
            const { left, right } = each.getBoundingClientRect();
            return left < bar.left || right > bar.right || each.scrollWidth > each.clientWidth + 1;
        }).map((each) => each.getAttribute("aria-label") ?? each.textContent);
}"""
PLACE = "(() => { const { x, y, width, height } = stage.getBoundingClientRect(); return [x, y, width, height]; })()"


@pytest.mark.parametrize(
    ("size", "touch"), [((1440, 900), False), ((900, 700), False), ((390, 844), True)], ids=["desk", "small", "phone"]
)
def test_nothing_lies_on_the_frame(visit: Callable[..., Editor], size: tuple[int, int], touch: bool) -> None:
    """Nor does a comparison move it, all of whose bar is to be seen."""
    editor = visit(size, scale=1, touch=touch)
    page = editor.page
    assert page.evaluate(ON_THE_FRAME) == []
    before = page.evaluate(PLACE)
    editor.compare()
    assert page.evaluate(PLACE) == before
    assert page.evaluate(CUT) == []
    row, stage = page.locator(".compare-row").bounding_box(), page.locator("#stage").bounding_box()
    assert row and stage and row["height"] < 0.17 * stage["height"], "one row"
    assert [each for each in page.evaluate(ON_THE_FRAME) if not each.startswith("open-tools")] == []


def test_the_tools_fade_when_the_pointer_has_left(visit: Callable[..., Editor]) -> None:
    """Not under the keyboard, nor where somebody asks for less motion."""
    editor = visit((1024, 768))
    page = editor.page
    shown = "Number(getComputedStyle(document.querySelector('#tools')).opacity)"
    assert page.evaluate(shown) == 1, "until a pointer has been there"
    stage = page.locator("#stage").bounding_box()
    assert stage
    page.mouse.move(stage["x"] + 50, stage["y"] + 150)
    page.mouse.move(stage["x"] - 20, stage["y"] + 150)
    page.wait_for_timeout(300)
    assert page.evaluate(shown) == 1, "they wait for a hand that comes back"
    editor.wait("their end", lambda: page.evaluate(shown) == 0)
    page.locator("#tools [data-tool=move]").focus()
    page.keyboard.press("ArrowRight")
    editor.wait("them under the keyboard", lambda: page.evaluate(shown) == 1)
    page.evaluate("document.activeElement.blur()")
    editor.wait("their end", lambda: page.evaluate(shown) == 0)
    for media in ({"reduced_motion": "reduce"}, {"forced_colors": "active"}):
        asked: Any = {"reduced_motion": None, "forced_colors": None} | media
        page.emulate_media(**asked)
        assert page.evaluate(shown) == 1, media


def test_on_a_phone_one_button_opens_the_tools(visit: Callable[..., Editor]) -> None:
    editor = visit((390, 844), scale=1, touch=True)
    page = editor.page
    bar = page.get_by_role("toolbar", name="Picture tools")
    opener = page.get_by_role("button", name="Tools", exact=True)
    assert bar.is_hidden() and opener.get_attribute("aria-expanded") == "false"
    opener.tap()
    for each in bar.get_by_role("button").all():
        box = each.bounding_box()
        if box is None:
            continue  # flying is done with keys
        assert min(box["width"], box["height"]) >= 38 and box["x"] + box["width"] <= 390, each.get_attribute("title")
    before = opener.inner_html()
    bar.get_by_role("button", name="Rotate").tap()
    assert bar.is_hidden() and opener.inner_html() != before, "it shows the one in the hand"
    assert page.get_attribute("#stage", "data-tool") == "rotate"
