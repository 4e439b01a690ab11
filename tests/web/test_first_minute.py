"""The page before its first picture, and what it says to whoever is new."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from playwright.sync_api import Page, WebSocketRoute

from tests.serving import Server
from tests.web.editing import halves
from tests.web.editor import Editor

KEPT = """async (name) => {
    const { recall } = await import(new URL("lib/browser-storage.js", location));
    return (await recall(`last picture ${name}`))?.of ?? null;
}"""


class Held:
    """A stream whose frames wait until somebody lets them go."""

    def __init__(self, page: Page) -> None:
        self.isHolding = False
        self.frames: list[tuple[WebSocketRoute, Any]] = []
        page.route_web_socket("**/v1/stream**", self._pass_on)

    def _pass_on(self, route: WebSocketRoute) -> None:
        def hear(message: Any) -> None:
            if self.isHolding and isinstance(message, bytes):
                self.frames.append((route, message))
            else:
                route.send(message)

        route.connect_to_server().on_message(hear)

    def release(self) -> None:
        self.isHolding = False
        for route, frame in self.frames:
            route.send(frame)
        self.frames.clear()


@pytest.fixture
def held(blank: Editor, server: Server) -> Held:
    """Of a page that shows its first picture."""
    blank.open(server.url)
    return Held(blank.page)


def visit(editor: Editor, url: str) -> None:
    """As from a bookmark: an address that differs in its fragment alone would load nothing."""
    editor.page.goto("about:blank")
    editor.page.goto(url)
    editor.page.wait_for_selector("#library [role=option]")


def test_the_last_picture_of_a_scene_stands_until_the_next_is_there(
    blank: Editor, held: Held, server: Server
) -> None:
    editor, page = blank, blank.page
    last, label, scene = "#last-picture", "#preparing", f"{server.url}/#scene=sphere-on-floor"
    editor.wait("a picture to be kept", lambda: page.evaluate(KEPT, "sphere-on-floor") == "")
    held.isHolding = True
    visit(editor, scene)
    editor.wait("the last picture", lambda: page.is_visible(last))
    assert editor.text("#state") == "Preparing"
    assert page.evaluate("getComputedStyle(document.querySelector('#last-picture')).filter") == "none", "as it was"
    held.release()
    editor.wait("the picture itself", lambda: page.is_hidden(last) and editor.samples() >= 1)
    assert page.is_hidden(label)

    held.isHolding = True
    visit(editor, f"{server.url}/#scene=cornell-empty")
    editor.wait("the words", lambda: page.is_visible(label))
    assert re.match(r"Cornell .*empty.*", editor.text(label)), editor.text(label)
    assert page.is_hidden(last), "it is another scene"

    held.release()
    editor.wait("that one", lambda: editor.samples() >= 1)
    page.focus("#stage")
    page.keyboard.press("ArrowLeft")
    scene_now = "JSON.parse(localStorage['sunbox.work ' + sessionStorage['sunbox.tab']] ?? 'null')?.scene"
    same = lambda: json.loads(page.evaluate(KEPT, "work") or "[0]")[0] == page.evaluate(scene_now)  # noqa: E731
    editor.wait("a picture of the work", same)
    held.isHolding = True
    visit(editor, server.url)
    editor.wait("it again", lambda: page.is_visible(last))
    assert editor.complaints == []


def test_the_first_picture_comes_with_the_page(editor: Editor, server: Server) -> None:
    """Before any other code, where the live one will be; but not to whoever has work, or follows a link."""
    page = editor.page.context.new_page()
    page.route("**/main.js", lambda route: route.abort())
    page.goto(server.url)
    first, stage = page.locator("#last-picture"), page.locator("main")
    assert first.is_visible() and first.evaluate("image => image.complete && image.naturalWidth") == 1440
    for width, height in ((1440, 900), (390, 844), (1440, 500)):
        page.set_viewport_size({"width": width, "height": height})
        box, room = first.bounding_box(), stage.bounding_box()
        assert box is not None and room is not None
        tall = min(room["height"], room["width"] * 9 / 16)
        assert [box["width"], box["height"]] == pytest.approx([room["width"], tall], abs=1)
        assert box["y"] + box["height"] / 2 == pytest.approx(room["y"] + room["height"] / 2, abs=1)
    page.goto("about:blank")
    page.goto(f"{server.url}/#scene=cornell-boxes")
    assert first.is_hidden()
    page.goto(server.url)
    page.evaluate("localStorage['sunbox.work x'] = '{}'")
    page.reload()
    assert first.is_hidden()
    page.evaluate("delete localStorage['sunbox.work x']")
    page.close()


def test_the_page_is_laid_out_before_its_code_runs(editor: Editor, server: Server) -> None:
    """Nothing that has a place of its own moves when the page comes to life."""
    early = editor.page.context.new_page()
    early.route("**/main.js", lambda route: route.abort())
    early.goto(server.url)
    for width, height in ((390, 844), (844, 390), (1024, 768), (1440, 900)):
        for page in (early, editor.page):
            page.set_viewport_size({"width": width, "height": height})
        editor.wait("the outline as there is room", lambda: editor.page.get_attribute("body", "data-outline"))
        editor.page.wait_for_timeout(100)
        for part in (".top", "main", "#shelf", "#panel", ".tools", "#render"):
            before, after = (page.locator(part).bounding_box() for page in (early, editor.page))
            assert before == pytest.approx(after, abs=1), (width, height, part)
    early.close()


def test_what_is_being_prepared_says_how_long_that_may_take(blank: Editor, held: Held) -> None:
    editor, page = blank, blank.page
    page.evaluate("localStorage['sunbox.preparing'] = JSON.stringify({ scene: [1, 400, 500, 600], change: [50] })")
    held.isHolding = True
    visit(editor, page.url)
    editor.wait("the time", lambda: "left" in editor.text("#preparing"))
    words = editor.text("#preparing").split(": ")[1]
    seconds, left = (int(part.removeprefix("about ").split()[0]) for part in words.split(", "))
    assert left == 500 - seconds, "the median of those that took longer"
    held.release()
    editor.wait("the picture", lambda: page.is_hidden("#preparing"))
    kept = json.loads(page.evaluate("localStorage['sunbox.preparing']"))
    assert seconds <= kept["scene"][-1] < 400 and kept["change"] == [50], "it is remembered for the next time"


def test_a_hint_says_what_can_be_dropped_until_something_was(editor: Editor, server: Server) -> None:
    page = editor.page
    assert editor.text("#hint").startswith("Drop a model, an environment, a texture")
    editor.drop("#stage", {"halves.png": halves()})
    assert page.is_hidden("#hint")
    second = Editor(page.context.new_page())
    second.open(server.url)
    assert second.page.is_hidden("#hint"), "for good"
    second.page.evaluate("localStorage.removeItem('sunbox.ui')")
    second.page.reload()
    second.page.get_by_role("button", name="Dismiss this hint").click()
    assert second.page.is_hidden("#hint")
    second.page.reload()
    second.page.wait_for_selector("#library [role=option]")
    assert second.page.is_hidden("#hint")
