"""What is written can be read: values in their boxes, words in narrow bars; and an unset slider shows what holds."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from tests.web.editor import Editor

DESK, PHONE = (1440, 900, False), (390, 844, True)
SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {
        "position": [2.417, 1.553, 15.53], "target": [-2.417, 0.625, -1.234], "vfov": 49.56,
        "aperture_radius": 0.3125, "focus_distance": 15.53,
    },
    "environment": {"type": "constant", "radiance": [0.2, 0.5, 0.8]},
    "materials": {"ball": {"type": "principled", "base_color": "#ca4b36", "roughness": 0.5312}},
    "shapes": [
        {
            "type": "box", "min": [-2.417, -1.553, -0.625], "max": [2.417, 1.553, 0.625], "material": "ball",
            "transform": {"rotate": [49.56, -115.5, 12.34], "translate": [-15.53, 2.417, -49.56]},
        },
    ],
}  # fmt: skip
PASTE = "(text) => { navigator.clipboard.readText = async () => text; }"
CUT = """() => [...document.querySelectorAll("input.entry")]
    .filter((each) => each.checkVisibility() && each.scrollWidth > each.clientWidth)
    .map((each) => `${each.getAttribute("aria-label") ?? each.id}: ${each.value}`)"""

# Words in empty boxes and in menus, by the widths of their letters; without a colour a sign stands there.
UNREAD = """() => {
    const pen = new OffscreenCanvas(1, 1).getContext("2d");
    const wide = (each, text) => {
        const { font } = getComputedStyle(each);
        pen.font = font;
        return pen.measureText(text).width;
    };
    return [...document.querySelectorAll("input[placeholder], select")].filter((each) => each.checkVisibility())
        .map((each) => {
            const { paddingLeft, paddingRight } = getComputedStyle(each);
            const isMenu = each.matches("select");
            const arrow = isMenu ? 14 : 0;
            const room = each.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight) - arrow;
            const text = isMenu ? each.selectedOptions[0]?.text ?? "" : each.value ? "" : each.placeholder;
            const { color } = getComputedStyle(each, isMenu ? null : "::placeholder");
            return [color === "rgba(0, 0, 0, 0)" || wide(each, text) <= room + 1, text];
        }).filter(([fits]) => !fits).map(([, text]) => text);
}"""


@pytest.fixture
def at(visit: Callable[..., Editor], request: pytest.FixtureRequest) -> Editor:
    """The editor in a window of the size that a test names."""
    width, height, touch = request.param
    return visit((width, height), scale=1, touch=touch)


def paste(editor: Editor, document: dict[str, Any]) -> None:
    editor.page.evaluate(PASTE, json.dumps(document))
    editor.act("paste-material")


@pytest.mark.parametrize(("at", "others"), [(DESK, [(1024, 768)]), (PHONE, [])], indirect=["at"])
def test_values_fit_into_their_boxes(at: Editor, others: list[tuple[int, int]]) -> None:
    page = at.page
    paste(at, SCENE)
    hexes = f"{at.field('base_color', 'text')}"
    at.wait("the scene", lambda: page.input_value(hexes) == "#ca4b36")
    for size in (None, *others):
        if size is not None:
            page.set_viewport_size({"width": size[0], "height": size[1]})
        assert page.evaluate(CUT) == [], size
        shown: set[str] = set()
        for thing in page.locator("#outline-list [role=treeitem]").all():
            at.tab("scene")
            thing.click()
            assert page.evaluate(CUT) == [], (size, thing.text_content())
            values = "[...document.querySelectorAll('#thing-form input.entry')].map((e) => e.value)"
            shown |= set(page.evaluate(values))
        assert {"2.417", "49.56", "15.53", "-49.56", "-115.5"} <= shown


@pytest.mark.parametrize(
    ("at", "others"), [((1440, 900, False), [(1024, 768)]), ((390, 844, True), [(844, 390)])], indirect=["at"]
)
def test_words_in_boxes_and_menus_are_whole(at: Editor, others: list[tuple[int, int]]) -> None:
    page = at.page
    for size in (None, *others):
        if size is not None:
            page.set_viewport_size({"width": size[0], "height": size[1]})
        at.tab("material")
        at.unfold()
        assert page.evaluate(UNREAD) == [], size
        for tab in ("render", "film"):
            at.tab(tab)
            assert page.evaluate(UNREAD) == [], (size, tab)


@pytest.mark.parametrize("at", [DESK], indirect=True)
def test_an_unset_slider_stands_where_the_value_is_that_holds(at: Editor) -> None:
    """And rows without an image keep the columns."""
    page = at.page
    paste(at, {"type": "principled", "base_color": 0.5})
    at.unfold()
    slider, box = at.field("ior"), at.field("ior", "number")
    at.wait("the material", lambda: page.input_value(slider) == "1.5")
    edges = """() => ["emission_sides", "alpha"].map((name) =>
        document.querySelector(`[data-field=${name}] :is(select, .slider)`).getBoundingClientRect().left)"""
    sides, alpha = page.evaluate(edges)
    assert abs(sides - alpha) < 1
    assert page.input_value(box) == "" and page.get_attribute(box, "placeholder") == "1.5"
    assert page.get_attribute(slider, "aria-valuetext") == "not set, 1.5"
    ghost = "(range) => range.classList.contains('ghost')"
    assert page.eval_on_selector(slider, ghost)
    page.fill(box, "1.7")
    page.press(box, "Enter")
    at.wait("a value of its own", lambda: not page.eval_on_selector(slider, ghost))
    assert page.input_value(slider) == "1.7"


@pytest.mark.parametrize(
    ("at", "others"), [((320, 640, False), []), ((320, 640, True), [(380, 800), (390, 844)])], indirect=["at"]
)
def test_narrow_bars_clip_no_word(at: Editor, others: list[tuple[int, int]]) -> None:
    page = at.page
    # With the longest words, and with a preview or without one: a frame may bring others at any time.
    past = """(isPreview) => {
        const words = { samples: "256 / 256", noise: "0.29 % noise", left: "13 min left", state: "Converging" };
        for (const [id, text] of Object.entries(words)) document.getElementById(id).textContent = text;
        for (const id of ["noise", "left"]) document.getElementById(id).hidden = false;
        const shown = document.getElementById("preview");
        shown.hidden = !isPreview;
        shown.textContent = "1/16 size";
        return ["top", "pill", "picture-state"].map((name) => document.querySelector(`.${name}`))
            .filter((each) => each.scrollWidth > each.clientWidth).map((each) => each.className);
    }"""
    page.click("#pause")
    at.wait("a pause", lambda: at.text("#state") == "Paused")
    for size in (None, *others):
        if size is not None:
            page.set_viewport_size({"width": size[0], "height": size[1]})
        for is_preview in (True, False):
            assert page.evaluate(past, is_preview) == [], f"a preview: {is_preview}, in {size or 'the first size'}"
    page.click("#pause")
    page.click("#compare")
    label = ".variant.b"
    at.wait("a label", lambda: any(letter.isdigit() for letter in at.text(label)))
    if others:  # the last of them is a usual phone
        for side in ("a", "b"):
            assert (
                page.evaluate(f"(e => e.scrollWidth - e.clientWidth)(document.querySelector('.variant.{side}'))") <= 0
            )


@pytest.mark.parametrize("at", [PHONE], indirect=True)
def test_a_phone_gives_its_picture_room_and_lists_gestures_first(at: Editor) -> None:
    """And a message hides neither the field in hand nor the button of the tools."""
    page = at.page
    box = at.field("roughness", "number")
    page.evaluate("(place) => document.querySelector(place).scrollIntoView({ block: 'end' })", box)
    page.focus(box)
    page.evaluate("""async () => {
        const { Messages } = await import(new URL("panels/messages.js", location));
        new Messages(document.getElementById("messages"), () => [])
            .show("import", { title: "duck.glb: not all of it was taken." });
    }""")
    (shown, opener, field) = (page.locator(each).bounding_box() for each in ("#messages", "#open-tools", box))
    assert field and shown and opener
    assert opener["y"] + opener["height"] <= shown["y"] and shown["y"] + shown["height"] <= field["y"]
    page.evaluate("document.getElementById('messages').replaceChildren()")
    page.evaluate("document.activeElement.blur()")

    page.tap("#compare")
    at.wait("the bar", lambda: page.is_visible("#comparison"))
    stage, bar, way_out = (
        page.locator(each).bounding_box() for each in ("#stage", "#comparison", "#comparison .close")
    )
    assert stage and bar and way_out
    assert bar["height"] < 0.17 * stage["height"]
    assert way_out["x"] + way_out["width"] <= 390, "the way out is in sight"
    page.tap("#scene-menu")
    page.get_by_role("button", name="Keys and gestures").tap()
    at.wait("the sheet", lambda: page.is_visible("#keys h3"))
    assert page.locator("#keys h3").first.inner_text() == "Fingers on the picture"
