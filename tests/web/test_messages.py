"""What the page says: in words, once, beside the picture, and only while it is true."""

from __future__ import annotations

import json
import re
from typing import Any

from playwright.sync_api import Route, WebSocketRoute

from tests.serving import Server
from tests.web.editor import Editor

PASTE = "(text) => { navigator.clipboard.readText = async () => text; }"


def test_refusals_are_short_and_go_with_the_next_change(editor: Editor) -> None:
    page = editor.page
    editor.settled()
    page.evaluate(PASTE, json.dumps({"type": "principled", "shine": 1, "roughness": 3}))
    editor.act("paste-material")
    editor.wait("the refusal", lambda: editor.text("#messages"))
    said = page.inner_text("#messages strong")
    assert said == "Roughness of material Red paint must be at most 1, not 3. Another value is wrong, too."
    places = """["stage", "messages", "state"].map((id) => document.getElementById(id).getBoundingClientRect())"""
    stage, text, state = page.evaluate(places)
    assert stage["left"] < text["left"] and text["right"] < stage["right"] and text["bottom"] < state["top"]
    assert text["top"] > stage["top"] + 0.7 * stage["height"], "at the foot of the picture"
    page.click("#library [data-value=gold]")
    editor.wait("its end", lambda: editor.text("#messages") == "")

    page.evaluate(PASTE, json.dumps({"type": "principled", "shine": 1}))
    editor.act("paste-material")
    editor.wait("the refusal", lambda: editor.text("#messages"))
    said = page.inner_text("#messages strong")
    assert said.startswith("“shine” of material Gold is not known here") and len(said) < 80


def test_the_newest_message_is_seen_and_goes_by_itself(editor: Editor) -> None:
    """Where nobody reads it; a refusal stays, and what lasts is seen again."""
    page = editor.page
    page.evaluate("""async () => {
        const { Messages } = await import(new URL("panels/messages.js", location));
        window.told = new Messages(document.getElementById("messages"), () => [], 3000);
        const list = ["Base colour: oak_diff", "Roughness: oak_rough"];
        told.show("upload", { title: "Sending oak.zip", lasting: true, progress: true });
        told.show("share", { title: "The link is copied." });
        told.show("import", { title: "oak: 2 images", list });
    }""")
    seen = "[...document.querySelectorAll('.message')].filter((each) => each.checkVisibility()).length"
    assert page.evaluate(seen) == 1 and editor.text("#messages strong") == "oak: 2 images"
    assert page.locator(".message.share").count() == 0, "the newest replaces what would go by itself"
    assert "Roughness" not in editor.text("#messages"), "a list is one line until somebody wants it"
    page.click("#messages summary")
    page.mouse.move(0, 0)
    page.wait_for_timeout(3500)
    assert "Roughness: oak_rough" in editor.text("#messages"), "and stays while it is read"
    page.click("#messages summary")
    page.evaluate("document.activeElement.blur()")
    page.mouse.move(0, 0)
    editor.wait("the one that lasts", lambda: editor.text("#messages").startswith("Sending oak.zip"))
    page.evaluate("told.hide('upload'); told.show('refusal', { title: 'oak.zip was not taken.' })")
    page.wait_for_timeout(3500)
    assert editor.text("#messages strong") == "oak.zip was not taken."
    page.evaluate("told.hide('refusal')")


def test_no_answer_is_told_in_words(editor: Editor) -> None:
    def fail(route: Route) -> None:
        route.abort()

    editor.page.route("**/v1/presets/scenes/*", fail)
    before = editor.chosen("scenes")
    editor.pick("scenes", "cornell-boxes")
    editor.wait("the words", lambda: editor.text("#messages"))
    assert editor.page.inner_text("#messages strong") == "The server does not answer. Your work is safe here."
    assert editor.chosen("scenes") == before
    editor.page.unroute("**/v1/presets/scenes/*")
    editor.pick("scenes", "cornell-boxes")
    editor.wait("the end of the words", lambda: editor.text("#messages") == "")


def test_the_old_scene_is_not_taken_for_the_new_one(blank: Editor, server: Server) -> None:
    editor, page = blank, blank.page
    held: list[Any] | None = None
    routes: list[WebSocketRoute] = []

    def pass_on(route: WebSocketRoute) -> None:
        routes.append(route)

        def hear(message: Any) -> None:
            if held is None or isinstance(message, str):
                route.send(message)
            else:
                held.append(message)

        route.connect_to_server().on_message(hear)

    page.route_web_socket("**/v1/stream**", pass_on)
    editor.open(server.url)
    assert page.is_hidden("#preparing")
    held = []
    editor.pick("scenes", "cornell-boxes")
    editor.wait("the choice", lambda: editor.chosen("scenes") == "cornell-boxes")
    title = page.get_attribute("#scenes [aria-selected=true]", "aria-label")
    editor.wait("the words", lambda: page.is_visible("#preparing"))
    assert page.inner_text("#preparing").startswith(f"{title}") and editor.text("#state") == "Preparing"
    editor.wait("for how long", lambda: re.fullmatch(rf"{re.escape(title)}: \d+ s.*", page.inner_text("#preparing")))
    light = "getComputedStyle(document.getElementById('sheet'))"
    assert page.evaluate(f"[{light}.filter, {light}.opacity]") == ["none", "1"], "the last picture stays"
    for reading in ("samples", "rate", "noise", "elapsed", "left"):
        assert page.text_content(f"#{reading}") == "–", "the readings were the old picture's"
    late, held = held, None
    for frame in late:
        routes[-1].send(frame)
    editor.wait("the new picture", lambda: page.is_hidden("#preparing") and editor.samples() >= 1)

    editor.settled()
    held = []
    title = page.get_attribute("#library [data-value=gold]", "aria-label")
    page.locator("#library [data-value=gold]").dispatch_event("click")
    editor.wait("the words", lambda: page.inner_text("#preparing").startswith(title or "?"))
    late, held = held, None
    for frame in late:
        routes[-1].send(frame)
    editor.wait("gold", lambda: page.is_hidden("#preparing"))
