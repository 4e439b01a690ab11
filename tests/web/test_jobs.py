"""Jobs as an artist does them, by mouse, by keys alone and by touch: how many actions each of them takes.

An action is one deliberate thing: a press, a drag, a value written, a file chosen. The stops of the Tab key on the
way to where it is done are bounded by themselves.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Protocol

import numpy as np
import pytest
from PIL import Image

from tests.web.editing import document
from tests.web.editor import Editor

MOST_STOPS = 60  # of the Tab key, to the next thing of a job
IS_BEFORE = """(selector) => {
    const place = document.activeElement.compareDocumentPosition(document.querySelector(selector));
    return (place & Node.DOCUMENT_POSITION_PRECEDING) !== 0;
}"""
# The buttons of a toolbar, and the items of a menu, are one stop, among which arrows move.
IS_BESIDE = """(selector) => {
    const bar = document.activeElement.closest("[role=toolbar], [role=menu]");
    return bar !== null && bar.contains(document.querySelector(selector));
}"""
FOCUSED = "(selector) => document.activeElement.matches(selector)"


def image(red: int, green: int, blue: int) -> bytes:
    out = io.BytesIO()
    Image.fromarray(np.full((8, 8, 3), (red, green, blue), np.uint8)).save(out, "PNG")
    return out.getvalue()


MAPS = {"base_color": (200, 150, 40), "roughness": (120, 120, 120), "normal_map": (128, 128, 255)}


class Hand(Protocol):
    editor: Editor
    actions: int

    def press(self, selector: str) -> None: ...
    def write(self, selector: str, text: str) -> None: ...
    def select(self, selector: str, label: str) -> None: ...
    def take(self, field: str, name: str, content: bytes) -> None: ...
    def pick(self, shelf: str, title: str) -> None: ...
    def open_drawer(self, name: str) -> None: ...
    def add(self, label: str) -> None: ...


class Mouse:
    def __init__(self, editor: Editor) -> None:
        self.editor, self.actions = editor, 0

    def press(self, selector: str) -> None:
        self.editor.page.click(selector)
        self.actions += 1

    def write(self, selector: str, text: str) -> None:
        self.editor.page.fill(selector, text)
        self.editor.page.keyboard.press("Enter")
        self.actions += 1

    def select(self, selector: str, label: str) -> None:
        self.editor.page.select_option(selector, label=label)
        self.actions += 1

    def add(self, label: str) -> None:
        self.select("#add", label)

    def take(self, field: str, name: str, content: bytes) -> None:
        """A file that is let go over its field."""
        self.editor.drop(field, {name: content})
        self.actions += 1

    def pick(self, shelf: str, title: str) -> None:
        self.press(f"#{shelf} [role=option][aria-label='{title}']")

    def open_drawer(self, name: str) -> None:
        self.press(f"#tab-{name}")


class Keys:
    def __init__(self, editor: Editor) -> None:
        self.editor, self.actions = editor, 0

    def reach(self, selector: str) -> None:
        page = self.editor.page
        key = "Shift+Tab" if page.evaluate(IS_BEFORE, selector) else "Tab"
        for _ in range(MOST_STOPS):
            if page.evaluate(FOCUSED, selector):
                return
            page.keyboard.press("ArrowDown" if page.evaluate(IS_BESIDE, selector) else key)
        pytest.fail(f"{selector} is more than {MOST_STOPS} stops away from the last thing")

    def press(self, selector: str) -> None:
        self.reach(selector)
        self.editor.page.keyboard.press("Enter")
        self.editor.page.wait_for_timeout(200)  # a menu takes the focus once it is open
        self.actions += 1

    def write(self, selector: str, text: str) -> None:
        self.reach(selector)
        self.editor.page.keyboard.press("Control+a")
        self.editor.page.keyboard.type(text)
        self.editor.page.keyboard.press("Enter")
        self.actions += 1

    def select(self, selector: str, label: str) -> None:
        self.reach(selector)
        self.editor.page.keyboard.type(label.split()[0])
        self.actions += 1

    def add(self, label: str) -> None:
        self.reach("#add")
        self.editor.page.keyboard.type(label.split()[0])  # chooses, and adds nothing yet
        self.editor.page.keyboard.press("Enter")
        self.actions += 1

    def take(self, field: str, name: str, content: bytes) -> None:
        """By the dialog of the field, which has one for files."""
        self.press(f"{field} :is(.image, .choose)")
        self.editor.page.wait_for_selector("dialog[open] button[value=browse]")
        with self.editor.page.expect_file_chooser() as waiting:
            self.press("dialog[open] button[value=browse]")
        waiting.value.set_files([{"name": name, "mimeType": "image/png", "buffer": content}])
        self.actions += 1

    def pick(self, shelf: str, title: str) -> None:
        self.reach(f"#{shelf} [role=option]")
        self.editor.page.keyboard.press("Home")
        for _ in range(MOST_STOPS):
            if self.editor.page.evaluate("document.activeElement.getAttribute('aria-label')") == title:
                break
            self.editor.page.keyboard.press("ArrowRight")
        self.editor.page.keyboard.press("Enter")
        self.actions += 1

    def open_drawer(self, name: str) -> None:
        self.reach("#drawers [role=tab]")
        while not self.editor.page.evaluate(FOCUSED, f"#tab-{name}"):
            self.editor.page.keyboard.press("ArrowRight")
        self.actions += 1


@pytest.fixture
def wide(visit: Callable[..., Editor]) -> Editor:
    opened = visit((1440, 900))
    opened.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    return opened


@pytest.fixture(params=[Mouse, Keys], ids=["mouse", "keys"])
def hand(wide: Editor, request: pytest.FixtureRequest) -> Hand:
    made: Hand = request.param(wide)
    return made


def field(name: str) -> str:
    return f"#material-form [data-field={name}]"


def test_worn_brass_is_made_and_used_in_another_scene(hand: Hand) -> None:
    editor = hand.editor
    page = editor.page
    hand.press("#new-material")
    hand.write(f"{field('base_color')} input.entry", "#c09030")
    hand.write(f"{field('metallic')} input.number", "1")
    hand.write(f"{field('roughness')} input.number", "0.4")
    for each in ("base_color", "roughness"):
        hand.take(field(each), f"worn-{each}.png", image(*MAPS[each]))
        editor.wait(f"the image for {each}", lambda each=each: page.is_visible(f"{field(each)} .texture"))
    hand.press("#material-form details:has([data-field=normal_map]) > summary")
    hand.take(field("normal_map"), "worn-normal.png", image(*MAPS["normal_map"]))
    editor.wait("the image for the normals", lambda: page.is_visible(f"{field('normal_map')} .texture"))
    hand.press("#material-more")
    hand.press("#save-material")
    name = "worn brass"
    hand.write("dialog[open] input.entry", name)
    editor.wait("it to be saved", lambda: page.locator(f"#library [aria-label='{name}']").count() == 1)
    assert hand.actions < 18
    before = hand.actions
    hand.open_drawer("scenes")
    hand.pick("scenes", "Row of roughnesses, 0 to 1")
    editor.wait("the other scene", lambda: len(document(editor)["materials"]) > 3)
    hand.open_drawer("materials")
    hand.pick("library", name)
    editor.wait("its images", lambda: len(document(editor).get("textures", {})) == 3)
    assert hand.actions - before <= 4, "to find it again"
    assert editor.complaints == []


def test_two_models_are_compared_and_shared(hand: Hand) -> None:
    editor = hand.editor
    page = editor.page
    hand.pick("library", "Car paint")
    if isinstance(hand, Keys):
        page.keyboard.press("c")
        hand.actions += 1
    else:
        hand.press("#compare")
    page.wait_for_selector("#comparison select")
    hand.select("#comparison select[aria-label^=Turn]", "Disney")
    hand.select("#comparison [aria-label=Comparison]", "Difference")
    hand.press("#share")
    editor.wait("the link", lambda: "is copied" in editor.text("#messages"))
    assert hand.actions < 6
    assert "#v=" in page.evaluate("navigator.clipboard.readText()")
    assert page.get_attribute("#stage", "data-compare") == "difference"


def test_a_product_is_lit_with_two_lamps(hand: Hand) -> None:
    editor = hand.editor
    page = editor.page
    editor.settled()
    count = len(document(editor)["shapes"])
    for more in (1, 2):
        hand.add("Area light")
        editor.wait("a lamp", lambda more=more: len(document(editor)["shapes"]) == count + more)
        place = document(editor)["shapes"][-1]["origin"]
        mark = page.locator("#markers .mark.chosen")
        if isinstance(hand, Keys):
            hand.reach("#markers .mark.chosen")
            page.keyboard.press("ArrowLeft")
        else:
            editor.rest("the mark", mark.bounding_box)
            box = mark.bounding_box()
            assert box
            page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            page.mouse.down()
            page.mouse.move(box["x"] + 60, box["y"] + 60, steps=5)
            page.mouse.up()
        hand.actions += 1
        editor.wait("it to move", lambda place=place: document(editor)["shapes"][-1]["origin"] != place)
    hand.open_drawer("environments")
    hand.pick("environments", "Large softbox")
    editor.wait("it", lambda: editor.chosen("environments") == "softbox")
    assert hand.actions <= 6, "it was not possible in the picture, and took 14 for a light beside it"


def test_a_phone_gives_a_thing_copper_and_saves_its_picture(visit: Callable[..., Editor]) -> None:
    editor = visit((390, 844), scale=1, touch=True)
    page = editor.page
    actions = 0
    page.tap("#search-library")
    page.keyboard.type("copper")
    page.tap("#library [aria-label='Copper']")
    editor.wait("copper", lambda: editor.chosen("library") == "copper")
    actions += 3
    rough = page.locator(f"{field('roughness')} input[type=range]")
    box = rough.bounding_box()
    assert box and box["y"] + box["height"] <= 844, "in sight without scrolling"
    before = rough.input_value()
    page.touchscreen.tap(box["x"] + 0.7 * box["width"], box["y"] + box["height"] / 2)
    editor.wait("its roughness", lambda: rough.input_value() != before)
    actions += 1
    colour = page.locator("#material-form .color input.entry").first
    colour.fill("#c87050")
    colour.press("Enter")
    actions += 1
    page.tap("#export")
    with page.expect_download() as waiting:
        page.tap("#download")
        actions += 2
        now = page.get_by_role("button", name="Save now")
        if now.is_visible():
            now.tap()
            actions += 1
    assert waiting.value.path().read_bytes().startswith(b"\x89PNG")
    assert actions < 9
